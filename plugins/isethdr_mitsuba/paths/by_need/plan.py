"""Plan of paths: the least run time that brings the noise of every tile below a limit.

In a tile, a path of the group g has the variance v_g and takes the time t_g. The variance sum of
v_g / n_g is reached in the least time with n_g ~ sqrt(v_g / t_g) (Cochran 1977, eq. 5.24: optimum
allocation over strata).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

# CPU time, us, measured at 640x360: of a path itself, and of each group of sky or lamps in addition
BASE_US = 1.1
SKY_US = 0.4
LAMPS_US = 1.3
# Share of the tiles that may stay above their limit: those that would take the most time. Each of
# them gets as much time as the most expensive tile among the others.
GIVEN_UP = 0.01
STEP = 8  # numbers of added paths are multiples of this
HALVINGS = 12  # number of bisection steps for an affordable factor; its error is about 0.02 %
WORTH = 1.15  # smallest ratio of planned paths to existing ones at which paths are added


class Lot(NamedTuple):
    """Tiles of one launch of the renderer."""

    tiles: np.ndarray  # (entry,) index of the tile
    paths: np.ndarray  # (entry,) number of paths
    groups: np.ndarray  # (entry,) bit k is set: the paths follow light group k


def needed(
    variance: np.ndarray, limit: np.ndarray, weights: Sequence[float], group_us: np.ndarray
) -> np.ndarray:
    """Return the paths (group, tile) that bring each tile's noise to its limit.

    Parameters
    ----------
    variance : (group, 3, tile) variance of X, Y and Z of single paths, (cd/m2)^2.
    limit : (3, tile) largest standard deviations of X, Y and Z of all light, cd/m2; infinite where
        no sensor sees the tile. 0 sets no limit either: the light has no X, Y or Z there.
    weights : (group,) weights of the light groups.
    group_us : (group,) CPU time of a path, us.
    """
    limit = np.where(limit > 0, limit, np.inf)
    relative = np.square(np.asarray(weights))[:, None, None] * variance / np.square(limit)
    root = np.sqrt(relative.max(1))
    us = np.sqrt(group_us)[:, None]
    paths = root / us * (root * us).sum(0)
    cost = np.asarray(group_us) @ paths
    has_limit = np.isfinite(limit).any(0)
    if not has_limit.any():
        return np.zeros_like(paths)
    dearest = np.quantile(cost[has_limit], 1 - GIVEN_UP)
    return paths * np.where(cost > dearest, dearest / np.where(cost > 0, cost, 1), 1)


def more_paths(planned: np.ndarray, have: np.ndarray) -> np.ndarray:
    """Return the paths (group, tile) to add to the existing ones, in multiples of `STEP`.

    No path is added where the plan exceeds the existing paths by little (`WORTH`).

    Parameters
    ----------
    planned : (group, tile) paths that `needed` returns.
    have : (group, tile) existing paths.
    """
    steps = np.ceil(np.maximum(planned - have, 0) / STEP).astype(int) * STEP
    return np.where(planned > WORTH * have, steps, 0)


def affordable(needed: np.ndarray, have: np.ndarray, most_mean: float) -> float:
    """Return the largest factor on the needed paths, at most 1, with which the mean over tiles of
    the paths of all groups together is at most `most_mean`. The noise is then 1 / sqrt(factor)
    times the noise allowed.

    If no path can be added, it is the largest factor with which no tile needs more paths than it
    has. The factor is above 0.

    Parameters
    ----------
    needed : (group, tile) paths that the function `needed` returns.
    have : (group, tile) existing paths.
    most_mean : largest mean over tiles of the sum over groups.
    """

    def is_within(factor: float) -> bool:
        return (have + more_paths(factor * needed, have)).sum(0).mean() <= most_mean

    if is_within(1.0):
        return 1.0
    factor = 0.0
    for halving in range(1, HALVINGS + 1):
        more = factor + 0.5**halving
        factor = more if is_within(more) else factor
    if factor > 0:
        return factor
    return float(np.min(np.divide(have, needed, out=np.ones_like(needed), where=needed > have)))


def lots(more: np.ndarray) -> Iterator[Lot]:
    """Yield launches that together follow the paths of all groups.

    One path may serve several groups. In each tile, the first paths serve all groups that need
    paths; the last paths serve only the group that needs most.

    Parameters
    ----------
    more : (group, tile) paths that each group needs.
    """
    order = np.argsort(-more, axis=0, kind="stable")
    sorted_ = np.take_along_axis(more, order, 0)
    for k in range(len(more) - 1, -1, -1):
        paths = sorted_[k] - (sorted_[k + 1] if k + 1 < len(more) else 0)
        on = np.flatnonzero(paths > 0)
        if len(on):
            yield Lot(on, paths[on], (1 << order[: k + 1, on]).sum(0))
