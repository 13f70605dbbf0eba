"""Field values that a component must refuse: NaN, infinity, fractions, values outside a range."""

from __future__ import annotations

import math
import types
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from ..plugins.ranges import NUMBERS, declared, field_types


def bad_fields(component: Any) -> Iterator[dict[str, Any]]:
    """Yield {field: value} that `build` must refuse, each made from the component's own value."""
    cls: type = type(component)
    for name, annotation in field_types(cls).items():
        for bad_value in outside(annotation, getattr(component, name)):
            yield {name: bad_value}


def outside(annotation: Any, value: Any) -> Iterator[Any]:
    """Yield values that do not fit a type and its ranges, with one number of `value` replaced.

    A type without numbers yields nothing. Of a union, only values that fit none of its numbers are
    yielded.
    """
    origin = get_origin(annotation)
    parts = get_args(annotation)
    if origin is Annotated or annotation in NUMBERS:
        yield from _bad_numbers(annotation)
    elif origin in (Union, types.UnionType):
        for part in parts:
            for bad_value in outside(part, value):
                if not any(_fits(other, bad_value) for other in parts):
                    yield bad_value
    elif origin is dict:
        table = value if isinstance(value, dict) else {}
        key = next(iter(table), _valid(parts[0]))
        for bad_value in outside(parts[1], table.get(key, {})):
            yield {**table, key: bad_value}
    elif origin is tuple and isinstance(value, tuple) and value:
        first = parts[0]
        for bad_value in outside(first, value[0]):
            yield (bad_value, *value[1:])


def _bad_numbers(annotation: Any) -> Iterator[float]:
    """Yield numbers that a number's type and declared range exclude."""
    number = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    if number not in NUMBERS:
        return
    limits = declared(annotation)
    yield math.nan
    if number is int:
        yield _valid(annotation) + 0.5
    for infinity, end in ((math.inf, "most"), (-math.inf, "least")):
        if limits is None or getattr(limits, end) != infinity:
            yield infinity
    if limits is not None and limits.least > -math.inf:
        yield _beyond(number, limits.least, -1)
    if limits is not None and limits.most < math.inf:
        yield _beyond(number, limits.most, 1)


def _fits(annotation: Any, value: Any) -> bool:
    """Return whether a number lies in the range of a number's type, or is one of a `Literal`."""
    if get_origin(annotation) is Literal:
        return value in get_args(annotation)
    number = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    if number not in NUMBERS or not isinstance(value, NUMBERS) or (number is int and value % 1):
        return False
    limits = declared(annotation)
    return math.isfinite(value) if limits is None else value in limits


def _beyond(number: type, end: float, direction: int) -> float:
    """Return a number just beyond one end of a range."""
    return end + direction if number is int else math.nextafter(end, direction * math.inf)


def _valid(annotation: Any) -> Any:
    """Return a value that a simple type accepts."""
    limits = declared(annotation)
    if limits is not None:
        return limits.nearest(0)
    return "sky" if annotation is str else 0
