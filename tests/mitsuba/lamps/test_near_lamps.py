"""Near lamps are sampled one by one, the others by random choice: each lamp counts exactly once."""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.lamps import near_lamps, spatial_sampling
from isethdr_mitsuba.renderer import MitsubaRenderer

from ..paths.test_integrator import compiled


def lists(light, strength):
    """Return slots, chances before, near lamps, and chances after."""
    count = light.shape[1]
    slots = spatial_sampling.slots_of(light, strength)
    chance = spatial_sampling.shares_of(slots, count)
    near = near_lamps.near_list(light.any(1), slots, chance)
    return slots, chance, near, spatial_sampling.shares_of(near.slots, count)


@pytest.mark.parametrize("count", [1, 3, 12, 30])
def test_each_lamp_is_near_or_has_a_chance_no_smaller_than_before(count):
    rng = np.random.default_rng(count)
    light = rng.lognormal(0, 3, (50, count)) * (rng.random((50, count)) < 0.4)
    light[7] = 0.0  # no light is known here, so lamps are chosen by strength
    slots, before, near, after = lists(light, np.ones(count))
    assert near.slots.shape == slots.shape
    for block, (many, lamps) in enumerate(zip(near.length, near.lamps)):
        listed = np.isin(np.arange(count), lamps[:many])
        assert listed.sum() == many <= near_lamps.MOST_NEAR
        # near lamps have more than the one slot that each lamp has, and enough light for a ray
        seen = before[block] > max(1.5 / slots.shape[1], near_lamps.LEAST_SHARE)
        assert many == min(seen.sum() * light[block].any(), near_lamps.MOST_NEAR)
        assert (before[block][listed].min(initial=1) >= before[block][~listed]).all()
        if not listed.all():
            assert (after[block][listed] == 0).all()
            # without near lamps nothing changes; chances are multiples of a slot
            assert (after[block][~listed] >= before[block][~listed] - 1 / slots.shape[1]).all()
            assert (after[block][~listed] > 0).all()


@pytest.mark.slow
def test_light_of_near_lamps_is_that_of_lamps_by_chance(make, monkeypatch):
    """Compare shadow rays to each near lamp with one ray to one of all lamps.

    The light is the same, and the noise is at most 1.2 times as large.
    """
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))
    scene = make.street(8)
    repeats = 8
    settings = MitsubaRenderer(width=24, height=14, step_nm=100.0, max_depth=3)
    groups = scene.light_groups()
    piles = []
    for seen in (near_lamps.SEEN, np.inf):
        monkeypatch.setattr(near_lamps, "SEEN", seen)
        one_pass = compiled(scene, settings, groups)
        found = [np.stack([v for *_, v in one_pass(k, 128)]) for k in range(repeats)]
        # mean over the bands and blocks of 7 x 4 tiles
        pile = np.stack(found).reshape(repeats, len(groups), 4, 2, 7, 6, 4)
        piles.append(pile.mean((2, 4, 6)).reshape(repeats, len(groups), 12))
    near, chance = piles
    for g, group in enumerate(groups):
        a = near[:, g]
        b = chance[:, g]
        if group == "sky":  # without lamps the bits are equal
            assert np.array_equal(a, b)
            continue
        lit = b.mean(0) > 0.01 * b.mean()
        error = np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1)) / repeats)
        z = (a.mean(0) - b.mean(0))[lit] / error[lit]
        # Student's t with at least 7 degrees of freedom (standard deviation 1.2), of at most 12
        # blocks
        assert np.abs(z).max() < 6 and abs(z.mean()) < 4 * 1.2 / np.sqrt(lit.sum())
        # With few lamps, candidates on all of them are nearly as good. The ratio of standard
        # deviations of a dozen blocks, with 7 degrees of freedom each, is known to 8 %.
        level = b.mean(0)[lit]
        relative = [np.mean(light[:, lit].var(0, ddof=1) / level**2) for light in (a, b)]
        assert relative[0] < 1.2**2 * relative[1]
