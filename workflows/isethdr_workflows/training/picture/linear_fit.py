"""Weights of the linear start: a closed-form least-squares solution on sheets of the training."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..torch_library import functional, torch
from .loss import Batch, log_weight, weight
from .networks.linear_start import LinearStart, merged
from .sheets import Sheets

SHEETS = 32  # number of sheets
FIRST = 1 << 30  # number of the first sheet, which no training reaches
TAKEN = 7  # every 7th cell is used, because neighbouring cells have nearly the same information
RIDGE = 1e-6  # ridge penalty over the mean of the diagonal
# least number of cells per weight of a filter; a level with fewer takes the filters of the nearest
# level that has enough
LEAST_CELLS = 20
ROUNDS = 3  # number of rounds; the third one changes the weights of cells only little


class Rows(NamedTuple):
    """Samples, targets and weights of some cells of patches."""

    samples: torch.Tensor  # (cell, window) samples of the window around each cell
    truth: torch.Tensor  # (cell, out) true X, Y, Z of the pixels of each cell
    weights: torch.Tensor  # (cell, level) weight of each cell for each level


@torch.no_grad()
def fit(start: LinearStart, sheets: Sheets) -> None:
    """Set the weights of a linear start.

    The filters W of a level minimise the sum over cells of share w (W a - t)^2, with a the samples
    of a window, t the truth of a cell, w the weight of the loss, and share the share of the level.
    The samples have noise, so the filters do not amplify it. Later rounds change the weights of
    cells so that the sum approaches the logarithm in the loss (iteratively reweighted least
    squares, Holland and Welsch 1977). Otherwise edges and lamps would determine the filters for an
    even road.

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
    """Return the weights (level, out, window); None if all levels have too few cells."""
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
    start : linear start with the window and the levels.
    batch : patches with their truth.
    again : whether the weights of `start` were already solved, so that cells are reweighted.
    """
    measured = batch.valid.amax(1, keepdim=True)
    weights = weight(batch)
    raw = batch.raw
    noise = batch.noise
    if start.planes > 1:
        raw, noise = merged(raw, noise, batch.valid)
    packed = functional.pixel_unshuffle(raw, start.period)
    around = functional.pad(packed, (start.taps // 2,) * 4, mode="replicate")
    # a cell with a saturated sample in its window is not used
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
