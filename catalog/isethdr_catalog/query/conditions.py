"""Conditions: the SQL of the conditions and of the order of `find`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from isethdr_core.errors import CatalogError
from isethdr_core.storage.home_folder import StoredHome

from .. import index_file
from ..joined_index import home_column
from .connection import HOME, PLAIN

OPERATORS = {"ge": ">=", "le": "<=", "gt": ">", "lt": "<"}
ALL_OPERATORS = (*OPERATORS, "ne", "in")  # as the keyword of a condition ends
DATE = "created"  # property with dates such as 2026-01-31T12:00:00, of which a year is a beginning
SCENE = "scene.component"  # property with the component of a scene, as "scene/street"


class Column(NamedTuple):
    """The SQL expression of a property, and the type of its values."""

    text: str
    kind: str


def typed_conditions(texts: Sequence[str]) -> dict[str, str]:
    """Return {name: value} of conditions as they are typed, `name=value`.

    Raises
    ------
    CatalogError : a name is typed twice, so that one of the two would have no effect.
    """
    found: dict[str, str] = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name in found:
            several = f"; type for example {name}__in={found[name]},{value}"
            raise CatalogError(
                f"{name} is typed twice; expected one condition for each name and operator"
                f"{several if '__' not in name else ''}"
            )
        found[name] = value
    return found


def property_and_operator(key: str) -> tuple[str, str]:
    """Return the property and the operator of the keyword of a condition.

    Parameters
    ----------
    key : for example `kind`, or `person__distance_m__le`.
    """
    name, _, operator = key.rpartition("__")
    if name and operator in ALL_OPERATORS:
        return name.replace("__", "."), operator
    return key.replace("__", "."), "eq"


def resolved(
    known: dict[str, index_file.Property], name: str, value: Any = None
) -> tuple[str, Any]:
    """Return the property that a typed name means, and the value as the records hold it.

    `scene` means the component of the scene, `seed` the setting `config.seed` of a run, and `isp`
    the component `config.isp.name`.

    Parameters
    ----------
    known : properties of the records.
    name : name as typed.
    value : value of a condition; None without one.
    """
    if name in known or name in (*PLAIN, HOME):
        return name, value
    if name == "scene" and SCENE in known:
        return SCENE, _with_kind_of_scene(value)
    settings = (f"config.{name}", f"config.{name}.name")
    return next((setting for setting in settings if setting in known), name), value


def _with_kind_of_scene(value: Any) -> Any:
    if isinstance(value, list | tuple | set):
        return [_with_kind_of_scene(one) for one in value]
    if not isinstance(value, str):
        return value
    return ",".join(f"scene/{name.removeprefix('scene/')}" for name in value.split(","))


def check_numbers(found: index_file.Property | None, operator: str, value: Any) -> None:
    """Refuse a condition with other text about a property that holds numbers.

    Parameters
    ----------
    found : the property; None if it has no numbers.
    operator : `eq`, `ne`, `in` or a key of `OPERATORS`.
    value : value of the condition; for `in` several.

    Raises
    ------
    CatalogError : a value is no number, or NaN, which is neither larger nor smaller than another.
    """
    # scores that are NaN are stored as text
    if found is None or not (found.kind == index_file.NUMBER or found.score):
        return
    for text in _alternatives(operator, value):
        number = _number(text)
        if number is None or (math.isnan(number) and operator in OPERATORS):
            ending = "" if operator == "eq" else f"__{operator}"
            raise CatalogError(
                f"{found.name}{ending} is {text!r}; expected a number, with a point for decimals;"
                f" type for example {found.name}{ending}=0.9"
            )


def column_of(
    known: dict[str, index_file.Property], name: str, homes: tuple[StoredHome, ...]
) -> Column:
    """Return the SQL expression of a property.

    Parameters
    ----------
    known : properties of the records.
    name : name of the property.
    homes : homes of the query.
    """
    if name == HOME:
        return Column(home_column(homes), index_file.TEXT)
    if name in PLAIN:
        return Column(name, index_file.TEXT)
    found = known.get(name)
    if found is not None and found.column is not None:
        return Column(found.column, found.kind)
    return Column(f"json_extract_string(properties, {index_file.pointer(name)})", index_file.LIST)


def order_sql(column: Column, direction: str) -> str:
    """Return the SQL that sorts numbers by value, and other text after them.

    Parameters
    ----------
    column : property to sort by.
    direction : ASC or DESC.
    """
    if column.kind == index_file.NUMBER:
        return f"{column.text} {direction} NULLS LAST"
    return (
        f"try_cast({column.text} AS DOUBLE) {direction} NULLS LAST,"
        f" {column.text} {direction} NULLS LAST"
    )


def condition_sql(column: Column, operator: str, value: Any) -> tuple[str, list[Any]]:
    """Return the SQL of one condition and the values that it binds.

    Parameters
    ----------
    column : property that the condition is about.
    operator : `eq`, `ne`, `in` or a key of `OPERATORS`.
    value : value of the condition; for `in` several.
    """
    if operator in OPERATORS:
        number = None if column.text == DATE else _number(value)
        if number is None:  # dates and other text are compared as text
            return f"CAST({column.text} AS VARCHAR) {OPERATORS[operator]} ?", [str(value)]
        as_number = f"try_cast({column.text} AS DOUBLE)"
        if column.kind == index_file.NUMBER:
            as_number = column.text
        return f"{as_number} {OPERATORS[operator]} ?", [number]
    tests = []
    values = []
    for alternative in _alternatives(operator, value):
        test, bound = _equal(column, alternative)
        tests.append(test)
        values += bound
    joined = " OR ".join(tests) or "false"
    if operator == "ne":
        return f"coalesce(NOT ({joined}), true)", values
    return f"coalesce({joined}, false)", values


def _alternatives(operator: str, value: Any) -> list[str]:
    if isinstance(value, list | tuple | set):
        several = list(value)
    else:
        several = str(value).split(",") if operator == "in" else [value]
    texts = [str(v) for v in several]
    # JSON writes truth values in small letters; a user may type them as in Python
    return texts + [text.lower() for text in texts if text in ("True", "False")]


def _equal(column: Column, value: str) -> tuple[str, list[Any]]:
    """Return the SQL for "a property equals or holds a value", and the values that it binds."""
    number = _number(value)
    if column.kind == index_file.NUMBER:
        return ("false", []) if number is None else (f"{column.text} = ?", [number])
    tests = [f"{column.text} = ?"]
    values = [value]
    if number is not None:
        tests.append(f"try_cast({column.text} AS DOUBLE) = ?")
        values.append(number)
    if column.kind == index_file.LIST:
        as_list = (
            f"from_json(CASE WHEN {column.text} LIKE '[%' AND json_valid({column.text})"
            f" THEN {column.text} ELSE '[]' END, '[\"VARCHAR\"]')"
        )
        tests.append(f"list_contains({as_list}, ?)")
        values.append(value)
    equal = f"({' OR '.join(tests)})"
    if column.kind == index_file.LIST and number is None and _is_verbatim_in_json(value):
        # Reading JSON takes most of the time of such a query. Texts without the value are left out.
        return f"CASE WHEN contains({column.text}, ?) THEN {equal} ELSE false END", [value, *values]
    return equal, values


def _is_verbatim_in_json(text: str) -> bool:
    """Return whether JSON writes the characters of `text` unchanged."""
    return text.isascii() and text.isprintable() and not set(text) & set('"\\/')


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError):
        return None
