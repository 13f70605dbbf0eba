"""Defects: pixels of the sensor's map of defects become the mean of neighbours with the same
filter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .combine import Merged
from .noise_propagation import NoisePart, SampleNoise

MAP = "defect"  # variable of the captures, (y, x) bool


def corrected(merged: Merged, defect: np.ndarray, cell_shape: tuple[int, int]) -> Merged:
    """Return the mosaic with every defect replaced by the mean of opposite neighbours.

    There are two pairs of neighbours at the period of the filter array: above and below, left and
    right. Of the pairs with two valid pixels that are no defects, the one with the smaller
    difference relative to its noise is used. Without such a pair, the mean of all valid neighbours
    that are no defects is used. The mean of a pair is exact for a linear ramp. A defect without
    such a neighbour is not valid.

    Parameters
    ----------
    merged : electrons and variances (y, x).
    defect : (y, x) bool, the map of defects.
    cell_shape : rows and columns of the filter array's period.
    """
    y, x = np.nonzero(defect)
    if not len(y):
        return merged
    rows, columns = cell_shape
    height, width = defect.shape
    steps = np.array([(-rows, 0), (rows, 0), (0, -columns), (0, columns)])
    at_y, at_x = (position[:, None] + step for position, step in zip((y, x), steps.T, strict=True))
    inside = (at_y >= 0) & (at_y < height) & (at_x >= 0) & (at_x < width)
    at_y = np.clip(at_y, 0, height - 1)
    at_x = np.clip(at_x, 0, width - 1)
    sound = inside & ~defect[at_y, at_x] & merged.valid[at_y, at_x]
    value = merged.signal_e[at_y, at_x]
    variance = merged.variance_e2[at_y, at_x]
    pairs = sound[:, ::2] & sound[:, 1::2]  # (defect, direction)
    difference = np.abs(value[:, ::2] - value[:, 1::2])
    noise = np.sqrt(np.maximum(variance[:, ::2] + variance[:, 1::2], 1e-12))
    best = np.where(pairs, difference / noise, np.inf).argmin(1)
    use = np.where(pairs.any(1)[:, None], np.arange(4) // 2 == best[:, None], sound)
    count = np.maximum(use.sum(1), 1)
    signal, spread, valid = (
        np.array(values) for values in (merged.signal_e, merged.variance_e2, merged.valid)
    )
    some = use.any(1)
    signal[y[some], x[some]] = ((value * use).sum(1) / count)[some]
    spread[y[some], x[some]] = ((variance * use).sum(1) / count**2)[some]
    valid[y, x] = some
    places = [(int(step[0]), int(step[1])) for step in steps]
    parts = []
    for part in merged.fixed.parts:
        of_mean = _variance_of_mean(part, part.variance_e2[at_y, at_x], use, places)
        mended = np.array(part.variance_e2)
        mended[y[some], x[some]] = of_mean[some]
        parts.append(part._replace(variance_e2=mended))
    return replace(
        merged,
        signal_e=signal,
        variance_e2=spread,
        valid=valid,
        fixed=SampleNoise(tuple(parts)),
    )


def _variance_of_mean(
    part: NoisePart, variance_e2: np.ndarray, use: np.ndarray, places: list[tuple[int, int]]
) -> np.ndarray:
    """Return the variance (defect,) of the mean of neighbours by one cause of the fixed pattern.

    Parameters
    ----------
    part : the cause, which states the samples that share a deviation.
    variance_e2 : variance by this cause of each neighbour (defect, neighbour), e^2.
    use : (defect, neighbour) bool, the neighbours in the mean.
    places : rows and columns from a defect to each neighbour.
    """
    count = np.maximum(use.sum(1), 1)
    if part.alone():  # an estimate that may be below 0
        return (variance_e2 * use).sum(1) / count**2
    deviation_e = np.sqrt(variance_e2) * use
    groups = part.groups(places)
    return sum(deviation_e[:, group].sum(1) ** 2 for group in groups) / count**2
