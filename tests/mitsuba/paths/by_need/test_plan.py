"""The plan of paths: the numbers that variances and limits require, and their division into
launches.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.paths.by_need import plan
from isethdr_mitsuba.paths.by_need.rounds import exposure_change
from isethdr_mitsuba.paths.by_need.tallies import Neighbours, Tally, path_variance


def test_planned_paths_bring_tiles_to_their_limit_in_the_least_time():
    rng = np.random.default_rng(1)
    variance = rng.lognormal(0, 2, (3, 3, 500))
    limit = rng.lognormal(0, 1, (3, 500))
    weights = np.array([1.0, 0.3, 0.0])
    us = np.array([1.0, 2.0, 1.5])
    limit[:, 7] = np.inf  # no camera sees this tile
    paths = plan.needed(variance, limit, weights, us)
    assert not paths[:, 7].any() and not paths[2].any(), "nor where a group has no weight"
    relative = (weights[:, None, None] ** 2 * variance / limit**2).max(1)
    cost = us @ paths
    kept = (cost > 0) & (cost < cost.max() * (1 - 1e-9))
    assert 1 - kept.mean() <= plan.GIVEN_UP + 2 / 500
    reached = (relative[:2, kept] / paths[:2, kept]).sum(0)
    np.testing.assert_allclose(reached, 1.0, rtol=1e-9)
    # any other division of the same time between two groups has more noise
    for shift in (0.9, 1.1):
        first = paths[0, kept] * shift
        second = (cost[kept] - us[0] * first) / us[1]
        fair = second > 0
        other = relative[0, kept] / first + relative[1, kept] / np.where(fair, second, 1)
        assert (other[fair] > 1).all()


def test_a_limit_of_zero_is_no_limit():
    """Light of a red lamp has no Z, so the limit of a blue channel is 0 there. Without a plan for
    these tiles (0 / 0), the plan of all others would lose its bound on the dearest tiles.
    """
    rng = np.random.default_rng(2)
    variance = rng.lognormal(0, 2, (2, 3, 500))
    limit = rng.lognormal(0, 1, (3, 500))
    variance[:, 2, :20] = 0.0
    variance[:, 2, 20:40] = 1.0  # light with Z in the neighbourhood
    limit[2, :40] = np.inf
    expected = plan.needed(variance, limit, [1.0, 1.0], np.ones(2))
    limit[2, :40] = 0.0
    found = plan.needed(variance, limit, [1.0, 1.0], np.ones(2))
    assert np.isfinite(expected).all() and expected[:, :40].all()
    assert np.array_equal(found, expected)


def test_launches_follow_what_is_planned_and_share_paths():
    rng = np.random.default_rng(3)
    more = rng.integers(0, 5, (4, 60)) * 8 * (rng.random((4, 60)) < 0.5)
    found = np.zeros_like(more)
    launched = 0
    for tiles, paths, bits in plan.lots(more):
        assert len(set(tiles)) == len(tiles) and (paths > 0).all()
        launched += paths.sum()
        for g in range(4):
            found[g, tiles] += paths * (bits >> g & 1)
    assert np.array_equal(found, more)
    assert launched == more.max(0).sum(), "no tile takes more than its dearest group"


def test_nothing_is_added_for_little():
    more = plan.more_paths(np.array([10.0, 100.0, 111.0, 130.0]), np.full(4, 100.0))
    assert list(more) == [0, 0, 0, 32]


def test_neighbours_are_tiles_of_the_same_object():
    rng = np.random.default_rng(4)
    instance = rng.integers(0, 3, (7, 9))
    values = rng.random((2, 63))
    found = Neighbours(instance).sum(values).reshape(2, 7, 9)
    planes = values.reshape(2, 7, 9)
    for y in range(7):
        for x in range(9):
            part = slice(max(y - 2, 0), y + 3), slice(max(x - 2, 0), x + 3)
            same = instance[part] == instance[y, x]
            want = (planes[(slice(None), *part)] * same).sum((1, 2))
            # sums of 25 numbers in float32
            np.testing.assert_allclose(found[:, y, x], want, rtol=1e-5)


def test_variance_of_paths_from_batches():
    """Estimate the known variance of paths from batches of independent paths.

    The estimate of each tile uses its neighbours, so it is better than from its own few batches.
    """
    rng = np.random.default_rng(5)
    shape = (12, 16)
    light = 1 + rng.random((12, 16))
    tally = Tally.empty(1, 1, 192)
    batches = 4
    each = 8
    sums = rng.gamma(2.0, light.reshape(-1, 1, 1) / 2, (192, batches, each)).sum(2)
    tally.paths[:], tally.batches[:] = batches * each, batches
    tally.xyz[0, :] = sums.sum(1)
    tally.squares[0, :] = (sums**2 / each).sum(1)
    found = path_variance([tally], Neighbours(np.ones(shape, int)))[0, 1]
    truth = light.ravel() ** 2 / 2
    assert found.mean() == pytest.approx(truth.mean(), rel=0.1)  # 0.06: 576 degrees of freedom
    own = sums.var(1, ddof=1) / each
    assert np.std(found / truth) < 0.4 * np.std(own / truth)


def test_exposures_are_compared_where_cameras_chose_any():
    assert exposure_change(np.array([1e-3, 2.0]), np.array([1.2e-3, 2.0])) == pytest.approx(0.2)
    assert exposure_change(np.zeros(0), np.zeros(0)) == 0.0
