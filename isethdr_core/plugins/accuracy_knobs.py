"""Accuracy knobs: the fields of a component that trade accuracy for time, as the component declares
them; and what it spends of the error allowed.

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

LEAST_VALUES = 2  # of a knob: one value cannot be compared with another
LIGHT_KINDS = ("lighting", "lens", "flare", "sensor")  # whose errors reach the electrons
BUDGETED_KINDS = ("renderer", *LIGHT_KINDS)


CostModel: TypeAlias = Cost | Callable[[Any], float]


@dataclass(frozen=True)
class Spaced:
    """Values a constant factor apart, whole numbers where both ends are.

    Parameters
    ----------
    cheapest, finest : the first and the last value, both above 0.
    count : of values, at least 2.

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
        whole = isinstance(self.cheapest, int) and isinstance(self.finest, int)
        ratio = (self.finest / self.cheapest) ** (1 / (self.count - 1))
        values = [self.cheapest * ratio**k for k in range(self.count - 1)] + [self.finest]
        return iter(list(dict.fromkeys(map(round, values))) if whole else values)


@dataclass(frozen=True)
class AccuracyKnob:
    """A field of a component that trades accuracy for time.

    Parameters
    ----------
    field : the name of the field.
    values : what a study tries, from the cheapest to the finest.
    error_of : the quantity that the knob makes wrong; the study compares that quantity.
    cost : of a value: a `Cost`, or a function(value) -> seconds. None: not known. A budget adds up
        the seconds of its knobs; of others only ratios count, so that any unit serves.
    part : the part of that quantity that is wrong, by the name that its maker declared; None: all.
    reference : a value finer than `values`, for the study's reference alone; None: the finest.
    independent : {field: value} that the reference has besides, so that it does not share the
        errors of what is compared with it: another seed, for example.
    budgeted : the field is the relative error that the component may make, None by default. Where
        it is None the budget puts the component's share into it.
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

    def tried(self) -> tuple[Any, ...]:
        """Return the values, from the cheapest to the finest."""
        return tuple(self.values)

    def finest(self) -> Any:
        """Return the value of the reference."""
        return self.tried()[-1] if self.reference is None else self.reference

    def relative_cost(self, value: Any, reference: Any) -> float:
        """Return the cost of a value over that of another, by the declared model.

        NaN where that is not known: without a model, and for a `Cost` without a power, which is
        known but for a constant.
        """
        if self.cost is None or value is None or reference is None:
            return math.nan
        if isinstance(self.cost, Cost):
            return float((value / reference) ** -self.cost.power) if self.cost.power else math.nan
        whole = float(self.cost(reference))
        return float(self.cost(value)) / whole if whole > 0 else math.nan


@dataclass(frozen=True)
class ErrorShare:
    """What a component spends the error allowed on, where it sees to that itself.

    A lens gets the sum of its shares in `Response.noise_fraction_allowed`.

    Parameters
    ----------
    name : of what the error is spent on.
    cost : of an error of that size, in standard deviations of the sensor's noise; None: `reserved`
        says how much is taken.
    reserved : share of the error allowed that is taken at no cost, in place of a cost.
    """

    name: str
    cost: Cost | None = None
    reserved: float = 0.0


def knobs_of(component: object) -> tuple[AccuracyKnob, ...]:
    """Return the knobs that a component declares."""
    return _declared(component.accuracy_knobs) if isinstance(component, DeclaresAccuracy) else ()


def shares_of(component: object) -> tuple[ErrorShare, ...]:
    """Return what a component spends the error allowed on by itself."""
    return _declared(component.error_shares) if isinstance(component, DividesErrorAllowed) else ()


def _declared(declared: Any) -> tuple[Any, ...]:
    return tuple(declared or ())  # None: withdrawn by a subclass


def check_knobs(subject: str, kind: str, declared: object, defaults: Mapping[str, Any]) -> None:
    """Refuse knobs that no study and no budget could use.

    Parameters
    ----------
    subject, kind : of the component. `defaults` : {field: its default}.

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
    if len(knob.tried()) < LEAST_VALUES:
        raise PluginError(
            f"{subject} has the values {knob.tried()!r}; expected at least {LEAST_VALUES}, from the"
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

    Raises
    ------
    PluginError : the component is no lens, an element is no `ErrorShare`, or its cost or what it
        reserves is out of range.
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
                f"{subject}: error_shares holds {share!r}; expected isethdr_core.ErrorShare(name, cost)"
            )
        bought = share.cost is not None and share.cost.seconds > 0 and share.cost.power >= 0
        reserves = share.cost is None and 0 < share.reserved < 1
        if not (bought or reserves):
            raise PluginError(
                f"{subject}: {share!r}; expected Cost(seconds, power) with seconds above 0 and a power"
                " of 0 or more, or no cost and a reserved share between 0 and 1"
            )


def _sequence(subject: str, name: str, declared: object) -> tuple[Any, ...]:
    if declared is None:
        return ()
    if isinstance(declared, str | bytes) or not isinstance(declared, Iterable):
        raise PluginError(f"{subject}: {name} is {declared!r}; expected a tuple")
    return tuple(declared)
