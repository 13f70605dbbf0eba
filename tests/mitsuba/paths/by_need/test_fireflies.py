"""Fireflies: a tile that both buffers made too bright keeps what further paths find; no light is
lost, and tiles that further paths confirm stay as they are.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.paths.by_need import fireflies
from isethdr_mitsuba.paths.by_need.mean_of_rounds import Sums
from isethdr_mitsuba.paths.by_need.moved_light import CameraNoise, MovedLight
from isethdr_mitsuba.renderer import MitsubaRenderer

from ..test_integrator import follower
from .test_rare_light import BANDS, NOISE, SHAPE, SHARE, TILE, add_path, buffers, instance, light
from .test_rounds import SIZE, judged, llvm, rounds

BATCHES = 8  # of each step of further paths

__all__ = ["instance", "llvm"]  # fixtures


def further_paths(luminance, steps):
    """Return a function that pretends to follow paths.

    Parameters
    ----------
    luminance : function(step, batch) -> luminance of a batch, cd/m2.
    steps : list that gets the tiles of each step.
    """

    def follow(tally, tiles, positions, paths):
        steps.append(tiles[positions].tolist())
        batches = np.array([luminance(len(steps) - 1, k) for k in range(BATCHES)], float)
        each = paths / BATCHES
        tally.paths[0, positions] += paths
        tally.batches[0, positions] += BATCHES
        tally.xyz[0][:, positions] += each * batches.sum()
        tally.squares[0][:, positions] += each * (batches**2).sum()
        sums = np.full(len(positions), each * batches.sum())
        radiance = (BANDS[:, None] * sums).astype(np.float32)
        tally.light.add(0, np.full(len(positions), paths), Sums(positions, radiance, [sums] * 3))

    return follow


def moved(tallies, instance, luminance):
    """Return the light that was moved, and the tiles that got further paths in each step."""
    for tally in tallies:
        tally.light.give_all_weight()
    found = MovedLight(tallies, instance, CameraNoise([1.0], np.full(SHAPE, NOISE), SHARE))
    steps = []
    assert fireflies.move_fireflies(found, further_paths(luminance, steps)) == 1
    return found, steps


def bright(seed):
    """Return two buffers that both found a rare bright path in `TILE`."""
    tallies = buffers(np.random.default_rng(seed))
    for tally in tallies:
        add_path(tally, TILE, 3000.0)
    return tallies


def test_a_tile_that_both_buffers_made_too_bright_keeps_what_further_paths_find(instance):
    tallies = bright(1)
    before = light(tallies)
    found, steps = moved(tallies, instance, lambda step, batch: 1.0)
    after = light(tallies)
    assert before[TILE] > 90
    assert after[TILE] == pytest.approx(1.0, abs=0.5 * NOISE)
    assert after.sum() == pytest.approx(before.sum(), rel=1e-12)
    assert found.tiles == [2]
    assert found.most <= 0.5
    other = instance.ravel() != instance.ravel()[TILE]
    assert (after == before)[other].all()
    assert steps == [[TILE]] * 3, "as many paths as are needed to miss no rare light"


def test_a_tile_that_further_paths_confirm_stays(instance):
    tallies = bright(2)
    before = light(tallies)
    found, steps = moved(tallies, instance, lambda step, batch: 90.0 + batch)
    assert found.tiles == [0]
    assert (light(tallies) == before).all()
    assert steps == [[TILE]], "the first step is enough"


def test_one_bright_path_confirms_no_tile(instance):
    """A batch of the first step holds a rare path, which makes its mean as bright as the tile."""
    tallies = bright(3)
    found, _ = moved(
        tallies, instance, lambda step, batch: 800.0 if (step, batch) == (0, 3) else 1.0
    )
    assert found.tiles == [2]
    # 800 cd/m2 in 32 of 4096 or 16384 paths
    assert light(tallies)[TILE] < 1 + 800 * 32 / 4096 + 0.5 * NOISE


def test_light_of_an_object_that_is_too_small_goes_to_others(instance):
    instance.ravel()[TILE : TILE + 3] = 7
    tallies = bright(4)
    before = light(tallies)
    found, _ = moved(tallies, instance, lambda step, batch: 1.0)
    after = light(tallies)
    assert found.tiles == [2]
    assert after[TILE] < 1.5
    assert after.sum() == pytest.approx(before.sum(), rel=1e-12)
    assert (after > before)[instance.ravel() == 0].all()


def test_the_median_is_that_of_the_same_object(instance):
    values = np.random.default_rng(5).random(SHAPE)
    rows, columns = (a.ravel() for a in np.indices(SHAPE))
    found = fireflies.median_around(values, instance, rows, columns).reshape(SHAPE)
    for row, column in ((0, 0), (0, 19), (15, 20), (29, 39), (7, 1)):
        near = np.s_[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3]
        same = instance[near] == instance[row, column]
        assert found[row, column] == pytest.approx(np.median(values[near][same]))


@pytest.mark.parametrize(
    ("own", "sigma", "expected"), [(6.1, 0.1, 1), (5.9, 0.1, 0), (6.1, 1.3, 0), (6.1, np.inf, 0)]
)
def test_a_tile_stands_out_by_its_median_and_by_the_noise(instance, own, sigma, expected):
    luminance = np.ones(SHAPE)
    luminance.ravel()[TILE] = own
    found = fireflies.stands_out(luminance, instance, np.full(SHAPE, sigma))
    assert found.sum() == expected
    assert found.ravel()[TILE] == bool(expected)


def test_further_paths_bring_the_light_of_their_tiles(make):
    """Compare the light of further paths with that of even passes."""
    scene = make.street(6)
    paths = follower(scene, MitsubaRenderer(**SIZE), scene.light_groups())
    judge = judged(paths, 1024, 2).reshape(len(scene.light_groups()), -1)
    tiles = np.arange(5, 384, 40)
    tally = fireflies.Tally.empty(len(judge), len(paths.wavelength_nm), len(tiles))
    positions = np.array([1, 4, 6])
    found = rounds(paths, 11)
    found._follow_further(tally, tiles, positions, 5000)
    assert (np.flatnonzero(tally.paths[0]) == positions).all()
    assert (tally.paths[:, positions] == 5000).all()
    own = tally.mean()[:, 1, positions]
    error = np.sqrt(tally.own_variance()[:, 1, positions] * (1 / 5000 + 1 / 2048))
    known = judge[:, tiles[positions]]
    # five standard errors of both, and a hundredth for the rounding of float32 sums
    assert (np.abs(own - known) <= 5 * error + 0.01 * known).all()
