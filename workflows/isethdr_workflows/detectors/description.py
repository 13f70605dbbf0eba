"""The form of `detector.yaml`, which describes a detector in the folder of its ONNX file.

Pydantic reports all unknown fields, missing fields and wrong types together.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from isethdr_core.errors import ConfigError, did_you_mean

from .boxes import BoxForm
from .classes import CLASSES

Count = Annotated[int, Field(ge=1)]
Share = Annotated[float, Field(ge=0, le=1)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Three = tuple[Number, Number, Number]
ThreePositive = tuple[Positive, Positive, Positive]


class Form(BaseModel):
    """A part of the description. Fields that it does not define are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class InputForm(Form):
    """The picture that the network reads.

    Values of a displayed picture are 0 (black) to 1 (white). The network gets
    (value * full_scale - mean) / std.
    """

    name: str = ""  # name of the network's input; "": its only input
    size_px: tuple[Count, Count] | None = None  # width, height; None: those of the picture
    multiple_px: Count = 32  # width and height are filled up to a multiple, without size_px
    layout: Literal["nchw", "nhwc"] = "nchw"  # order of the axes: channels first or last
    channels: Literal["rgb", "bgr"] = "rgb"
    # png: as written by `isethdr export --to png`; srgb: sRGB, clipped at the white; linear: the
    # same without the curve of sRGB
    tone: Literal["png", "srgb", "linear"] = "png"
    full_scale: Positive = 1.0  # the value of white; 255 for networks that read 8 bits
    mean: Three = (0.0, 0.0, 0.0)  # subtracted from each channel of the network, after full_scale
    std: ThreePositive = (1.0, 1.0, 1.0)  # divisor of each channel, after the mean is subtracted
    # letterbox: one scale for both axes, and the rest is filled; stretch: a scale for each axis
    fit: Literal["letterbox", "stretch"] = "letterbox"
    place: Literal["centre", "corner"] = "centre"  # place of the picture within the letterbox
    fill: Share = 0.0  # displayed value around the picture


class OutputForm(Form):
    """The outputs of the network."""

    # apart: boxes (1, n, 4) and scores (1, n, classes), two outputs
    # joined: (1, n, 4 + classes), one output; with objectness (1, n, 5 + classes)
    # labelled: boxes (n, 4), scores (n,) and numbers of classes (n,), three outputs
    # rows: (n, 6), box, score and number of the class, one output
    form: Literal["apart", "joined", "labelled", "rows"]
    names: tuple[str, ...] = ()  # names of the outputs in this order; (): the file's first outputs
    boxes_last: bool = False  # whether the axis of the boxes is the last one: (1, 4 + classes, n)
    box: BoxForm = "xyxy"
    unit: Literal["px", "share"] = "px"  # unit of boxes: pixels of the input, or shares of its size
    # both only where each class has a score, in the forms apart and joined
    activation: Literal["none", "sigmoid", "softmax"] = "none"  # function to apply to the scores
    objectness: bool = False  # whether a score of "any object", a factor, precedes the classes


class SelectionForm(Form):
    """The selection of boxes that count."""

    least_score: Number = 0.01
    overlap: Share = 0.6  # if two boxes of a class overlap more, the weaker goes; 1 keeps all
    most: Count = 100  # largest number of boxes in a picture


class DetectorForm(Form):
    """A detector: the ONNX file, its input, its outputs, and its classes."""

    model: str  # name of the ONNX file, in the folder of this one
    about: str = ""  # text for readers: source, licence, training
    input: InputForm = InputForm()
    output: OutputForm
    select: SelectionForm = SelectionForm()
    # {number of a class in the network: class of the study}; other numbers are left out
    classes: Annotated[dict[int, str], Field(min_length=1)]
    lacks: tuple[str, ...] = ()  # classes of the study that the network does not know
    trained_roads: tuple[str, ...] = ()  # roads that it was trained on, which are never scored


INNER: dict[str, type[Form]] = {
    "input": InputForm,
    "output": OutputForm,
    "select": SelectionForm,
}


def read_description(path: Path) -> DetectorForm:
    """Return the description of a detector.

    Raises
    ------
    ConfigError : there is no such file, it is not YAML, a field is missing, unknown or wrong, or
        the table of classes lacks a class or names an unknown one.
    """
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        near = [str(file) for file in sorted(path.parent.glob("*.yaml"))]
        raise ConfigError(
            f"the detector is {path}; expected a YAML file that describes one"
            f" (docs/how-to/detectors.md){did_you_mean(str(path), near) if near else ''}"
        )
    try:
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} cannot be read as YAML: {error}") from None
    try:
        form = DetectorForm.model_validate(told)
    except ValidationError as error:
        mistakes = [_mistake(one["type"], one["loc"], one["msg"]) for one in error.errors()]
        raise ConfigError(f"{path}: " + "; ".join(mistakes)) from None
    _check_classes(path, form)
    _check_scores(path, form.output)
    return form


def written(form: DetectorForm) -> str:
    """Return a description as YAML, with the fields that differ from their defaults."""
    content: dict[str, Any] = form.model_dump(mode="json", exclude_defaults=True)
    content["classes"] = dict(form.classes)  # JSON has no numbers as keys
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=100)


def _check_classes(path: Path, form: DetectorForm) -> None:
    named = set(form.classes.values())
    for name in sorted({*named, *form.lacks} - set(CLASSES)):
        raise ConfigError(f"{path}: the class {name!r} is unknown{did_you_mean(name, CLASSES)}")
    if both := sorted(named & set(form.lacks)):
        raise ConfigError(f"{path}: {', '.join(both)} is in classes and in lacks; expected in one")
    missing = [name for name in CLASSES if name not in {*named, *form.lacks}]
    if missing:
        raise ConfigError(
            f"{path}: no class of the network is {', '.join(missing)}; expected every class"
            f" of the study in classes, or in lacks; type for example lacks: [{missing[0]}]"
        )


def _check_scores(path: Path, output: OutputForm) -> None:
    if output.form in ("apart", "joined"):
        return
    ignored = {"activation": output.activation != "none", "objectness": output.objectness}
    for name in (name for name, is_set in ignored.items() if is_set):
        raise ConfigError(
            f"{path}: output.{name} is for scores of each class, and output.form: {output.form}"
            f" has one score for each box; expected output.form: apart or joined; or remove"
            f" output.{name}, and apply it in the exported graph"
        )


def _mistake(kind: str, place: tuple[str | int, ...], message: str) -> str:
    """Return a message about a mistake at a place of the form."""
    words = [str(part) for part in place]
    where = ".".join(words)
    if kind == "missing":
        return f"{where} is missing"
    if kind == "extra_forbidden":
        inner = INNER.get(words[0], DetectorForm) if len(words) > 1 else DetectorForm
        return f"{where} is no field{did_you_mean(words[-1], inner.model_fields)}"
    return f"{where}: {message}" if where else message
