"""Weights of the linear start: least squares on sheets of the training, in closed form."""

from __future__ import annotations

import numpy as np

from ..torch_library import functional, torch
from .loss import Batch, weight
from .networks.linear_start import LinearStart, merged
from .sheets import Sheets

SHEETS = 32
FIRST = 1 << 30  # number of the first sheet: a training does not come so far
TAKEN = 7  # every so many-th cell: its neighbours tell nearly the same
RIDGE = 1e-6  # of the mean of the diagonal
LEAST_CELLS = 20  # per weight of a filter; a level with fewer takes the filters of another one


@torch.no_grad()
def fit(start: LinearStart, sheets: Sheets) -> None:
    """Set the weights of a linear start.

    The filters of a level minimise the sum over cells of share w (W a - t)^2: a the samples of a
    window, t the truth of a cell, w the weight of the loss. Noise in the samples keeps the filters
    from amplifying it.

    Parameters
    ----------
    start : of a network.
    sheets : of its training.
    """
    levels = len(start.levels)
    window = start.period**2 * start.taps**2
    out = len(start.weight) // levels
    products = torch.zeros(levels, window, window, dtype=torch.float64)
    targets = torch.zeros(levels, window, out, dtype=torch.float64)
    cells = torch.zeros(levels)
    for number in range(SHEETS):
        patches = sheets.sheet(FIRST + number)
        batch = Batch(*(torch.from_numpy(np.ascontiguousarray(v)) for v in patches))
        samples, truth, weights = _rows(start, batch)
        for k in range(levels):
            used = weights[:, k] > 0
            own = samples[used].double()
            weighted = own * weights[used, k, None]
            products[k] += weighted.T @ own
            targets[k] += weighted.T @ truth[used].double()
            cells[k] += used.sum()
    known = (cells >= LEAST_CELLS * window).nonzero().flatten()
    if not len(known):
        return
    solved = torch.zeros(levels, out, window)
    for k in range(levels):
        nearest = int(known[(known - k).abs().argmin()])
        ridge = RIDGE * products[nearest].diagonal().mean()
        matrix = products[nearest] + ridge * torch.eye(window, dtype=torch.float64)
        solved[k] = torch.linalg.solve(matrix, targets[nearest]).T
    start.weight.copy_(solved.reshape(start.weight.shape))


def _rows(start: LinearStart, batch: Batch) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return samples (cell, window), truth (cell, out) and weights (cell, level) of some cells."""
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
    every = (
        functional.unfold(around, start.taps),
        truth.flatten(2),
        (start.shares(raw, noise) * mean_weight).flatten(2),
    )
    first, second, third = (v[..., ::TAKEN].transpose(1, 2).flatten(0, 1) for v in every)
    return first, second, third
