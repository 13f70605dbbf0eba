"""Checks of names in a manifest: groups, families, categories, materials, lamps, files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from isethdr_core.data.categories import CATEGORIES
from isethdr_core.errors import ConfigError, did_you_mean

from ...lamps import KINDS
from ...materials import MATERIALS
from ..registry import GROUPS, RIDDEN
from .emitters import check_beam
from .manifest import LampFaces, ThingForm
from .mesh_file import SUFFIXES

# groups of things that are placed by the names of their families; a new family is never placed
BY_FAMILY = ("street lamp", "traffic light", "sign", "building", "barrier", "furniture")
NOT_OPEN = ("rider",)  # drawn together with bicycles
OPEN_GROUPS = tuple(group for group in GROUPS if group not in NOT_OPEN)
NAMES = re.compile(r"[a-z][a-z0-9_]*")
LEVEL = 1e-6  # least level part of the axis of a lamp with a table, relative to its length
LICENCE_WORDS = "for example CC0-1.0, CC-BY-4.0, MIT, or proprietary"


def category_of(group: str, family: str) -> str:
    """Return the category of a family. For a new family it is that of the group's families, or ""
    if they differ.
    """
    families = GROUPS[group]
    known = families.shares()
    chosen = [family] if family in known else list(known)
    found = {families.thing(name, 0).category for name in chosen}
    return found.pop() if len(found) == 1 else ""


def entry_mistakes(name: str, form: ThingForm, licence: str, folder: Path) -> Iterator[str]:
    """Yield the mistakes of an entry, except those of its mesh.

    Parameters
    ----------
    name : name of the entry.
    form : its content.
    licence : licence of the pack; "": it states none.
    folder : folder of the pack, with the files of the entry.
    """
    if not NAMES.fullmatch(name):
        yield "its name is not valid; expected lower-case letters, digits and underscores"
    if not (form.licence or licence):
        yield f"states no licence; type licence: ..., {LICENCE_WORDS}"
    if form.group not in OPEN_GROUPS:
        yield _unknown("group", form.group, OPEN_GROUPS)
    else:
        yield from _names_of_group(form)
    yield from _file_mistakes(form, folder)
    for key, value in form.materials.items():
        if isinstance(value, str) and value not in MATERIALS:
            near = did_you_mean(value, MATERIALS)
            yield (
                f"materials.{key}: there is no material {value!r}{near}; type one of isethdr things"
                ' materials, or {colour: "#rrggbb"}'
            )
    for number, lamp in enumerate(form.lamps):
        for mistake in _lamp_mistakes(lamp, folder):
            yield f"lamps[{number}]: {mistake}"


def _names_of_group(form: ThingForm) -> Iterator[str]:
    families = GROUPS[form.group].shares()
    if form.group in BY_FAMILY and form.family not in families:
        yield (
            f"family is {form.family!r}; things of the group {form.group} are placed by family:"
            f" expected a bundled one{did_you_mean(form.family, families)}"
        )
    if form.category and form.category not in CATEGORIES:
        yield _unknown("category", form.category, CATEGORIES)
    elif not form.category and not category_of(form.group, form.family):
        yield (
            f"category is missing, and the families of {form.group} have several; expected one of"
            f" {', '.join(CATEGORIES)}"
        )
    if form.group in RIDDEN and form.riding is None:
        yield (
            f"things of the group {form.group} have a rider, but riding is missing; type riding:"
            " {saddle: [x, y, z], grip: [...], foot: [...]}, in metres, grip and foot on the left"
        )
    if form.axes and form.axes.forward[-1] == form.axes.up[-1]:
        yield (
            f"axes: forward {form.axes.forward} and up {form.axes.up} are parallel; expected a"
            " right angle"
        )


def _file_mistakes(form: ThingForm, folder: Path) -> Iterator[str]:
    path = folder / form.file
    if path.suffix.lower() not in SUFFIXES:
        yield f"file is {form.file}; expected a name that ends in {', '.join(SUFFIXES)}"
    elif not path.is_file():
        there = [str(p.relative_to(folder)) for p in sorted(folder.rglob("*")) if p.is_file()]
        yield f"there is no file {form.file} in the pack{did_you_mean(form.file, there)}"


def _lamp_mistakes(lamp: LampFaces, folder: Path) -> Iterator[str]:
    if lamp.kind not in KINDS:
        yield _unknown("kind", lamp.kind, KINDS)
    if not np.any(lamp.axis):
        yield "axis is [0, 0, 0]; expected the direction of its light, for example [1, 0, 0] ahead"
    elif _has_directions(lamp) and np.hypot(*lamp.axis[:2]) < LEVEL * np.linalg.norm(lamp.axis):
        end = "-1" if lamp.axis[2] < 0 else "1"
        yield (
            f"axis is {list(lamp.axis)}, straight up or down, where left of its light is not known;"
            f" expected a tilt; type for example axis: [0.01, 0, {end}], which tilts it ahead"
        )
    if not lamp.part and lamp.box_m is None:
        yield "its faces are missing; type part: NAME, or box_m: [[x, y, z], [x, y, z]]"
    stated = {"candela": lamp.candela, "cd_m2": lamp.cd_m2, "beam": lamp.beam}
    levels = [key for key, level in stated.items() if level]
    if len(levels) > 1:
        yield f"states {' and '.join(levels)}; expected one of them"
    if lamp.beam:
        try:
            check_beam(lamp, folder)
        except ConfigError as error:
            yield f"beam: {error}"


def _has_directions(lamp: LampFaces) -> bool:
    """Return whether the light of a lamp is a table over two angles; else it is Lambertian."""
    kind = KINDS.get(lamp.kind)
    return bool(lamp.beam or kind and (kind.family or kind.luminaire))


def _unknown(field: str, value: str, expected: Iterable[str]) -> str:
    return f"{field} is {value!r}; expected another one{did_you_mean(value, expected)}"
