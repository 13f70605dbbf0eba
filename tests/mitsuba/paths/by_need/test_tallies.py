"""Tallies: batches of one low-discrepancy sequence overstate the noise; two independent buffers
show by how much.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")


@pytest.fixture(autouse=True)
def llvm():
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


# tiles (rows, columns), number of batches, and paths per batch
SHAPE = (40, 60)
BATCHES = 8
PATHS = 16


def tally_of(batches):
    """Return a tally of batch means (batch, tile) for one group, with equal X, Y and Z."""
    from isethdr_mitsuba.paths.by_need.mean_of_rounds import Sums
    from isethdr_mitsuba.paths.by_need.tallies import Tally

    found = Tally.empty(1, 1, batches.shape[1])
    found.paths += PATHS * len(batches)
    found.batches += len(batches)
    found.xyz += PATHS * batches.sum(0)
    found.squares += PATHS * (batches**2).sum(0)
    sums = Sums(np.arange(batches.shape[1]), found.xyz[0, :1], found.xyz[0])
    found.light.add(0, found.paths[0], sums)
    return found


def buffers(rng, spread, level):
    """Return two independent buffers.

    The batches of a buffer have a standard deviation of 1 / root(PATHS). The means of buffers have
    `spread` times the standard deviation that follows from that.
    """
    out = []
    for _ in range(2):
        batches = rng.normal(0, 1 / np.sqrt(PATHS), (BATCHES, level.size))
        batches += (spread - 1) * batches.mean(0)  # deviations from the mean stay
        out.append(tally_of(level.ravel() + batches))
    return out


@pytest.mark.parametrize("spread", [1.0, 0.5])
def test_two_buffers_tell_by_how_much_batches_overstate(spread):
    from isethdr_mitsuba.paths.by_need.tallies import Neighbours, path_variance, spread_of_buffers

    rng = np.random.default_rng(4)
    level = np.full(SHAPE, 10.0)
    found = buffers(rng, spread, level)
    near = Neighbours(np.zeros(SHAPE, int))
    each = path_variance(found, near)
    # the variance of one path is 1; each tile determines it to a seventh, from its 15 batches and a
    # weight of 24 for the 375 of its neighbours
    assert each.mean() == pytest.approx(1.0, rel=0.02)
    of_batches = each / (2 * PATHS * BATCHES)
    # 10 %: 2400 tiles determine it to root(2 / 2400) = 3 %
    ratio = spread_of_buffers(*found, of_batches)
    assert ratio.shape == (1, 1, 1) and ratio.item() == pytest.approx(spread**2, rel=0.1)


def test_light_without_spread_says_nothing_of_the_buffers():
    from isethdr_mitsuba.paths.by_need.tallies import Neighbours, path_variance, spread_of_buffers

    found = [tally_of(np.full((BATCHES, 2400), 3.0)) for _ in range(2)]
    of_batches = path_variance(found, Neighbours(np.zeros(SHAPE, int))) / 64
    assert spread_of_buffers(*found, of_batches).item() == 1.0
