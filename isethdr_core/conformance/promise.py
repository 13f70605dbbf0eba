"""How a promise is stated and checked, and the promises that components of every kind share."""

from __future__ import annotations

import dataclasses
import pickle
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from threading import Barrier
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..data.scores import Score
from ..errors import ConfigError, IsetHdrError
from ..pipeline.demand import Demand
from ..plugins.protocols import NarrowsDemand, ThreadSafe
from ..plugins.registry import build
from ..runs.provenance import described
from ..storage.store import content_hash
from ..uncertainty.ledger import Ledger, stage
from .ranges import bad_fields

Data = TypeVar("Data", xr.DataArray, xr.Dataset)
Input = TypeVar("Input", bound=xr.DataArray | xr.Dataset)
Result = TypeVar("Result")

SWITCH_S = 1e-5  # time between switches of threads, so short that calls on small inputs overlap
EXPECTATION = re.compile("expected|needs|lack|one of")  # a message has at least one of these words


def holds(subject: str, promise: str, condition: object, detail: str = "") -> None:
    """Raise AssertionError naming the component and the promise unless `condition` is true.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    promise : the promise, as a statement of the component.
    condition : whether the promise is kept; its truth value counts.
    detail : found and expected values; empty: none.
    """
    if not condition:
        raise AssertionError(
            f"{subject} breaks the promise '{promise}'" + (f": {detail}" if detail else "")
        )


@contextmanager
def keeps(subject: str, promise: str) -> Iterator[None]:
    """Turn any error raised inside into a broken promise."""
    try:
        yield
    except Exception as err:
        if isinstance(err, AssertionError) and str(err).startswith(subject):
            raise
        raise AssertionError(
            f"{subject} breaks the promise '{promise}': {type(err).__name__}: {err}"
        ) from err


def same(subject: str, promise: str, first: object, second: object) -> None:
    """Raise AssertionError unless two results hold the same bits (NaN equals NaN).

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    promise : the promise, as a statement of the component.
    first, second : results: a DataArray, Dataset, array or list of scores.
    """
    a = arrays(first)
    b = arrays(second)
    holds(subject, promise, a.keys() == b.keys(), f"got {sorted(a)} and {sorted(b)}")
    for name in a:
        holds(
            subject,
            promise,
            a[name].shape == b[name].shape and a[name].dtype == b[name].dtype,
            f"{name} is {a[name].dtype}{a[name].shape} once and {b[name].dtype}{b[name].shape} the"
            " other time",
        )
        exact = a[name].dtype.kind in "fc"
        holds(
            subject, promise, np.array_equal(a[name], b[name], equal_nan=exact), f"{name} differs"
        )


def close(
    subject: str,
    promise: str,
    values: npt.ArrayLike,
    want: npt.ArrayLike,
    relative: float,
    absolute: float = 0.0,
) -> None:
    """Raise AssertionError unless |value - want| <= relative |want| + absolute everywhere. The
    message holds the worst position.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    promise : the promise, as a statement of the component.
    values : values found, any shape and unit.
    want : expected values; they broadcast with `values`.
    relative : error allowed, as a fraction of |want|.
    absolute : error allowed in addition, unit of the values.
    """
    values, want = np.broadcast_arrays(np.asarray(values, float), np.asarray(want, float))
    excess = np.abs(values - want) - relative * np.abs(want) - absolute
    outside = ~(excess <= 0)
    if outside.any():
        worst = np.unravel_index(
            np.argmax(np.where(np.isnan(excess), np.inf, excess)), excess.shape
        )
        holds(
            subject,
            promise,
            False,
            f"{outside.sum()} of {outside.size} values; worst at {tuple(map(int, worst))}:"
            f" {values[worst]:.6g}, expected {want[worst]:.6g} within {relative:g} relative +"
            f" {absolute:g}",
        )


