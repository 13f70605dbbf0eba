"""Promises of a metric: scores from the requested labels, finite for a good picture, the same on
every call and from its faster methods.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..data.quantities import centres
from ..data.reference_picture import labels_on, make_picture, truth
from ..data.score_checks import check_scores, check_scores_of_parts
from ..data.scores import Score, state_errors
from ..errors import IsetHdrError
from ..pipeline.demand import Demand
from ..plugins.protocols import Metric, NarrowsDemand, ScoresFurther, ScoresParts
from ..uncertainty.score_intervals import key_of
from .inputs import FOCAL_LENGTH_MM, mixed, pattern, scene
from .lazy import same_from_store, sealed
from .promise import close, holds, keeps, repeatable, safe_in_threads, same, stated

SIZE = (48, 72)
# error allowed of `further`, as a share of the score and in its unit: it estimates a small change
FURTHER_RELATIVE = 0.01
FURTHER_ABSOLUTE = 1e-6


class Pictures(NamedTuple):
    """The arguments of a metric's call."""

    noisy: xr.Dataset
    reference: xr.Dataset
    labels: xr.Dataset | None


def check(subject: str, metric: Metric) -> None:
    """Check one metric on a picture with noise, on a perfect one, and on one without a valid
    pixel.
    """
    if isinstance(metric, NarrowsDemand):
        demand = Demand(groups=("sky", "headlights"), wavelength_nm=(450.0, 550.0, 650.0))
        less = metric.narrow(demand)
        holds(
            subject,
            "narrow drops no light group and no band: a metric sees the picture only",
            (less.groups, less.wavelength_nm) == (demand.groups, demand.wavelength_nm),
            repr(less),
        )
    reference = true_picture()
    labels = labels_asked_for(metric)
    noisy = noisy_picture(reference)
    scores = repeatable(
        subject, lambda p: metric(p, reference, labels), lambda: noisy_picture(reference)
    )
    holds(
        subject,
        "returns a list of Score",
        isinstance(scores, list) and scores and all(isinstance(s, Score) for s in scores),
        repr(scores)[:200],
    )
    for s in scores:
        holds(subject, "every score has a name", isinstance(s.metric, str) and s.metric)
        holds(subject, "every score has a unit ('' for a ratio)", isinstance(s.unit, str))
        holds(subject, "every value is a plain number", isinstance(s.value, (int, float)), repr(s))
        holds(
            subject, "every score of a good picture is a number", not math.isnan(s.value), repr(s)
        )
        if math.isfinite(s.low) and math.isfinite(s.high):
            holds(subject, "low <= value <= high", s.low <= s.value <= s.high, repr(s))
    rows = [(s.metric, s.object) for s in scores]
    holds(subject, "one row per metric and object", len(set(rows)) == len(rows), repr(rows))
    copied = reference.copy(deep=True)
    metric(noisy, reference, labels)
    same(subject, "does not change the truth", copied, reference)
    with keeps(subject, "scores a perfect picture"):
        metric(reference, reference, labels)
    with keeps(subject, "gives a score or none, never an error, where no pixel is valid"):
        metric(noisy.assign(valid=xr.zeros_like(noisy["valid"])), reference, labels)
    same_from_store(subject, lambda p: metric(p, reference, labels), noisy, scores)
    calls = [partial(metric, one, reference, labels) for one in (noisy, reference)]
    safe_in_threads(subject, metric, calls)
    pictures = Pictures(noisy, reference, labels)
    _check_depends(subject, metric, pictures, scores)
    _check_further(subject, metric, pictures)
    _check_parts(subject, metric, pictures, scores)
    _check_bad_input(subject, metric, pictures, scores)
    stated(subject, lambda: state_errors(metric(noisy, reference, labels)))


