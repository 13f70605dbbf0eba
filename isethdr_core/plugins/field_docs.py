"""Field documentation: meaning, unit, default, range and origin of each field of a component.

The meaning is the comment beside or above the field; unit, default and range are those of its name
and annotation; the origin is the class that defines the field. The command line and the pages of
docs/reference show the same rows.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import io
import re
import textwrap
import tokenize
from functools import cache
from typing import Any, Literal, get_args, get_origin

from .ranges import field_types, on_command_line, range_text

# the end of a field's name, and its unit
UNITS = {
    "_um_per_mm": "um/mm",
    "_uv_per_e": "uV/e",
    "_lines_per_mm": "1/mm",
    "_per_mm2": "1/mm2",
    "_per_mm": "1/mm",
    "_per_m": "1/m",
    "_per_km": "1/km",
    "_e_per_s": "e/s",
    "_per_s": "1/s",
    "_kmh": "km/h",
    "_m_s": "m/s",
    "_cd_m2": "cd/m2",
    "_percent": "%",
    "_lux": "lx",
    "_nm": "nm",
    "_um": "um",
    "_uv": "uV",
    "_mm": "mm",
    "_m": "m",
    "_s": "s",
    "_e": "e",
    "_v": "V",
    "_dn": "DN",
    "_deg": "deg",
    "_mrad": "mrad",
    "_px": "px",
    "_c": "C",
    "_hz": "Hz",
}


@dataclasses.dataclass(frozen=True)
class FieldRow:
    """The documentation of one field of a component."""

    name: str
    meaning: str  # "" where the field has no comment
    unit: str
    default: str  # as the command line takes it; "" where a value is required
    allowed: str  # a range, names, or the type in words
    choices: tuple[str, ...] = dataclasses.field(default=(), compare=False)  # names it may hold
    origin: str = dataclasses.field(default="", compare=False)  # module:Class that defines it


def field_rows(cls: type) -> list[FieldRow]:
    """Return one row for each field of a component, in the order of the class."""
    types = field_types(cls)
    meanings = field_comments(cls)
    origins = field_origins(cls)
    rows = []
    for field in dataclasses.fields(cls):
        if not field.init:
            continue
        default = ""
        if field.default_factory is not dataclasses.MISSING:
            default = on_command_line(field.default_factory())
        elif field.default is not dataclasses.MISSING:
            default = on_command_line(field.default)
        annotation = types[field.name]
        rows.append(
            FieldRow(
                field.name,
                meanings.get(field.name, ""),
                unit_of(field.name, annotation),
                default,
                allowed(annotation),
                choices(annotation),
                origins[field.name],
            )
        )
    return rows


def choices(annotation: Any) -> tuple[str, ...]:
    """Return the names that a field may hold, () where it takes any number or text."""
    return ("true", "false") if bool in scalars(annotation) else tuple(literal_names(annotation))


def field_origins(cls: type) -> dict[str, str]:
    """Return, as `module:Class`, the class that first defines each field of a component."""
    origins: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        for name in base.__dict__.get("__annotations__", {}):
            origins.setdefault(name, f"{base.__module__}:{base.__qualname__}")
    return origins


def unit_of(name: str, annotation: Any) -> str:
    """Return the unit that a field's name states; 1 for a number without, "" for anything else."""
    for end, unit in UNITS.items():
        if name.endswith(end):
            return unit
    return "1" if any(number in scalars(annotation) for number in (int, float)) else ""


def scalars(annotation: Any) -> set[Any]:
    """Return the plain types inside an annotation, keys of tables left out."""
    inner = get_args(annotation)
    if get_origin(annotation) is Literal:
        return set()
    if get_origin(annotation) is dict:
        inner = () if inner[1:] == (Any,) else inner[1:]
    if not inner:
        return {annotation}
    return set().union(*map(scalars, inner))


def allowed(annotation: Any) -> str:
    """Return the values that an annotation allows: names, a range, or the type in words."""
    names = literal_names(annotation)
    limits = range_text(annotation)
    scalar_types = scalars(annotation)
    parts = [*([", ".join(f"`{name}`" for name in names)] if names else [])]
    if bool in scalar_types:
        parts.append("true, false")
    if limits:
        parts.append(limits)
    if not limits and has_table(annotation):
        parts.append("a table")
    elif str in scalar_types:
        parts.append("text")
    if type(None) in scalar_types:
        parts.append("`null`")
    return ", or ".join(parts)


def has_table(annotation: Any) -> bool:
    """Return whether a field may hold a table."""
    return dict in (annotation, get_origin(annotation)) or any(
        has_table(part) for part in get_args(annotation)
    )


def literal_names(annotation: Any) -> list[str]:
    """Return the names that the `Literal`s inside an annotation allow."""
    if get_origin(annotation) is Literal:
        return [str(value) for value in get_args(annotation)]
    return [name for part in get_args(annotation) for name in literal_names(part)]


def field_comments(cls: type) -> dict[str, str]:
    """Return the comment of every field of a dataclass, by the class that defines the field last.

    A class that changes a default without a comment keeps the comment of its base.
    """
    comments: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        if dataclasses.is_dataclass(base):
            comments |= {name: text for name, text in own_comments(base).items() if text}
    return comments


@cache
def own_comments(cls: type) -> dict[str, str]:
    """Return the comments of the fields that one class defines.

    `# --- readings: A, B ---` opens a group of fields that hold one number for each of its names.
    """
    try:
        source = textwrap.dedent(inspect.getsource(cls))
    except (OSError, TypeError):  # a class that was not read from a file
        return {}
    beside: dict[int, str] = {}
    above: dict[int, str] = {}
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            alone = token.line.strip().startswith("#")
            (above if alone else beside)[token.start[0]] = token.string.lstrip("# ")
    [definition] = ast.parse(source).body
    assert isinstance(definition, ast.ClassDef)
    comments = {}
    group = ""
    for node in definition.body:
        if not isinstance(node, ast.AnnAssign) or not isinstance(node.target, ast.Name):
            continue
        block: list[str] = []
        line = node.lineno - 1
        while line in above:
            if above[line].startswith("---"):
                group = above[line].strip("- ")
                break
            block.insert(0, above[line])
            line -= 1
        block += [beside[k] for k in range(node.lineno, (node.end_lineno or 0) + 1) if k in beside]
        text = " ".join(block)
        if text and ast.unparse(node.annotation).startswith("tuple") and ": " in group:
            text += f"; {group}"
        comments[node.target.id] = text
    return comments


def description(cls: type) -> list[str]:
    """Return the paragraphs of a class's docstring, up to its first numpydoc section."""
    text = re.split(r"\n\w+\n-{3,}\n", inspect.getdoc(cls) or "")[0]
    return [" ".join(part.split()) for part in text.strip().split("\n\n") if part.strip()]
