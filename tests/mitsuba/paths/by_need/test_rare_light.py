"""Rare light: a bright path that only one buffer holds is spread over its object. No light is lost,
and light that both buffers find stays where it is.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

SHAPE = (30, 40)
TILES = SHAPE[0] * SHAPE[1]
BATCHES = 4
PATHS = 8  # per batch
NOISE = 0.5  # of the cameras, cd/m2
SHARE = 0.8  # wanted noise of the renderer, as a share of NOISE
TILE = 15 * 40 + 12
BANDS = np.array([0.2, 0.5, 0.1])  # radiance of a luminance of 1 cd/m2
MOST_RECEIVED = 0.5 * NOISE  # MOST of the module: more light would stay in its tile


@pytest.fixture(autouse=True)
def llvm():
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


@pytest.fixture
def instance():
    """Return two objects: the left and the right half of the picture."""
    return np.tile(np.arange(SHAPE[1]) // 20, (SHAPE[0], 1))


def buffers(rng, level=1.0, spread=0.3):
    """Return two independent buffers of one group with normal noise; `spread` is the standard
    deviation of a batch.
    """
    from isethdr_mitsuba.paths.by_need.tallies import Tally

    found = []
    for _ in range(2):
        batches = level + spread * rng.standard_normal((BATCHES, TILES))
        tally = Tally.empty(1, len(BANDS), TILES)
        tally.paths += PATHS * BATCHES
        tally.batches += BATCHES
        tally.xyz += PATHS * batches.sum(0)
        tally.squares += PATHS * (batches**2).sum(0)
        put(tally, np.arange(TILES), np.full(TILES, PATHS * BATCHES), tally.xyz[0, 1])
        found.append(tally)
    return found


def put(tally, tiles, paths, luminance):
    """Add paths whose luminance has the sum `luminance` (tile,)."""
    from isethdr_mitsuba.paths.by_need.mean_of_rounds import Sums

    radiance = (BANDS[:, None] * luminance).astype(np.float32)
    tally.light.add(0, paths, Sums(tiles, radiance, np.stack([luminance] * 3)))


def add_path(tally, tile, luminance):
    """Add `luminance`, summed over paths, to the light of one batch of a tile."""
    mean = tally.xyz[0, :, tile] / tally.paths[0, tile]
    old = PATHS * mean
    tally.squares[0, :, tile] += ((old + luminance) ** 2 - old**2) / PATHS
    tally.xyz[0, :, tile] += luminance
    put(tally, np.array([tile]), np.array([0]), np.array([float(luminance)]))


def moved(tallies, instance, noise=None):
    from isethdr_mitsuba.paths.by_need.moved_light import CameraNoise, MovedLight
    from isethdr_mitsuba.paths.by_need.rare_light import move_rare_light
    from isethdr_mitsuba.paths.by_need.tallies import Neighbours

    noise = np.full(SHAPE, NOISE) if noise is None else noise
    for tally in tallies:
        tally.light.give_all_weight()
    found = MovedLight(tallies, instance, CameraNoise([1.0], noise, SHARE))
    move_rare_light(found, Neighbours(instance))
    return found


def light(tallies):
    """Return the luminance (tile,) of the mean of both buffers."""
    return sum(t.mean()[0, 1] for t in tallies) / 2


def test_a_rare_path_is_spread_over_its_object_and_no_light_is_lost(instance):
    tallies = buffers(np.random.default_rng(1))
    dark = tallies[1].mean()[0, 1, TILE]
    add_path(tallies[0], TILE, 3000.0)
    before = light(tallies)
    bands = [t.light.mean_radiance().astype(float).sum(2) for t in tallies]
    found = moved(tallies, instance)
    after = light(tallies)
    assert found.tiles == [1]
    # the tile keeps the light of the other buffer and receives its share of its own light
    assert before[TILE] > 40
    assert after[TILE] == pytest.approx(dark, abs=MOST_RECEIVED)
    assert after.sum() == pytest.approx(before.sum(), rel=1e-12)
    for tally, sums in zip(tallies, bands, strict=True):
        # radiance is summed in float32
        radiance = tally.light.mean_radiance()
        assert radiance.astype(float).sum(2) == pytest.approx(sums, rel=1e-5)
        assert radiance[0] == pytest.approx(BANDS[:, None] * tally.mean()[0, 1], rel=1e-4)
    other = instance.ravel() != instance.ravel()[TILE]
    assert (after == before)[other].all()
    given = np.delete(after - before, TILE)
    assert 0 <= given.min()
    assert given.max() <= MOST_RECEIVED
    # the stated noise of a receiving tile is the light that it received
    assert np.sqrt(np.delete(found.variance[0, 1], TILE)) == pytest.approx(given, abs=1e-9)
    assert found.light[0] == pytest.approx((before[TILE] - dark) / before.sum(), rel=1e-9)


def test_normal_noise_is_not_moved(instance):
    # noise of single tiles equals that of the cameras, so that many tiles exceed the wanted noise
    spread = NOISE * np.sqrt(2 * BATCHES)
    tallies = buffers(np.random.default_rng(2), 10.0, spread)
    before = light(tallies)
    found = moved(tallies, instance)
    assert (np.abs(before - 10) > SHARE * NOISE).mean() > 0.3
    # 1 of 1200 tiles is 25 times the rate of normal noise at four standard deviations
    assert found.tiles[0] <= 1


def test_light_that_both_buffers_find_stays(instance):
    tallies = buffers(np.random.default_rng(3), spread=0.1)
    for tally in tallies:
        add_path(tally, TILE, 3000.0)
    before = light(tallies)
    found = moved(tallies, instance)
    assert found.tiles == [0]
    assert (light(tallies) == before).all()


def test_light_below_the_noise_of_the_cameras_stays(instance):
    tallies = buffers(np.random.default_rng(4), spread=0.01)
    add_path(tallies[0], TILE, 3000.0)
    found = moved(tallies, instance, np.full(SHAPE, 100.0))
    assert found.tiles == [0]


def test_light_stays_if_its_object_is_too_small(instance):
    instance.ravel()[TILE] = 7
    tallies = buffers(np.random.default_rng(5))
    add_path(tallies[0], TILE, 3000.0)
    assert moved(tallies, instance).tiles == [0]


def test_light_stays_where_the_cameras_have_no_noise(instance):
    tallies = buffers(np.random.default_rng(9))
    add_path(tallies[0], TILE, 3000.0)
    assert moved(tallies, instance, np.zeros(SHAPE)).tiles == [0]


def test_tiles_that_no_camera_sees_receive_nothing(instance):
    noise = np.full(SHAPE, NOISE)
    noise[:, 10:12] = np.inf
    tallies = buffers(np.random.default_rng(6))
    add_path(tallies[0], TILE, 3000.0)
    before = light(tallies)
    assert moved(tallies, instance, noise).tiles == [1]
    unseen = ~np.isfinite(noise.ravel())
    assert (light(tallies) == before)[unseen].all()


def test_the_mean_light_of_each_tile_stays_and_its_noise_falls(instance):
    # each tile of the left object has a bright path with a probability of 1/1200 in each buffer:
    # about one path per run; more than three at a time would not all be moved
    rng = np.random.default_rng(7)
    left = np.flatnonzero(instance.ravel() == 0)
    runs = 60
    lights = np.empty((2, runs, TILES))
    for k in range(runs):
        tallies = buffers(rng)
        for tally in tallies:
            for tile in left[rng.random(len(left)) < 1 / 1200]:
                add_path(tally, tile, 3000.0)
        lights[0, k] = light(tallies)
        moved(tallies, instance)
        lights[1, k] = light(tallies)
    totals = lights.sum(2)
    assert totals[1] == pytest.approx(totals[0], rel=1e-12)
    rare = 3000 / (BATCHES * PATHS) / 1200
    # quarters of the object: 15 paths each, so that the rare light is known to 1/root(15); three
    # standard deviations
    blocks = lights[1][:, left].reshape(runs, 2, 15, 2, 10)
    quarters = blocks.mean((0, 2, 4))
    assert quarters == pytest.approx(1 + rare, abs=3 * rare / np.sqrt(15))
    # before light is moved, the rare paths alone cause an rms error of single tiles of
    # 46.9 cd/m2 * root(2/1200) = 1.9 cd/m2
    errors = np.sqrt(((lights[:, :, left] - 1 - rare) ** 2).mean((1, 2)))
    assert errors[0] > 1.5
    assert errors[1] < 0.3


def test_no_tile_receives_more_than_half_of_the_noise_of_the_cameras(instance):
    # 30 bright paths on one object: together they would add 30 * 47 / 600 = 2.3 cd/m2 to each tile
    tallies = buffers(np.random.default_rng(8))
    for tile in np.flatnonzero(instance.ravel() == 0)[::20]:
        add_path(tallies[0], tile, 3000.0)
    before = light(tallies)
    found = moved(tallies, instance)
    assert 0 < found.tiles[0] < 30
    assert found.most <= 0.5
    assert (light(tallies) - before).max() <= MOST_RECEIVED + 1e-9


def test_light_is_moved_where_the_darker_buffer_has_many_more_paths(instance):
    # the brighter buffer is 3 cd/m2 above a noise of 2.1 cd/m2, less than four deviations; the
    # darker one then gets a second round with seven times the paths
    for paths, expected in ((7, 1), (1, 0)):
        tallies = buffers(np.random.default_rng(10), 10.0, 3.0)
        dark = tallies[1].mean()[0, 1, TILE]
        above = dark + 3.0 - tallies[0].mean()[0, 1, TILE]
        add_path(tallies[0], TILE, above * BATCHES * PATHS)
        later = np.zeros((1, TILES))
        later[0, TILE] = paths * BATCHES * PATHS
        tallies[1].light.give_weight(later)
        put(tallies[1], np.array([TILE]), later[0, [TILE]], later[0, [TILE]] * dark)
        assert moved(tallies, instance).tiles == [expected]
        assert (light(tallies)[TILE] < dark + 1) == bool(expected)


@pytest.mark.parametrize("kept", [0.0, 1e-43])
def test_the_noise_around_tiles_that_lost_all_light_is_known(instance, kept):
    """The other buffer found no light there, so the mean light of all tiles around is zero, or so
    little that its ratio to the spread exceeds float32. The spread that was assumed for the
    remaining paths stays, and is shared with the tiles around: the sum of squares over all tiles is
    that of the tile, weighted with the batches of the neighbours.
    """
    from isethdr_mitsuba.paths.by_need.moved_light import Stays, take
    from isethdr_mitsuba.paths.by_need.tallies import PRIOR, Neighbours, path_variance

    tallies = buffers(np.random.default_rng(9), 0.0, 0.0)
    add_path(tallies[0], TILE, 3000.0)
    assumed = 70.0
    take(tallies[0], 0, TILE, Stays(kept, np.full(3, assumed)))
    assert sum(t.xyz for t in tallies).max() <= 3001 * kept
    found = path_variance(tallies, Neighbours(instance))[0, 1]
    assert np.isfinite(found).all()
    free = 2 * (BATCHES - 1)
    squares = assumed * (BATCHES - 1)
    lent = squares / (25 * free)  # the tile is one of 25 of its object in its neighbourhood
    alone = np.array([squares + PRIOR * lent, PRIOR * lent, 0.0]) / (free + PRIOR)
    # the tile, a neighbour, and a tile beyond the neighbourhood; sums are in float32
    assert found[[TILE, TILE + 2, TILE + 3]] == pytest.approx(alone, rel=1e-6)
