"""Typed texts: Hydra reads `2026_11_29` and `1e5` as numbers, also where a name is expected. Such
values are put between quotes before Hydra reads them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from hydra.core.override_parser.overrides_parser import OverridesParser

from ..plugins.component import KINDS
from ..plugins.registry import class_of, components

TEXTS = ("name", "tags", "device")  # settings of a run that hold texts
TABLES = {"cameras": "sensor", "versions": "lighting"}  # tables with components of another name
# what may be typed without quotes, between commas, and within brackets
PLAIN = re.compile(r"[\w.+\-, \[\]'\"]*", re.ASCII)
PART = re.compile(r"'(?:\\.|[^'\\])*'|\"(?:\\.|[^\"\\])*\"|[\w.+-]+(?: +[\w.+-]+)*", re.ASCII)
HOLDS_TEXTS = (Union, UnionType, tuple, list)


def with_texts(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with quotes around texts that Hydra would read as numbers, as in
    `name=2026_11_29`, and with `tags=night,wet` as a list, which Hydra does not sweep over.

    `null` stays: it leaves a setting out. Quotes that are typed stay as well.
    """
    chosen = {key: value for key, _, value in (argument.partition("=") for argument in arguments)}
    return [
        argument if argument.startswith("-") else _quoted(argument, chosen)
        for argument in arguments
    ]


def _quoted(argument: str, chosen: Mapping[str, str]) -> str:
    key, equals, value = argument.partition("=")
    name = key.lstrip("+")
    if not equals or value.strip().lower() == "null":
        return argument
    if name == "tags" and "[" not in value:
        value = f"[{value}]"
    if not PLAIN.fullmatch(value):  # an interpolation, a table or a function of Hydra
        return f"{key}={value}"
    value = value.strip()  # Hydra accepts no space after a quote
    if name in TEXTS:
        return f"{key}={PART.sub(lambda part: _as_text(part[0]), value)}"
    table, dot, field = name.partition(".")
    kind = TABLES.get(table, table)
    if not dot or kind not in KINDS:
        return argument
    texts = PART.sub(lambda part: _as_text_or_null(part[0]), value)
    # the classes are imported only if the text would change
    if texts == value or not _is_text(kind, chosen.get(table), field.rpartition(".")[2]):
        return argument
    return f"{key}={texts}"


def _as_text(part: str) -> str:
    """Return a part of a value, in quotes if Hydra would not read it as this text."""
    if part[0] in "'\"":
        return part
    [override] = OverridesParser.create().parse_overrides([f"value={part}"])
    return part if str(override.value()) == part else f"'{part}'"


def _as_text_or_null(part: str) -> str:
    return part if part.lower() == "null" else _as_text(part)


def _is_text(kind: str, chosen: str | None, field: str) -> bool:
    """Return whether a field holds text in every component that may be meant.

    Parameters
    ----------
    kind : one of `KINDS`.
    chosen : what is typed as the component. Unless it is the name of one, all of the kind are
        asked.
    field : name of the field.
    """
    offered = components()
    asked = [offered[kind, chosen]] if chosen and (kind, chosen) in offered else offered.values()
    types = []
    for component in asked:
        if component.kind != kind:
            continue
        with suppress(Exception):  # a broken plugin is named where it is chosen
            cls = class_of(component)
            if any(f.name == field for f in fields(cls)):
                types.append(get_type_hints(cls)[field])
    return bool(types) and all(map(_holds_texts, types))


def _holds_texts(annotation: Any) -> bool:
    """Return whether a type is str, or tuples, lists and unions of it with None."""
    if get_origin(annotation) in HOLDS_TEXTS:
        held = [part for part in get_args(annotation) if part not in (NoneType, Ellipsis)]
        return bool(held) and all(map(_holds_texts, held))
    return annotation is str