def refuses(subject: str, fault: str, call: Callable[[], object]) -> None:
    """Raise AssertionError unless `call()` raises an error of isethdr_core.errors whose message
    states the expected value.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    fault : the bad input, in words.
    call : function that passes the bad input to the component.
    """
    promise = f"refuses {fault} with an error of isethdr_core.errors"
    try:
        call()
    except IsetHdrError as err:
        holds(
            subject,
            f"says what it expected instead of {fault}",
            EXPECTATION.search(str(err)),
            str(err),
        )
        return
    except Exception as err:
        raise AssertionError(
            f"{subject} breaks the promise '{promise}': raised {type(err).__name__}: {err}"
        ) from err
    raise AssertionError(f"{subject} breaks the promise '{promise}': it returned a result")


def stated(subject: str, call: Callable[[], Result]) -> Result:
    """Return `call()` after checking that it stated the error of its result in the ledger."""
    rows = Ledger()
    with stage(rows, subject):
        result = call()
    promise = "states its error in the ledger, with a number and a unit"
    holds(subject, promise, rows[0].errors)
    for note in rows[0].errors:
        holds(subject, promise, 0 <= note.value < np.inf and note.unit, repr(note))
    return result


def repeatable(
    subject: str, call: Callable[[Input], Result], make_input: Callable[[], Input]
) -> Result:
    """Return `call(input)` after checking that it does not change its input, and that the result
    depends only on the values of the input.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    call : function of the component under test.
    make_input : function that makes the same input each time, in new arrays.
    """
    original = make_input()
    untouched = make_input()
    with keeps(subject, "accepts valid input"):
        result = call(original)
    same(subject, "does not change its input", original, untouched)
    same(subject, "the same call twice gives the same bits", result, call(original))
    alike(
        subject,
        "the result does not depend on the order of its input in memory",
        call(fortran(original)),
        result,
    )
    return result


def safe_in_threads(subject: str, component: object, calls: Sequence[Callable[[], object]]) -> None:
    """Check that a component which allows threads gives the same bits when its calls overlap.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    component : the component. One that does not allow threads is not checked.
    calls : calls of the component with different arguments.
    """
    if not (isinstance(component, ThreadSafe) and component.THREAD_SAFE):
        return
    promise = "calls that overlap in several threads give the same bits (THREAD_SAFE)"
    alone = [call() for call in calls]
    start = Barrier(len(calls))

    def together(call: Callable[[], object]) -> object:
        start.wait()
        return call()

    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    try:
        with keeps(subject, promise), ThreadPoolExecutor(len(calls)) as pool:
            overlapping = list(pool.map(together, calls))
    finally:
        sys.setswitchinterval(interval_s)
    for first, second in zip(alone, overlapping, strict=True):
        same(subject, promise, first, second)


def alike(subject: str, promise: str, values: object, want: object) -> None:
    """Raise AssertionError unless two results agree up to the rounding of sums in another order.

    The tolerance is 1e-5 of the largest value, for sums in float32. Whole numbers may differ by 1,
    if such a sum decides a count.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    promise : the promise, as a statement of the component.
    values : result found: a DataArray, Dataset, array or list of scores.
    want : expected result, of the same form.
    """
    a = _numbers(values)
    b = _numbers(want)
    holds(subject, promise, a.keys() == b.keys(), f"got {sorted(a)} and {sorted(b)}")
    for name, value in b.items():
        same_shape = a[name].shape == value.shape
        holds(subject, promise, same_shape, f"{name} is {a[name].shape}, expected {value.shape}")
        if value.dtype.kind == "f":
            finite = np.isfinite(value)
            scale = float(np.abs(value[finite]).max(initial=0.0))
            close(subject, promise, a[name][finite], value[finite], 0.0, 1e-5 * scale)
        elif value.dtype.kind in "iu":
            close(subject, promise, a[name], value, 0.0, 1.0)


def _numbers(result: object) -> dict[str, np.ndarray]:
    """Return the arrays of a result as `arrays` does, and each score as its three numbers."""
    if isinstance(result, list) and all(isinstance(item, Score) for item in result):
        return {f"{s.metric} {s.object}": np.array([s.value, s.low, s.high]) for s in result}
    return arrays(result)


