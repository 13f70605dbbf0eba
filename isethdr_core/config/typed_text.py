"""Typed texts: Hydra reads `2026_11_29` and `1e5` as numbers, also where a name is expected. Such
values are put between quotes before Hydra reads them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields

from hydra.core.override_parser.overrides_parser import OverridesParser

from ..errors import PluginError
from ..plugins.component import KINDS
from ..plugins.registry import class_of, components

TEXTS = ("name", "tags", "device")  # settings of a run that hold texts
TABLES = {"cameras": "sensor", "versions": "lighting"}  # tables with components of another name
# what may be typed without quotes, between commas, and within brackets
PLAIN = re.compile(r"[\w.+\-, \[\]'\"]*")
PART = re.compile(r"'(?:\\.|[^'\\])*'|\"(?:\\.|[^\"\\])*\"|[\w.+-]+(?: +[\w.+-]+)*")
# numbers of which Hydra keeps the value, but not the digits: dates, and digits of hashes
REWRITTEN = re.compile(r"\d+(_\d+)+|\d+e\d+", re.IGNORECASE)


def with_texts(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with quotes around texts that Hydra would read as numbers, as in
    `name=2026_11_29`, and with `tags=night,wet` as a list, which Hydra does not sweep over.

    `null` stays: it leaves a setting out. Quotes that are typed stay as well.
    """
    return [argument if argument.startswith("-") else _quoted(argument) for argument in arguments]


def _quoted(argument: str) -> str:
    key, equals, value = argument.partition("=")
    name = key.lstrip("+")
    if not equals or value.strip().lower() == "null":
        return argument
    if name == "tags" and "[" not in value:
        value = f"[{value}]"
    if not PLAIN.fullmatch(value):  # an interpolation, a table or a function of Hydra
        return f"{key}={value}"
    if name in TEXTS:
        return f"{key}={PART.sub(lambda part: _as_text(part[0]), value)}"
    if "." not in name or not any(map(REWRITTEN.fullmatch, PART.findall(value))):
        return argument
    table, _, field = name.partition(".")
    if not _is_text(TABLES.get(table, table), field.rpartition(".")[2]):
        return argument
    return f"{key}={PART.sub(lambda part: _if_rewritten(part[0]), value)}"


def _as_text(part: str) -> str:
    """Return a part of a value, in quotes if Hydra would not read it as this text."""
    if part[0] in "'\"":
        return part
    [override] = OverridesParser.create().parse_overrides([f"value={part}"])
    return part if str(override.value()) == part else f"'{part}'"


def _if_rewritten(part: str) -> str:
    return f"'{part}'" if REWRITTEN.fullmatch(part) else part


def _is_text(kind: str, field: str) -> bool:
    """Return whether every component of a kind that has a field reads it as text."""
    types = []
    for component in components().values() if kind in KINDS else ():
        if component.kind != kind:
            continue
        try:
            own = fields(class_of(component))
        except PluginError:  # a broken plugin is named where it is chosen
            continue
        types += [f.type for f in own if f.name == field]
    return bool(types) and all(held in (str, "str", "str | None") for held in types)
