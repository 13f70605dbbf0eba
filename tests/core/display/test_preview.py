"""The denoising preview keeps means, edges and lamps, and reduces noise. Tiles without noise do not
change, and each light group is denoised by itself.
"""

import numpy as np
import pytest

from isethdr_core.data import quantities
from isethdr_core.display import preview
from isethdr_core.errors import UnitError

SHAPE = (24, 32)
BANDS = [450.0, 550.0, 650.0]


def scene(radiance, noise_share, **labels):
    """Return scene radiance (group, band, y, x) that states the noise of X, Y and Z as a share of
    their values.
    """
    y, x = (quantities.centres(n, 0.01 * n) for n in SHAPE)
    out = quantities.scene_radiance(
        radiance, [f"g{k}" for k in range(len(radiance))], BANDS, x, y, **labels
    )
    out["xyz_noise"] = (
        ("light_group", "xyz_channel", "y", "x"),
        (noise_share * preview.tristimulus(out)).astype(np.float32),
        {"units": "cd m-2"},
    )
    return out


def noisy(mean, share, seed=0):
    """Return noisy radiance (1, band, y, x) with a given mean (y, x).

    All bands of a tile share one random factor, as in path tracing.
    """
    factor = 1 + share * np.random.default_rng(seed).standard_normal(SHAPE)
    return np.broadcast_to(mean * np.maximum(factor, 0), (1, len(BANDS), *SHAPE))


def test_noise_of_an_even_field_falls_by_a_large_factor_and_its_mean_stays():
    before = preview.tristimulus(given := scene(noisy(np.full(SHAPE, 1.0), 0.2), 0.2))
    after = preview.denoised(given)
    spread = [v[0, 1].std() / v[0, 1].mean() for v in (before, after)]
    assert (
        spread[1] < spread[0] / 5
        # a mean of 121 tiles would have 1/11 of the spread; fewer tiles at the borders, and weights
        # that depend on the noise, make the factor smaller
    )
    # the remaining noise is correlated between neighbouring tiles, so that denoising does not make
    # the mean more exact: over 768 tiles it is known to 0.2 / sqrt(768) = 0.7 %, before and after
    assert after.mean() == pytest.approx(before.mean(), rel=0.01)


def test_without_noise_nothing_is_averaged_but_what_is_the_same():
    mean = 10.0 ** np.random.default_rng(1).uniform(-3, 3, SHAPE)
    given = scene(noisy(mean, 0.0), 0.0)
    np.testing.assert_allclose(preview.denoised(given), preview.tristimulus(given), rtol=1e-12)


def test_other_objects_normals_and_distances_are_not_averaged():
    """The two halves differ by less than their noise, so that only labels keep the border sharp."""
    left = np.arange(SHAPE[1]) < SHAPE[1] // 2
    half = np.broadcast_to(left, SHAPE)
    mean = np.where(half, 1.0, 1.3)
    share = 0.5
    normal = np.where(half[..., None], [0.0, 0, 1], [0.0, 1, 0])
    kinds = {
        "instance": {"instance": half.astype(np.uint32)},
        "normal": {"normal": normal},
        "distance": {"distance": np.where(half, 5.0, np.inf)},
    }

    def step(labels):
        look = preview.denoised(scene(noisy(mean, share, 3), share, **labels))[0, 1]
        columns = look.mean(axis=0) / look.mean()
        return columns[SHAPE[1] // 2] - columns[SHAPE[1] // 2 - 1]

    without = step({})
    for name, labels in kinds.items():
        # the step is 0.26 of the mean. A mean over 11 x 6 tiles of one side is known to
        # 0.5 / sqrt(66) = 0.06 of the mean; a mean over 24 rows is known better
        assert step(labels) == pytest.approx(0.26, abs=0.12), name
    assert without < 0.08  # the step is smeared over 10 columns


def test_a_lamp_stays_where_it_is_and_light_is_never_negative():
    mean = np.full(SHAPE, 1e-3)
    mean[10, 12] = 1e5
    given = scene(noisy(mean, 0.0), 0.3)
    given["xyz_noise"][..., 10, 12] = 0  # a lamp that is seen directly has no noise
    before = preview.tristimulus(given)
    after = preview.denoised(given)
    np.testing.assert_allclose(after, before, rtol=1e-9)
    assert preview.denoised(scene(noisy(mean, 0.8), 0.8)).min() >= 0


def test_each_group_is_averaged_by_itself_and_mirrored_light_gives_the_mirror_image():
    one, two = (noisy(np.full(SHAPE, 1.0), s, k) for k, s in ((5, 0.1), (6, 0.4)))
    both = preview.denoised(scene(np.concatenate([one, two]), 0.3))
    np.testing.assert_array_equal(both[0], preview.denoised(scene(one, 0.3))[0])
    np.testing.assert_allclose(
        preview.denoised(scene(two[..., ::-1], 0.3))[0][..., ::-1], both[1], rtol=1e-12
    )


@pytest.mark.parametrize("noise", [None, np.nan])
def test_a_scene_that_does_not_say_its_noise_is_refused(noise):
    given = scene(noisy(np.full(SHAPE, 1.0), 0.1), 0.1)
    given = (
        given.drop_vars("xyz_noise")
        if noise is None
        else given.assign(xyz_noise=given.xyz_noise * noise)
    )
    with pytest.raises(UnitError, match="no 'xyz_noise'.*two passes or more; type samples=8"):
        preview.denoised(given)


def test_a_noisy_bright_tile_does_not_spill_into_quiet_dark_ones():
    mean = np.full(SHAPE, 1.0)
    mean[10, 12] = 100.0
    given = scene(noisy(mean, 0.0), 0.01)
    # noise as large as the value: a path has met a lamp by chance
    given["xyz_noise"][..., 10, 12] *= 100
    before = preview.tristimulus(given)[0, 1]
    after = preview.denoised(given)[0, 1]
    dark = np.ones(SHAPE, bool)
    dark[10, 12] = False
    # all dark tiles are equal, so that only light spilt from the bright tile could change them
    np.testing.assert_allclose(after[dark], before[dark], rtol=1e-6)
    assert after[10, 12] < 0.2 * before[10, 12]
