"""Plan of paths: the least run time that brings the noise of every tile below a limit.

In a tile, a path of the group g has the variance v_g and takes the time t_g. The variance sum of
v_g / n_g is reached in the least time with n_g ~ sqrt(v_g / t_g) (Cochran 1977, eq. 5.24: optimum
allocation over strata).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

# CPU us of a path, measured at 640x360: without any group, for the sky, and for a group of lamps
BASE_US = 1.1
SKY_US = 0.4
LAMPS_US = 1.3
# share of the tiles: those that would take most get what the dearest other one gets
GIVEN_UP = 0.01
STEP = 8  # paths that counts are multiples of
WORTH = 1.15  # times what there is: for less no path is added


class Lot(NamedTuple):
    """Tiles of one launch."""

    tiles: np.ndarray  # (entry,)
    paths: np.ndarray  # (entry,)
    groups: np.ndarray  # (entry,) bits


def needed(
    variance: np.ndarray, limit: np.ndarray, weights: Sequence[float], group_us: np.ndarray
) -> np.ndarray:
    """Return the paths (group, tile) that bring each tile's noise to its limit.

    Parameters
    ----------
    variance : (group, 3, tile) of X, Y and Z of single paths.
    limit : (3, tile) standard deviations of X, Y and Z of all light, infinite where nobody looks.
    weights : (group,) of the light.
    group_us : (group,) CPU us of a path.
    """
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
    """Return the paths (group, tile) that are added to those there are: whole steps, none for
    little.
    """
    steps = np.ceil(np.maximum(planned - have, 0) / STEP).astype(int) * STEP
    return np.where(planned > WORTH * have, steps, 0)


def lots(more: np.ndarray) -> Iterator[Lot]:
    """Yield launches that together follow `more` (group, tile) paths. Groups that go on in one tile
    share paths: the last of them are of the group with most alone.
    """
    order = np.argsort(-more, axis=0, kind="stable")
    sorted_ = np.take_along_axis(more, order, 0)
    for k in range(len(more) - 1, -1, -1):
        paths = sorted_[k] - (sorted_[k + 1] if k + 1 < len(more) else 0)
        on = np.flatnonzero(paths > 0)
        if len(on):
            yield Lot(on, paths[on], (1 << order[: k + 1, on]).sum(0))
