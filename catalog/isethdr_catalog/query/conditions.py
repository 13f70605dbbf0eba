"""Conditions: the SQL of the conditions and of the order of `find`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from isethdr_core.errors import CatalogError
from isethdr_core.storage.home_folder import StoredHome

from .. import index_file
from ..joined_index import home_column
from .connection import HOME, PLAIN

OPERATORS = {"ge": ">=", "le": "<=", "gt": ">", "lt": "<"}
ALL_OPERATORS = (*OPERATORS, "ne", "in")  # as the keyword of a condition ends
# Properties with names and hashes: 1e5 and 100000 are two of them. Dates in `created`, such as
# 2026-01-31T12:00:00, also compare as text, so that a year is a beginning.
NAMES = (*PLAIN, HOME, "tags", "sweeps", "recipe", "scene_id", "scene_ids")
NULL = "null"  # value of a condition about records without the property
SCENE = "scene.component"  # property with the component of a scene, as "scene/street"


class Column(NamedTuple):
    """The SQL expression of a property, the type of its values, and whether they are names, which
    are compared as text only.
    """

    text: str
    kind: str
    holds_names: bool = False


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


def listed(value: Any) -> Any:
    """Return several values, for example a range or a generator, as a list; other values
    unchanged.
    """
    if isinstance(value, str) or not isinstance(value, Iterable):
        return value
    try:
        return list(value)
    except TypeError:  # an array without an axis, which is one number
        return value


def _with_kind_of_scene(value: Any) -> Any:
    if isinstance(value, list):
        return [_with_kind_of_scene(one) for one in value]
    if not isinstance(value, str) or value == NULL:
        return value
    return ",".join(f"scene/{name.removeprefix('scene/')}" for name in value.split(","))


def holds_numbers(found: index_file.Property | None) -> bool:
    """Return whether a property holds numbers only."""
    # scores that are NaN are stored as text
    return found is not None and (found.kind == index_file.NUMBER or found.score)


def wrong_number(operator: str, value: Any) -> str | None:
    """Return the first value of a condition that a property of numbers is not compared with; None
    if there is none.

    A value is wrong if it is no number, or NaN, which is neither larger nor smaller than another.
    `null`, for records without the property, is wrong where the operator is in `OPERATORS`.

    Parameters
    ----------
    operator : `eq`, `ne`, `in` or a key of `OPERATORS`.
    value : value of the condition; for `in` several.
    """
    for text in _alternatives(operator, value):
        number = _number(text)
        if operator in OPERATORS:
            if number is None or math.isnan(number):
                return str(text)
        elif number is None and text is not None and text != NULL:
            return text
    return None


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
        return Column(home_column(homes), index_file.TEXT, holds_names=True)
    if name in PLAIN:
        return Column(name, index_file.TEXT, holds_names=True)
    found = known.get(name)
    if found is not None and found.column is not None:
        is_text = found.kind != index_file.NUMBER
        return Column(found.column, found.kind, is_text and name in NAMES)
    text = f"json_extract_string(properties, {index_file.pointer(name)})"
    return Column(text, index_file.LIST, name in NAMES)


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
        number = None if column.holds_names else _number(value)
        if number is None:  # names, dates and other text are compared as text
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


def _alternatives(operator: str, value: Any) -> list[str | None]:
    """Return the values of a condition as text; None for `None`."""
    if isinstance(value, list):
        several = value
    else:
        several = str(value).split(",") if operator == "in" and value is not None else [value]
    texts = [None if v is None else str(v) for v in several]
    # JSON writes truth values in small letters; a user may type them as in Python
    return texts + [text.lower() for text in texts if text in ("True", "False")]


def _equal(column: Column, value: str | None) -> tuple[str, list[Any]]:
    """Return the SQL for "a property equals or holds a value", and the values that it binds.

    None stands for no value. So does `null`, except of names, which may be `null`.
    """
    missing = f"{column.text} IS NULL"
    if column.kind != index_file.NUMBER:  # an empty text and an empty list are no value, too
        missing = f"({missing} OR {column.text} IN ('', '[]'))"
    if value is None:
        return missing, []
    if value == NULL and not column.holds_names:
        equal, values = _equal_to_text(column, value)
        return f"({missing} OR {equal})", values
    return _equal_to_text(column, value)


def _equal_to_text(column: Column, value: str) -> tuple[str, list[Any]]:
    number = None if column.holds_names else _number(value)
    if column.kind == index_file.NUMBER:
        return ("false", []) if number is None else (f"{column.text} = ?", [number])
    tests = [f"{column.text} = ?"]
    values: list[Any] = [value]
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
    # Python reads 0_9 as 9, which is a mistyped point or comma
    if isinstance(value, str) and "_" in value:
        return None
    try:
        return float(value)
    except (TypeError, ValueError):
        return None
