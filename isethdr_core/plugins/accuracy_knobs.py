"""Accuracy knobs: declared fields of a component that trade accuracy for time; and error shares,
the declared uses of the error allowed.

    accuracy_knobs: ClassVar = (
        AccuracyKnob("rays", (16, 64, 256), Quantity.IRRADIANCE, Cost(1.0, -1.0)),
    )

`isethdr study accuracy` varies every knob. The budget (`uncertainty.budget`) divides the error
allowed over the knobs with `budgeted=True` and over all `ErrorShare`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..data.error_costs import Cost
from ..errors import PluginError
from ..uncertainty.error_terms import LIGHT, Quantity
from .protocols import DeclaresAccuracy, DividesErrorAllowed

LEAST_VALUES = 2  # smallest number of values of a knob, which a study compares
LIGHT_KINDS = ("lighting", "lens", "flare", "sensor")  # kinds with errors that reach the electrons
BUDGETED_KINDS = ("renderer", *LIGHT_KINDS)


CostModel: TypeAlias = Cost | Callable[[Any], float]


@dataclass(frozen=True)
class Spaced:
    """Values with a constant ratio, as whole numbers if both ends are whole numbers.

    Parameters
    ----------
    cheapest, finest : the first and the last value, both above 0.
    count : number of values, at least 2.

    Raises
    ------
    ValueError : an end that is not above 0, or fewer than two values.
    """

    cheapest: float
    finest: float
    count: int

    def __post_init__(self) -> None:
        if not (self.cheapest > 0 and self.finest > 0 and self.count >= LEAST_VALUES):
            raise ValueError(
                f"{self!r}: expected ends above 0 and a count of at least {LEAST_VALUES}"
            )

    def __iter__(self) -> Iterator[float]:
        integers = isinstance(self.cheapest, int) and isinstance(self.finest, int)
        ratio = (self.finest / self.cheapest) ** (1 / (self.count - 1))
        values = [self.cheapest * ratio**k for k in range(self.count - 1)] + [self.finest]
        return iter(list(dict.fromkeys(map(round, values))) if integers else values)


@dataclass(frozen=True)
class AccuracyKnob:
    """A field of a component that trades accuracy for time.

    Parameters
    ----------
    field : name of the field.
    values : values for a study, from the cheapest to the finest. An iterator is read at once.
    error_of : the quantity in which the knob causes an error; the study compares this quantity.
    cost : cost of a value: a `Cost`, or a function(value) -> seconds. None: not known. A budget
        adds up the seconds of its knobs. For other knobs only ratios count, so the unit does not
        matter.
    part : the part of that quantity with the error, by its declared name; None: all.
    reference : a value finer than `values`, for the reference of the study only; None: the finest.
    independent : {field: value} of further fields of the reference, so that it does not share the
        errors of the compared values; for example another seed.
    budgeted : the field is the relative error that the component may cause, None by default. If it
        is None, the budget sets it to the component's share.
    matters : function(component) -> whether the field changes anything; None: it always does.
    """

    field: str
    values: Iterable[Any]
    error_of: Quantity
    cost: CostModel | None = None
    part: str | None = None
    reference: Any = None
    independent: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    budgeted: bool = False
    matters: Callable[[Any], bool] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.values, Iterator):  # it could be read only once
            object.__setattr__(self, "values", tuple(self.values))

    def tried(self) -> tuple[Any, ...]:
        """Return the values, from the cheapest to the finest."""
        return tuple(self.values)

    def finest(self) -> Any:
        """Return the value of the reference."""
        return self.tried()[-1] if self.reference is None else self.reference

    def relative_cost(self, value: Any, reference: Any) -> float:
        """Return the ratio of the costs of two values of this knob, by its declared cost model.

        NaN if it is not known: without a model, and for a `Cost` with `power` 0, which is known
        only up to a constant.
        """
        if self.cost is None or value is None or reference is None:
            return math.nan
        if isinstance(self.cost, Cost):
            return float((value / reference) ** -self.cost.power) if self.cost.power else math.nan
        reference_cost = float(self.cost(reference))
        return float(self.cost(value)) / reference_cost if reference_cost > 0 else math.nan


@dataclass(frozen=True)
class ErrorShare:
    """A part of the error allowed that a component itself uses for one purpose.

    A lens gets the sum of its shares in `Response.noise_fraction_allowed`.

    Parameters
    ----------
    name : name of the purpose.
    cost : cost of an error of that size, in standard deviations of the sensor's noise; None: the
        share is `reserved`.
    reserved : share of the error allowed that is used without cost, in place of `cost`.
    """

    name: str
    cost: Cost | None = None
    reserved: float = 0.0


def knobs_of(component: object) -> tuple[AccuracyKnob, ...]:
    """Return the knobs that a component declares."""
    return _declared(component.accuracy_knobs) if isinstance(component, DeclaresAccuracy) else ()


def shares_of(component: object) -> tuple[ErrorShare, ...]:
    """Return the error shares that a component declares."""
    return _declared(component.error_shares) if isinstance(component, DividesErrorAllowed) else ()


def _declared(declared: Any) -> tuple[Any, ...]:
    return tuple(declared or ())  # a subclass withdraws the declaration with None


def check_knobs(subject: str, kind: str, declared: object, defaults: Mapping[str, Any]) -> None:
    """Refuse knobs that no study and no budget could use.

    Parameters
    ----------
    subject : name of the component in error messages.
    kind : kind of the component, for example `lens`.
    declared : the declared `accuracy_knobs`, a sequence of `AccuracyKnob` in a valid component.
    defaults : {field: its default} of the component.

    Raises
    ------
    PluginError : an element is no `AccuracyKnob`, names no field, has fewer than two values, or is
        budgeted where no budget could set it.
    """
    for knob in _sequence(subject, "accuracy_knobs", declared):
        if not isinstance(knob, AccuracyKnob):
            raise PluginError(
                f"{subject}: accuracy_knobs holds {knob!r}; expected"
                " isethdr_core.AccuracyKnob(field, values, error_of)"
            )
        for name in (knob.field, *knob.independent):
            if name not in defaults:
                raise PluginError(
                    f"{subject}: accuracy_knobs names {name!r}, which is no field;"
                    f" expected one of: {', '.join(defaults)}"
                )
        _check_knob(f"{subject}: the knob {knob.field!r}", kind, knob, defaults)


def _check_knob(subject: str, kind: str, knob: AccuracyKnob, defaults: Mapping[str, Any]) -> None:
    tried = knob.tried() if isinstance(knob.values, Iterable) else ()
    if len(tried) < LEAST_VALUES:
        raise PluginError(
            f"{subject} has the values {knob.values!r}; expected at least {LEAST_VALUES}, from the"
            " cheapest to the finest"
        )
    if knob.error_of not in tuple(Quantity):
        raise PluginError(
            f"{subject} is an error of {knob.error_of!r}; expected one of"
            f" {', '.join(q.value for q in Quantity)}"
        )
    if not knob.budgeted:
        return
    if kind not in BUDGETED_KINDS or knob.error_of not in LIGHT:
        raise PluginError(
            f"{subject} is budgeted; expected an error of {', '.join(q.value for q in LIGHT)} of a"
            f" {', '.join(BUDGETED_KINDS)}: the budget ends at the electrons"
        )
    if defaults[knob.field] is not None:
        raise PluginError(
            f"{subject} is budgeted and its default is {defaults[knob.field]!r}; expected None, so"
            " that a value that a user sets can be told from none"
        )
    if not isinstance(knob.cost, Cost) or not (knob.cost.seconds > 0 and knob.cost.power >= 0):
        raise PluginError(
            f"{subject} is budgeted and costs {knob.cost!r}; expected Cost(seconds, power) with"
            " seconds above 0 and a power of 0 or more: a smaller error takes longer"
        )


def check_shares(subject: str, kind: str, declared: object) -> None:
    """Refuse shares that the budget could not divide.

    Parameters
    ----------
    subject : name of the component in error messages.
    kind : kind of the component; only a lens may declare shares.
    declared : the declared `error_shares`, a sequence of `ErrorShare` in a valid component.

    Raises
    ------
    PluginError : the component is no lens, an element is no `ErrorShare`, or its cost or reserved
        share is out of range.
    """
    shares = _sequence(subject, "error_shares", declared)
    if kind != "lens" and shares:
        raise PluginError(
            f"{subject}: error_shares is for lenses, which are told the error allowed when they are"
            " called; expected an AccuracyKnob with budgeted=True"
        )
    for share in shares:
        if not isinstance(share, ErrorShare):
            raise PluginError(
                f"{subject}: error_shares holds {share!r}; expected isethdr_core.ErrorShare(name,"
                " cost)"
            )
        bought = share.cost is not None and share.cost.seconds > 0 and share.cost.power >= 0
        reserves = share.cost is None and 0 < share.reserved < 1
        if not (bought or reserves):
            raise PluginError(
                f"{subject}: {share!r}; expected Cost(seconds, power) with seconds above 0 and a"
                " power"
                " of 0 or more, or no cost and a reserved share between 0 and 1"
            )


def _sequence(subject: str, name: str, declared: object) -> tuple[Any, ...]:
    if declared is None:
        return ()
    if isinstance(declared, str | bytes) or not isinstance(declared, Iterable):
        raise PluginError(f"{subject}: {name} is {declared!r}; expected a tuple")
    return tuple(declared)