def true_picture() -> xr.Dataset:
    """Return the reference picture of the kit's mixed radiance on 48 x 72 pixels. Its luminance
    grows by a factor of 100 to the right, because some scores are for a given luminance.
    """
    height, width = SIZE
    light = mixed(height=16, width=24)
    light = light.copy(data=light.values * np.geomspace(0.01, 1.0, light.sizes["x"]))
    f_m = FOCAL_LENGTH_MM * 1e-3
    x = centres(width, light.attrs["field_width"] * f_m)
    y = centres(height, light.attrs["field_height"] * f_m)
    empty = make_picture(
        np.zeros((*SIZE, 3)),
        np.zeros((*SIZE, 3)),
        np.ones(SIZE),
        x,
        y,
        focal_length_mm=FOCAL_LENGTH_MM,
        pitch_um=(x[1] - x[0]) * 1e6,
    )
    return truth(light, empty)


def labels_asked_for(metric: Metric) -> xr.Dataset | None:
    """Return only the labels that the metric's `narrow` asks for, as in a run."""
    names = metric.narrow(Demand()).labels if isinstance(metric, NarrowsDemand) else frozenset()
    everything = scene()
    return labels_on(
        everything.drop_vars(
            [v for v in everything.data_vars if v != "radiance" and v not in names]
        ),
        true_picture(),
    )


def noisy_picture(reference: xr.Dataset) -> xr.Dataset:
    """Return a picture that differs from the reference picture by up to 4.75 % of its mean, states
    a standard deviation of 5 % of the mean, and has two saturated pixels.
    """
    sigma = 0.05 * float(reference["xyz"].mean())
    off = sigma * (2 * pattern(reference["xyz"].shape) - 1.05)
    valid = np.ones(SIZE, bool)
    valid[0, :2] = False
    return make_picture(
        reference["xyz"].values + off,
        np.full(off.shape, sigma**2),
        valid,
        reference["x"].values,
        reference["y"].values,
        focal_length_mm=FOCAL_LENGTH_MM,
        pitch_um=reference.attrs["pitch_um"],
    )


