"""Ranges: which values a component's field may hold, declared where the field is defined.

    f_number: Annotated[float, Range(0.5, 64)] = 4.0
    zernike_um: dict[Annotated[int, Range(0, 230)], Annotated[float, Range(-100, 100)]] = ...

Numbers without a declared range may be any finite number. Infinity is allowed only where a range
ends in it, and NaN nowhere.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from reprlib import Repr
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from typing_extensions import TypedDict

from ..errors import ConfigError

OUTSIDE = "outside_range"  # pydantic error type of a number outside its declared range
SHORT = Repr()
SHORT.maxstring = SHORT.maxother = 80
TOO_SHORT = "missing"  # pydantic error type of a tuple that lacks an element
NUMBERS = (int, float)
MOST_SHOWN = 1e9  # numbers up to this size are shown with all their digits
# the range in which silicon is sensitive, with a margin at both ends
LEAST_NM = 100.0
MOST_NM = 3000.0
LARGEST_SEED = 2**63 - 1  # a signed 64-bit number, as stores keep it


@dataclasses.dataclass(frozen=True)
class Range:
    """Declare the least and the greatest value of a number; both are allowed.

    An end of `math.inf` or `-math.inf` allows infinity itself.

    Raises
    ------
    ValueError : the ends are not in order.
    """

    least: float
    most: float

    def __post_init__(self) -> None:
        if not self.least <= self.most:
            raise ValueError(f"Range({self.least}, {self.most}): expected least <= most")

    def __contains__(self, value: float) -> bool:
        return self.least <= value <= self.most  # false for NaN

    def __str__(self) -> str:
        return f"{_text(self.least)} to {_text(self.most)}"

    def nearest(self, value: float) -> float:
        """Return the allowed value next to `value`: the least one for NaN."""
        return self.least if math.isnan(value) else min(max(value, self.least), self.most)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return pydantic's schema of a number, with the check of the range after it."""
        from pydantic_core import PydanticCustomError, core_schema

        def check(value: Any, validate: Any) -> float:
            number = math.nan if isinstance(value, bool) else validate(value)
            if number not in self:
                raise PydanticCustomError(
                    OUTSIDE,
                    "Input should be {range}",
                    {"range": str(self), "allowed": self.nearest(0)},
                )
            return number

        schema = handler(source)
        if schema["type"] not in ("int", "float"):
            raise TypeError(
                f"{self!r} annotates {source!r}; expected int or float, for example "
                "Annotated[float, Range(0, 1)] | None"
            )
        if schema["type"] == "float":
            schema = {**schema, "allow_inf_nan": True}  # `check` decides
        return core_schema.no_info_wrap_validator_function(check, schema)


Share = Annotated[float, Range(0, 1)]
Percent = Annotated[float, Range(0, 100)]
Wavelength = Annotated[float, Range(LEAST_NM, MOST_NM)]  # nanometres
Seed = Annotated[int, Range(0, LARGEST_SEED)]


@cache
def field_types(cls: type) -> dict[str, Any]:
    """Return the type of every field of a component class, with its ranges."""
    hints = get_type_hints(cls, include_extras=True)
    return {f.name: hints[f.name] for f in dataclasses.fields(cls) if f.init}


def converted(subject: str, cls: type, values: Mapping[str, Any], to_type: str) -> dict[str, Any]:
    """Return values for fields of `cls`, converted to their types.

    Parameters
    ----------
    subject : name of the component in messages.
    cls : class of the component.
    values : {field: value}.
    to_type : prefix of a field's name on the command line, e.g. `lens.`.

    Raises
    ------
    ConfigError : a value of the wrong type, outside its range, or not finite.
    """
    from pydantic import ValidationError

    try:
        values_by_field: dict[str, Any] = _adapter(cls).validate_python(dict(values))
    except ValidationError as err:
        raise ConfigError(f"{subject}: {_complaint(cls, values, err, to_type)}") from None
    return values_by_field


def check_ranges(component: Any) -> None:
    """Refuse a component with a field that does not fit its declaration.

    Call it first in `__post_init__`: objects made directly in Python are then checked too.

    Raises
    ------
    ConfigError : a value of the wrong type, outside its range, or not finite.
    """
    cls: type = type(component)
    values = {name: getattr(component, name) for name in field_types(cls)}
    converted(cls.__name__, cls, values, "")


@cache
def _adapter(cls: type) -> Any:
    """Return the pydantic adapter that checks the fields of a class; cached because making it is
    slow.
    """
    from pydantic import ConfigDict, TypeAdapter, with_config

    name = f"{cls.__name__}Fields"
    fields = TypedDict(name, field_types(cls), total=False)  # type: ignore[misc]
    strict = with_config(ConfigDict(allow_inf_nan=False, arbitrary_types_allowed=True))
    return TypeAdapter(strict(fields))


