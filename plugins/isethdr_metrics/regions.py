"""Regions: the frame and the objects in it, and what every metric needs of them."""

from __future__ import annotations

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import UnitError
from isethdr_core.truth import check_picture, total_variance, variance_known

# the frame is cut into 12 x 12 blocks; noise and scene are taken as independent between them
BLOCKS = 12
RESAMPLES = 400
FEWEST_BLOCKS = 8  # below this, resampling says nothing: the interval is NaN
NAN = float("nan")


def check_pair(picture, truth) -> None:
    """Raise UnitError unless picture and truth are pictures on the same grid."""
    check_picture(picture, "picture")
    check_picture(truth, "truth")
    if picture["xyz"].shape != truth["xyz"].shape:
        raise UnitError(
            f"the picture has shape {picture['xyz'].shape}, its truth {truth['xyz'].shape}; "
            "make the truth with isethdr_core.truth.truth(mixed, picture)"
        )


def luminances(picture, truth):
    """Return Y of picture and truth and which pixels are valid, each (y, x)."""
    check_pair(picture, truth)
    return (
        picture["xyz"].values[..., 1].astype(float),
        truth["xyz"].values[..., 1].astype(float),
        picture["valid"].values,
    )


def luminance_variance(picture) -> np.ndarray:
    """Return the variance (y, x) of the luminance of a pixel, (cd/m2)^2: temporal and fixed
    pattern.
    """
    return total_variance(picture).values[..., 1].astype(float)


def variance_stated(picture, score: str, unit: str) -> bool:
    """Return whether the picture states its variance; where it does not, say that `score` is left
    out.
    """
    if variance_known(picture):
        return True
    ledger.left_out(score, "the image processing is nonlinear and states no variance", NAN, unit)
    return False


def frame_and_objects(shape, labels):
    """Yield (name, mask): the whole frame as "", then each labelled object that has a pixel in it.

    Names come from the object table; an object without an entry is called by its number.
    """
    yield "", np.ones(shape, bool)
    if labels is None or "instance" not in labels:
        return
    instance = labels["instance"].values
    if instance.shape != tuple(shape):
        raise UnitError(
            f"labels have shape {instance.shape}, the picture {tuple(shape)}; "
            "use isethdr_core.truth.labels_on(scene, picture)"
        )
    known = {
        int(o["instance"]): str(o.get("name") or o.get("category") or o["instance"])
        for o in labels.attrs.get("objects", [])
    }
    taken: set[str] = set()
    for number in np.unique(instance[instance > 0]).tolist():
        name = known.get(number, str(number))
        if name in taken:
            name = f"{name} {number}"
        taken.add(name)
        yield name, instance == number


def median_interval(values, independent: int):
    """Return (median, low, high) of a list of `values`: 95 % by the order statistics of
    `independent` draws.

    The number of draws below the median is binomial, so the ranks n / 2 +- 1.96 sqrt(n) / 2 enclose
    it whatever the distribution (Conover 1999, section 3.2). Where these ranks do not exist,
    smallest and largest value bound the sample.
    """
    spread = 0.98 / np.sqrt(max(independent, 1))
    low, middle, high = np.quantile(values, [max(0.5 - spread, 0.0), 0.5, min(0.5 + spread, 1.0)])
    return float(middle), float(low), float(high)


def mean_interval(values, mask):
    """Return (mean, low, high) of `values` (y, x) over `mask`: 95 % by resampling blocks of the
    frame.
    """
    rows, columns = (np.flatnonzero(mask.any(axis)) for axis in (1, 0))
    if not rows.size:
        return NAN, NAN, NAN
    part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    begin = [
        np.flatnonzero(np.diff(np.arange(n)[cut] * BLOCKS // n, prepend=-1))
        for n, cut in zip(mask.shape, part, strict=True)
    ]
    count, total = (
        np.add.reduceat(np.add.reduceat(v, begin[1], axis=1, dtype=float), begin[0], axis=0).ravel()
        for v in (mask[part], np.where(mask[part], values[part], 0.0))
    )
    mean = total.sum() / count.sum()
    held = count > 0
    if held.sum() < FEWEST_BLOCKS:
        return mean, NAN, NAN
    count, total = count[held], total[held]
    # resampling is part of the score's definition, so its seed is fixed: the same picture gives the
    # same interval
    picks = np.random.default_rng(0).multinomial(
        len(count), np.full(len(count), 1 / len(count)), RESAMPLES
    )
    low, high = np.percentile(picks @ total / (picks @ count), [2.5, 97.5])
    return float(mean), float(low), float(high)
