"""The mean of the rounds of a buffer keeps rare light, whatever later plans follow."""

from types import SimpleNamespace

import numpy as np
import pytest

from isethdr_core.demand import NoiseLimit

pytest.importorskip("mitsuba")

GROUPS = 2
BANDS = np.array([0.2, 0.5])  # radiance of a luminance of 1 cd/m2
TILES = 6


@pytest.fixture(autouse=True)
def llvm():
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


@pytest.fixture
def mean():
    from isethdr_mitsuba.paths.by_need.mean_of_rounds import MeanOfRounds

    return MeanOfRounds.empty(GROUPS, len(BANDS), TILES)


def add(mean, group, tiles, paths, luminance):
    """Add paths with a mean luminance (entry,) to the latest round."""
    from isethdr_mitsuba.paths.by_need.mean_of_rounds import Sums

    paths = np.broadcast_to(np.asarray(paths, float), np.shape(tiles))
    total = paths * luminance
    radiance = (BANDS[:, None] * total).astype(np.float32)
    mean.add(group, paths, Sums(np.asarray(tiles), radiance, np.stack([total] * 3)))


def test_each_round_weighs_as_was_expected_of_it(mean):
    """Weights by hand: 8 of 8 + 2 * 16 for the first round, the rest for the second."""
    every = np.arange(TILES)
    level = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    for group in range(GROUPS):
        add(mean, group, every, 8, level * (group + 1))
    assert mean.mean_radiance()[1, 0] == pytest.approx(BANDS[0] * 2 * level)
    assert (mean.variance_factor() == 1 / 8).all()
    later = np.zeros((GROUPS, TILES))
    later[0, 2:4] = 16
    mean.give_weight(later)
    for tile in (3, 2):  # two launches of one round
        add(mean, 0, [tile], 32, np.array([10.0]))
    # as if the second round were the last
    expected = level.copy()
    expected[2:4] = 0.2 * level[2:4] + 0.8 * 10
    assert mean.mean_xyz()[0, 1] == pytest.approx(expected)
    assert mean.variance_factor()[0, 2] == pytest.approx(0.2**2 / 8 + 0.8**2 / 32)
    mean.give_all_weight()
    assert mean.mean_xyz()[:, 1] == pytest.approx(np.stack([expected, 2 * level]))
    assert mean.mean_radiance()[0] == pytest.approx(BANDS[:, None] * expected, rel=1e-6)
    assert (mean.left == 0).all()


def test_later_paths_bring_the_variance_to_what_is_asked(mean):
    for group in range(GROUPS):
        add(mean, group, np.arange(TILES), 8, np.ones(TILES))
    needed = np.full((GROUPS, TILES), 100.0)
    assert (mean.later_paths(needed) == 92).all(), "paths of equal weight"
    mean.give_weight(mean.later_paths(needed))
    later = mean.later_paths(needed)[0, 0]
    add(mean, 0, [0], later, np.ones(1))
    assert mean.variance_factor()[0, 0] == pytest.approx(1 / 100, rel=1e-9)
    # the first round alone has half of the variance that is asked for: the later paths add as much
    first = mean.square[0, 1]
    add(mean, 0, [1], mean.later_paths(np.full((GROUPS, TILES), 1 / first))[0, 1], np.ones(1))
    assert mean.variance_factor()[0, 1] == pytest.approx(2 * first, rel=1e-9)


def test_finished_tiles_take_more_paths_after_they_are_reopened(mean):
    for group in range(GROUPS):
        add(mean, group, np.arange(TILES), 8, np.ones(TILES))
    mean.give_all_weight()
    more = np.zeros((GROUPS, TILES))
    more[1, 4] = 24
    mean.reopen(more)
    add(mean, 1, [4], 24, np.array([5.0]))
    mean.give_all_weight()
    expected = np.ones((GROUPS, TILES))
    expected[1, 4] = 0.25 * 1 + 0.75 * 5
    assert mean.mean_xyz()[:, 1] == pytest.approx(expected)
    assert mean.variance_factor()[1, 4] == pytest.approx(1 / 32)


