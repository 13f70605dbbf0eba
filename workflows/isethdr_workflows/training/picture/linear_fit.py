"""Weights of the linear start: least squares on sheets of the training, in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..torch_library import functional, torch
from .loss import Batch, log_weight, weight
from .networks.linear_start import LinearStart, merged
from .sheets import Sheets

SHEETS = 32
FIRST = 1 << 30  # number of the first sheet: a training does not come so far
TAKEN = 7  # every so many-th cell: its neighbours tell nearly the same
RIDGE = 1e-6  # of the mean of the diagonal
LEAST_CELLS = 20  # per weight of a filter; a level with fewer takes the filters of another one
ROUNDS = 3  # the third changes the weights of cells little


class Rows(NamedTuple):
    """Some cells of patches."""

    samples: torch.Tensor  # (cell, window)
    truth: torch.Tensor  # (cell, out)
    weights: torch.Tensor  # (cell, level)


@torch.no_grad()
def fit(start: LinearStart, sheets: Sheets) -> None:
    """Set the weights of a linear start.

    The filters of a level minimise the sum over cells of share w (W a - t)^2: a the samples of a
    window, t the truth of a cell, w the weight of the loss. Noise in the samples keeps the filters
    from amplifying it. Later rounds weigh cells so that the sum nears
    the loss's logarithm (iteratively reweighted least squares, Holland and Welsch 1977), or edges
    and lamps would decide how an even road is filtered.

    Parameters
    ----------
    start : linear start of a network.
    sheets : sheets of its training.
    """
    batches = [
        Batch(*(torch.from_numpy(np.ascontiguousarray(v)) for v in sheets.sheet(FIRST + number)))
        for number in range(SHEETS)
    ]
    for number in range(ROUNDS):
        solved = _solved(start, [_rows(start, batch, again=number > 0) for batch in batches])
        if solved is None:
            return
        start.weight.copy_(solved.reshape(start.weight.shape))


def _solved(start: LinearStart, parts: Sequence[Rows]) -> torch.Tensor | None:
    """Return the weights (level, out, window); None where there are too few cells."""
    levels = len(start.levels)
    window = start.period**2 * start.taps**2
    out = len(start.weight) // levels
    products = torch.zeros(levels, window, window, dtype=torch.float64)
    targets = torch.zeros(levels, window, out, dtype=torch.float64)
    cells = torch.zeros(levels)
    for samples, truth, weights in parts:
        for k in range(levels):
            used = weights[:, k] > 0
            own = samples[used].double()
            weighted = own * weights[used, k, None]
            products[k] += weighted.T @ own
            targets[k] += weighted.T @ truth[used].double()
            cells[k] += used.sum()
    known = (cells >= LEAST_CELLS * window).nonzero().flatten()
    if not len(known):
        return None
    solved = torch.zeros(levels, out, window)
    for k in range(levels):
        nearest = int(known[(known - k).abs().argmin()])
        ridge = RIDGE * products[nearest].diagonal().mean()
        matrix = products[nearest] + ridge * torch.eye(window, dtype=torch.float64)
        solved[k] = torch.linalg.solve(matrix, targets[nearest]).T
    return solved


def _rows(start: LinearStart, batch: Batch, again: bool) -> Rows:
    """Return samples, truth and weights of some cells.

    Parameters
    ----------
    start : whose window and levels are used.
    batch : patches, with their truth.
    again : whether the weights of `start` are solved already.
    """
    measured = batch.valid.amax(1, keepdim=True)
    weights = weight(batch)
    raw = batch.raw
    noise = batch.noise
    if start.planes > 1:
        raw, noise = merged(raw, noise, batch.valid)
    packed = functional.pixel_unshuffle(raw, start.period)
    around = functional.pad(packed, (start.taps // 2,) * 4, mode="replicate")
    # one saturated sample in the window, and the cell is not used
    side = start.period * start.taps
    inside = -functional.max_pool2d(-measured, side, start.period, side // 2 - start.period // 2)
    truth = functional.pixel_unshuffle(batch.truth, start.period)
    mean_weight = functional.avg_pool2d(weights, start.period) * inside
    if again:
        missed = (start(batch.raw, batch.noise, batch.valid) - truth) ** 2
        mean_weight = mean_weight * log_weight(mean_weight * missed, start.period)
    every = (
        functional.unfold(around, start.taps),
        truth.flatten(2),
        (start.shares(raw, noise) * mean_weight).flatten(2),
    )
    return Rows(*(v[..., ::TAKEN].transpose(1, 2).flatten(0, 1) for v in every))