def _check_depends(subject: str, metric: Metric, pictures: Pictures, scores: list[Score]) -> None:
    """Check that at least one of these changes the scores: larger errors, a darker picture, fewer
    valid pixels, a softer edge.
    """
    noisy, reference, labels = pictures
    worse = reference["xyz"].values + 5 * (noisy["xyz"].values - reference["xyz"].values)
    half = np.zeros(SIZE, bool)
    half[:, : SIZE[1] // 2] = True
    changed = [
        noisy.assign(xyz=noisy["xyz"].copy(data=worse), variance=25 * noisy["variance"]),
        noisy.assign(xyz=noisy["xyz"].copy(data=noisy["xyz"].values / 2)),
        noisy.assign(valid=noisy["valid"] & half),
    ]
    if any(not same_scores(metric(picture, reference, labels), scores) for picture in changed):
        return
    sharp, soft, edge = (edge_picture(reference, width) for width in (0.5, 2.0, 0.1))
    depends = not same_scores(metric(sharp, edge, labels), metric(soft, edge, labels))
    holds(
        subject,
        "its scores depend on the picture",
        depends,
        "they are the same for noisier, darker, softer and less valid pictures",
    )


def _check_further(subject: str, metric: Metric, pictures: Pictures) -> None:
    """Check that `further` of a second realisation returns the scores that the call returns."""
    if not isinstance(metric, ScoresFurther):
        return
    noisy, reference, labels = pictures
    # the same noise at other pixels, so that it has the same variance
    noise = (noisy["xyz"].values - reference["xyz"].values)[::-1, ::-1]
    second = noisy.assign(xyz=noisy["xyz"].copy(data=reference["xyz"].values + noise))
    wanted = metric(second, reference, labels)
    copies = [one.copy(deep=True) for one in (noisy, second)]
    with keeps(subject, "further returns a list of scores"):
        scores = metric.further(second, noisy, reference, labels)
        check_scores(type(metric).__name__, scores, "further")
    same(subject, "further does not change the first picture", copies[0], noisy)
    same(subject, "further does not change the further picture", copies[1], second)
    holds(
        subject,
        "further returns the scores that the call returns",
        set(map(key_of, scores)) == set(map(key_of, wanted)),
        f"further returned {_names(scores)}, the call {_names(wanted)}",
    )
    value_of = {key_of(score): score.value for score in scores}
    for score in wanted:
        if math.isfinite(score.value):
            close(
                subject,
                f"further returns the value of {score.metric!r} that the call returns",
                value_of[key_of(score)],
                score.value,
                FURTHER_RELATIVE,
                FURTHER_ABSOLUTE,
            )


def _check_parts(subject: str, metric: Metric, pictures: Pictures, scores: list[Score]) -> None:
    """Check that `of_parts` returns a list of scores of the frame for each part of a picture."""
    if not isinstance(metric, ScoresParts):
        return
    noisy, reference, _ = pictures
    part = np.zeros(SIZE, np.intp)
    part[:, SIZE[1] // 2 :] = 1
    part[SIZE[0] // 2 :] += 2
    with keeps(subject, "of_parts returns one list of scores for each part"):
        of_parts = metric.of_parts(noisy, reference, part)
        check_scores_of_parts(type(metric).__name__, of_parts, int(part.max()) + 1)
    known = {key_of(score) for score in scores}
    holds(
        subject,
        "of_parts returns scores that the call returns",
        all(key_of(score) in known for one in of_parts for score in one),
        f"of_parts returned {[_names(one) for one in of_parts]}, the call {_names(scores)}",
    )


def _names(scores: Sequence[Score]) -> list[tuple[str, str, str]]:
    return [key_of(score) for score in scores]


def edge_picture(reference: xr.Dataset, width_pixels: float) -> xr.Dataset:
    """Return a noise-free picture of a slanted edge, from 20 to 100 cd/m2 over `width_pixels`
    pixels.
    """
    y, x = np.indices(SIZE)
    across = (x - SIZE[1] / 2) + 0.1 * (y - SIZE[0] / 2)
    light = 60 + 40 * np.tanh(across / width_pixels)
    xyz = np.repeat(light[..., None], 3, axis=2)
    attributes = {"focal_length_mm": FOCAL_LENGTH_MM, "pitch_um": reference.attrs["pitch_um"]}
    return make_picture(
        xyz,
        np.full_like(xyz, 1e-4),
        np.ones(SIZE, bool),
        reference["x"].values,
        reference["y"].values,
        **attributes,
    )


def _check_bad_input(subject: str, metric: Metric, pictures: Pictures, scores: list[Score]) -> None:
    """Check that a damaged picture is refused, unless the metric does not read the damaged
    variable.
    """
    noisy, reference, labels = pictures

    def refused_or_unread(fault: str, call: Callable[[], list[Score]]) -> None:
        try:
            unread = same_scores(call(), scores)
        except IsetHdrError:
            return
        except Exception as err:
            raise AssertionError(
                f"{subject} breaks the promise 'refuses {fault} with an error of"
                " isethdr_core.errors': "
                f"raised {type(err).__name__}: {err}"
            ) from err
        holds(
            subject,
            f"refuses {fault} with an error of isethdr_core.errors",
            unread,
            "it returned other scores",
        )

    for fault, damaged in damaged_pictures(noisy):
        refused_or_unread(fault, partial(metric, damaged, reference, labels))
    refused_or_unread(
        "a truth of another size", lambda: metric(noisy, reference.isel(x=slice(0, 20)), labels)
    )


def same_scores(first: Sequence[Score], second: Sequence[Score]) -> bool:
    """Return whether two lists of scores are the same, NaN for NaN."""
    return [repr(s) for s in first] == [repr(s) for s in second]


def damaged_pictures(valid: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield (mistake, picture) for the possible mistakes in a picture. Its light is sealed."""
    valid = sealed(valid, "xyz", "variance")
    yield "an empty Dataset", xr.Dataset()
    for name in ("xyz", "variance", "valid"):
        yield f"a picture without {name!r}", valid.drop_vars(name)
    yield "a picture in other units", valid.assign(xyz=valid["xyz"].assign_attrs(units="W m-2"))
