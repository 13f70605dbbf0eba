"""The form of `pack.yaml`, the manifest of an asset pack.

Pydantic finds all unknown fields, missing fields and wrong types at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from isethdr_core.errors import ConfigError, did_you_mean

NAME = "pack.yaml"
Direction = Literal["x", "-x", "y", "-y", "z", "-z"]
Finish = Literal["matt", "satin", "gloss", "metal", "glass"]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Point = tuple[Number, Number, Number]


class Form(BaseModel):
    """A part of the manifest. Fields that it does not name are mistakes."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Axes(Form):
    """The axes of the file that point forward and up."""

    forward: Direction
    up: Direction


class Colour(Form):
    """A surface with a colour and a finish, in place of a bundled material."""

    colour: Annotated[str, Field(pattern="^#[0-9a-fA-F]{6}$")]  # sRGB
    finish: Finish = "satin"


class LampFaces(Form):
    """Faces of a lamp, selected by part, by box, or by both. Those that face the axis emit."""

    kind: str  # a key of `lamps.KINDS`
    axis: Point  # x ahead, y to the left, z up; any length
    part: str = ""  # name of a mesh or material of the file
    box_m: tuple[Point, Point] | None = None  # least and greatest x, y, z of the faces' middles
    candela: Positive | None = None  # largest luminous intensity; None: that of the kind
    # largest intensity per area of the faces projected along the axis, in place of `candela`
    cd_m2: Positive | None = None
    beam: str = ""  # a file of LM-63 (.ies) or EULUMDAT (.ldt), in place of both


class Riding(Form):
    """Points where a rider touches a two-wheeler, m. The origin is its middle on the ground."""

    saddle: Point
    grip: Point  # left grip
    foot: Point  # left foot


class ThingForm(Form):
    """A thing of a pack."""

    file: str
    group: str
    family: str = ""  # a bundled or a new family; "": the name of the thing
    category: str = ""  # category of the labels; "": that of the family or the group
    licence: str = ""  # "": the licence of the pack
    # share of the draws of the group and of the family
    share: Annotated[float, Field(gt=0, le=1)] | None = None
    scale: Positive = 1.0  # metres per unit of the file
    axes: Axes | None = None  # None: the axes of the format
    open: bool = False  # whether holes in the mesh are intended
    materials: dict[str, str | Colour] = {}
    lamps: tuple[LampFaces, ...] = ()
    riding: Riding | None = None


FormT = TypeVar("FormT", bound=Form)
INNER: dict[str, type[Form]] = {
    "lamps": LampFaces,
    "axes": Axes,
    "riding": Riding,
    "materials": Colour,
}
EXPECTED = {
    "axis": "where the lamp shines: [1, 0, 0] ahead, [-1, 0, 0] to the rear",
    "kind": "a kind of lamp, such as low_beam, tail or brake",
    "file": "a GLB, OBJ or PLY in the pack",
    "group": "a group of things (isethdr things list)",
    "things": "the things of the pack by name",
    "forward": "x, -x, y, -y, z or -z",
    "up": "x, -x, y, -y, z or -z",
    "colour": 'sRGB as "#rrggbb"',
}


class Manifest(Form):
    """A pack. `things` maps names to entries in the form of `ThingForm`."""

    licence: str = ""
    source: str = ""  # origin of the files, as information for readers
    things: Annotated[dict[str, Any], Field(min_length=1)]


@dataclass(frozen=True)
class Told:
    """Content of a manifest: the entries with a valid form, and the mistakes of the others."""

    licence: str
    things: Mapping[str, ThingForm]
    mistakes: tuple[str, ...]


def read_manifest(folder: Path) -> Told:
    """Return the manifest of a folder, with the mistakes in its form.

    Raises
    ------
    ConfigError : there is no manifest, or it is not YAML.
    """
    path = folder / NAME
    if not path.is_file():
        raise ConfigError(
            f"the asset pack {folder} has no {NAME}; expected a folder with meshes and this"
            " manifest (docs/how-to/asset_packs.md)"
        )
    try:
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} cannot be read as YAML: {error}") from None
    manifest, mistakes = _checked(Manifest, told, NAME)
    if manifest is None:
        return Told("", {}, tuple(mistakes))
    things = {}
    for name, entry in manifest.things.items():
        thing, wrong = _checked(ThingForm, entry, name)
        mistakes += wrong
        if thing is not None:
            things[name] = thing
    return Told(manifest.licence, things, tuple(mistakes))


def _checked(form: type[FormT], value: Any, name: str) -> tuple[FormT | None, list[str]]:
    """Return the value in its form, or None and the mistakes."""
    try:
        return form.model_validate(value), []
    except ValidationError as error:
        wrong = [_mistake(form, one["type"], one["loc"], one["msg"]) for one in error.errors()]
        return None, [f"{name}: {mistake}" for mistake in wrong]


def _mistake(outer: type[Form], kind: str, place: tuple[str | int, ...], message: str) -> str:
    """Return the message of a mistake in a form.

    Parameters
    ----------
    outer : form that was checked.
    kind : type of the mistake, as pydantic names it.
    place : place of the mistake in the form.
    message : message of pydantic.
    """
    words = [str(part) for part in place if part not in ("Colour", "str")]
    where = ".".join(words)
    inner = INNER.get(words[0], outer) if len(words) > 1 else outer
    if kind == "missing":
        return f"{where} is missing; expected {EXPECTED.get(words[-1], 'a value')}"
    if kind == "extra_forbidden":
        return f"{where} is no field{did_you_mean(words[-1], inner.model_fields)}"
    return f"{where}: {message}" if where else message