def _complaint(cls: type, values: Mapping[str, Any], err: Any, to_type: str) -> str:
    """Return a message about the first bad field: the mistake, the expected values, and what to
    type.
    """
    every = err.errors()
    name = every[0]["loc"][0]
    problems = [p for p in every if p["loc"][0] == name]
    depth = max(len(p["loc"]) for p in problems)
    deepest = [p for p in problems if len(p["loc"]) == depth]  # of the union's best fitting type
    value = deepest[0]["input"]
    field_value = values[name]
    wrong = SHORT.repr(field_value)
    if value is not field_value and deepest[0]["type"] != TOO_SHORT:
        wrong += f" with {SHORT.repr(value)} in it"
    expected = " or ".join(dict.fromkeys(map(_expectation, deepest)))
    near = _nearest_choice(field_types(cls)[name], value)
    hint = f"; did you mean {near!r}?" if near else ""
    example = near or _entry(field_value, deepest[0]) or _other_choice(cls, name)
    if not _fits(cls, name, _default(cls, name)):
        if on_command_line(field_value) == _example(cls, name):
            wrong += ", a mistaken default of the plugin"
        example = example or _allowed(field_value, deepest[0])
    example = example or _example(cls, name)
    return (
        f"{name} is {wrong}; expected {expected}{hint}; type for example {to_type}{name}={example}"
    )


def _entry(field_value: Any, problem: Mapping[str, Any]) -> str:
    """Return the bad entry of a table with an allowed number; "" if the mistake is another one."""
    if not isinstance(field_value, dict) or problem["type"] != OUTSIDE:
        return ""
    key = next((k for k, value in field_value.items() if value is problem["input"]), None)
    return "" if key is None else on_command_line({key: problem["ctx"]["allowed"]})


def _allowed(field_value: Any, problem: Mapping[str, Any]) -> str:
    """Return an allowed number in place of a bad one; "<value>" if the mistake is another one."""
    if problem["type"] != OUTSIDE or problem["input"] is not field_value:
        return "<value>"
    return on_command_line(problem["ctx"]["allowed"])


def _nearest_choice(annotation: Any, value: Any) -> str:
    """Return the value of a `Literal` that resembles `value` most; "" if none does."""
    if get_origin(annotation) is not Literal or not isinstance(value, str):
        return ""
    names = [choice for choice in get_args(annotation) if isinstance(choice, str)]
    return next(iter(get_close_matches(value, names, 1)), "")


def _other_choice(cls: type, name: str) -> str:
    """Return a value of a `Literal` other than the default, which nobody has to type; "" for other
    fields.
    """
    annotation = field_types(cls)[name]
    choices = get_args(annotation) if get_origin(annotation) is Literal else ()
    typed = map(on_command_line, choices)
    return next((choice for choice in typed if choice != _example(cls, name)), "")


def _expectation(problem: Mapping[str, Any]) -> str:
    """Return the value that pydantic expected, as the end of a sentence."""
    if problem["type"] == TOO_SHORT:
        return "one more element"
    text = str(problem["msg"]).removeprefix("Input should be ")
    return text[0].lower() + text[1:]


def _fits(cls: type, name: str, value: Any) -> bool:
    """Return whether a field may have a value; true for `MISSING`."""
    if value is dataclasses.MISSING:
        return True
    try:
        _adapter(cls).validate_python({name: value})
    except ValueError:  # pydantic's ValidationError is one
        return False
    return True


def _default(cls: type, name: str) -> Any:
    """Return the default of a field, `MISSING` if it has none."""
    field = next(f for f in dataclasses.fields(cls) if f.name == name)
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def _example(cls: type, name: str) -> str:
    """Return the default of a field as the command line takes it."""
    default = _default(cls, name)
    return "<value>" if default is dataclasses.MISSING else on_command_line(default)


def on_command_line(value: Any) -> str:
    """Return a value as Hydra reads it in an override."""
    if value is None or isinstance(value, bool):
        return str(value).lower().replace("none", "null")
    if isinstance(value, dict):
        return "{" + ",".join(f"{k}:{on_command_line(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (tuple, list)):
        return "[" + ",".join(map(on_command_line, value)) + "]"
    return "''" if value == "" else str(value)


def range_text(annotation: Any) -> str:
    """Return the declared ranges inside a type as text, empty where there are none."""
    if declared_range := declared(annotation):
        return str(declared_range)
    parts = [range_text(part) for part in get_args(annotation)]
    if get_origin(annotation) is dict and any(parts):
        return f"{parts[0] or 'any'}: {parts[1] or 'any'}"
    return ", ".join(dict.fromkeys(part for part in parts if part))


def declared(annotation: Any) -> Range | None:
    """Return the range that an `Annotated` number declares."""
    if get_origin(annotation) is not Annotated:
        return None
    return next((extra for extra in annotation.__metadata__ if isinstance(extra, Range)), None)


def undeclared(annotation: Any) -> bool:
    """Return whether a type holds a number that declares no range."""
    if get_origin(annotation) is Annotated:
        return declared(annotation) is None and undeclared(get_args(annotation)[0])
    if annotation in NUMBERS:
        return True
    return any(undeclared(part) for part in get_args(annotation) if not isinstance(part, str))


def _text(number: float) -> str:
    """Return a number with six digits, or with all of its digits up to `MOST_SHOWN`."""
    short = f"{number:g}"
    return short if float(short) == number or abs(number) > MOST_SHOWN else f"{number:.15g}"