def fortran(data: Input) -> Input:
    """Return a copy of a DataArray or Dataset with its arrays in Fortran order."""
    if isinstance(data, xr.Dataset):
        return data.assign(
            {k: v.copy(data=np.asfortranarray(v.values)) for k, v in data.data_vars.items()}
        )
    return data.copy(data=np.asfortranarray(data.values))


def arrays(result: object) -> dict[str, np.ndarray]:
    """Return every array of a DataArray, Dataset, array or list of scores, by name."""
    if isinstance(result, xr.Dataset):
        return {str(k): v.values for k, v in result.variables.items()}
    if isinstance(result, xr.DataArray):
        return {"values": result.values, **{str(k): v.values for k, v in result.coords.items()}}
    if isinstance(result, list):
        return {"scores": np.array([repr(item) for item in result])}
    return {"values": np.asarray(result)}


def check_component(
    subject: str, kind: str, name: str, component: Any, fields: Mapping[str, Any]
) -> None:
    """Check the promises of every component: documented, typed, comparable, storable, and correct
    demands.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    kind : kind of the component, for example `lens`.
    name : registered name of the component.
    component : component under test, built from `fields`.
    fields : fields that the author passes, by name.
    """
    docstring = type(component).__doc__ or ""
    holds(
        subject,
        "the class docstring says in its first line what it is",
        docstring.strip() and not docstring.startswith(f"{type(component).__name__}("),
    )
    equal = "the same fields give an equal component"
    with keeps(subject, equal):  # arrays among the fields have no truth value
        holds(subject, equal, component == build(kind, name, **fields))
    own_fields = {
        f.name: getattr(component, f.name) for f in dataclasses.fields(component) if f.init
    }
    with keeps(subject, "its defaults lie within the ranges that its fields declare"):
        build(kind, name, **own_fields)
    with keeps(subject, "its fields can be hashed into the name of a run"):
        content_hash(described(component))
    with keeps(subject, "it can be sent to another process"):
        holds(
            subject,
            "it can be sent to another process",
            pickle.loads(pickle.dumps(component)) == component,
        )
    for f in dataclasses.fields(component):
        try:
            setattr(component, f.name, getattr(component, f.name))
        except dataclasses.FrozenInstanceError:
            continue
        holds(subject, "its fields cannot be changed", False, f.name)
    try:
        build(kind, name, **{**fields, "no_such_field": 1})
        holds(subject, "an unknown field is refused", False)
    except ConfigError:
        pass
    for bad_value in bad_fields(component):
        refuses(
            subject, f"the field {bad_value}", partial(build, kind, name, **{**fields, **bad_value})
        )
    if isinstance(component, NarrowsDemand):
        with keeps(subject, "narrow(demand) returns a Demand"):
            _check_narrow(subject, component)


def _check_narrow(subject: str, component: NarrowsDemand) -> None:
    everything = Demand()
    first = component.narrow(everything)
    holds(subject, "narrow(demand) returns a Demand", isinstance(first, Demand), repr(first))
    holds(
        subject,
        "narrow gives the same answer twice",
        _plain(first) == _plain(component.narrow(everything)),
    )
    groups = ("sky", "headlights")
    wavelength_nm = (450.0, 550.0, 650.0)
    less = component.narrow(Demand(groups=groups, wavelength_nm=wavelength_nm))
    holds(
        subject,
        "narrow never asks for more light groups",
        less.groups is not None and set(less.groups) <= set(groups),
        repr(less.groups),
    )
    holds(
        subject,
        "narrow never asks for more bands",
        less.wavelength_nm is not None and set(less.wavelength_nm) <= set(wavelength_nm),
        repr(less.wavelength_nm),
    )


def _plain(demand: Demand) -> object:
    """Return a demand as values that can be compared: numbers replace the sensor's response."""
    if demand.response is None:
        return demand
    return (
        dataclasses.replace(demand, response=None),
        {name: value for name, value in vars(demand.response).items() if name != "efficiency"},
        np.asarray(demand.response.efficiency(np.linspace(400.0, 700.0, 7))).tolist(),
    )