def simulated(probability, seed):
    """Return rounds of a simulated rendering, after the first paths.

    1600 tiles of one object have a luminance of 1.2 cd/m2. Of this 0.2 comes by paths of a
    probability, the rest with exponential noise.
    """
    from isethdr_mitsuba.paths.by_need.mean_of_rounds import Sums
    from isethdr_mitsuba.paths.by_need.rounds import Rounds

    rng = np.random.default_rng(seed)

    class Simulated(Rounds):
        def follow(self, buffer, lot):
            tally = self.buffers[buffer]
            batches = np.clip(lot.paths // 8, 2, 8)
            for batch in range(batches.max()):
                on = batch < batches
                tiles = lot.tiles[on]
                paths = lot.paths[on] // batches[on]
                rare = rng.binomial(paths, probability) * 0.2 / probability
                total = np.stack([rare + rng.gamma(paths)] * 3)
                tally.paths[0, tiles] += paths
                tally.batches[0, tiles] += 1
                tally.xyz[0][:, tiles] += total
                tally.squares[0][:, tiles] += total**2 / paths
                tally.light.add(0, paths, Sums(tiles, total[:1].astype(np.float32), total))

    lamps = SimpleNamespace(groups=["lamps"], has_lamps=lambda group: True)
    paths = SimpleNamespace(lamps=lamps, wavelength_nm=np.array([550.0]), all_groups=lambda: 1)
    found = Simulated(paths, np.ones((40, 40), int), 0)
    found.pilot()
    return found


def light(rounds):
    """Return the luminance (tile,) of the mean of both buffers."""
    return sum(t.mean()[0, 1] for t in rounds.buffers) / 2


def limit(noise):
    """Return a limit of all tiles, cd/m2."""
    return NoiseLimit({"lamps": 1.0}, np.full((3, 40, 40), noise))


def rare_share(probability, seed):
    """Return the ratio of the rare light of a rendering to the true one. The cameras allow a noise
    of 0.15.
    """
    found = simulated(probability, seed)
    found.until_done(limit(0.15), 1.0)
    return (light(found).mean() - 1) / 0.2


def test_no_path_influences_its_own_weight(monkeypatch):
    """A bright path of buffer A changes the plans of buffer B and of the tiles around, but not the
    weight of its own round. One factor for all tiles follows from both buffers; it is kept at 1.
    """
    from isethdr_mitsuba.paths.by_need import rounds

    monkeypatch.setattr(rounds, "spread_of_buffers", lambda *_: np.ones((1, 1, 1)))
    tile = 20 * 40 + 20
    left = []
    for bright in (0.0, 1e3):
        found = simulated(1e-3, 3)
        first = found.buffers[0]
        first.xyz[0, :, tile] += bright
        first.squares[0, :, tile] += bright**2 / 4
        first.light.latest_xyz[0, :, tile] += bright
        found.add_needed(limit(0.15), 1.0)
        left.append(np.stack([t.light.left[0] for t in found.buffers]))
    assert left[0][0, tile] == left[1][0, tile]
    assert left[0][1, tile] < left[1][1, tile]
    assert left[0][0, tile + 1] < left[1][0, tile + 1]


def test_rare_light_is_kept_by_plans_that_follow_it():
    """Plans by the other buffer alone, with equal weights of all paths, would lose an eighth."""
    shares = np.array([rare_share(1e-3, seed) for seed in range(12)])
    error = shares.std(ddof=1) / np.sqrt(len(shares))
    assert error < 0.13 / 3, "the test can tell the loss"
    assert shares.mean() == pytest.approx(1, abs=3 * error)


def test_no_tile_gets_more_paths_than_the_largest_number():
    """The limit of the noise asks for 44 paths."""
    found = simulated(1.0, 5)
    found.most = 40
    found.until_done(limit(0.15), 1.0)
    assert max(sum(t.paths for t in found.buffers).ravel()) == 32


def test_a_tighter_limit_reopens_finished_tiles():
    found = simulated(1.0, 5)
    found.until_done(limit(10.0), 1.0)
    assert all((t.paths == 8).all() and (t.light.left == 0).all() for t in found.buffers)
    found.until_done(limit(0.15), 1.0, reopen=True)
    assert all((t.light.left == 0).all() for t in found.buffers)
    # 1 / 0.15^2 = 44 paths are needed; numbers are multiples of 8, and estimates of the variance
    # scatter
    assert 44 < sum(t.paths for t in found.buffers).mean() < 70
    error = light(found) - 1.2
    assert 0.1 < np.sqrt(np.mean(error**2)) < 0.16
    assert abs(error.mean()) < 4 * 0.15 / np.sqrt(1600)
