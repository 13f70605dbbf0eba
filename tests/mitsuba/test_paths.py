"""Sampling and sharing of the paths of a pass: the light is the same for any number of lanes and
shared rays, and the wavelengths cover each band evenly.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.renderer import MitsubaRenderer

from .paths.test_integrator import compiled, sphere


@pytest.fixture(autouse=True)
def llvm():
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def picture(one_pass, groups, bands, seed, samples, wanted=None):
    """Return (group, band, tile) of one pass."""
    out = np.zeros((groups, bands), object)
    for g, band, values in one_pass(seed, samples, wanted):
        out[g, band] = values
    return out


@pytest.mark.parametrize("samples", [1, 7, 130, 259, 1000])
def test_every_path_counts_once(make, samples):
    """Under a uniform sky a white ball has the radiance of the sky, in every path.

    So no path is lost or counted twice, however paths share rays and lanes.
    """
    sky = make.spectrum((390.0, 740.0), (1.0, 1.0))
    white = make.material("white", reflectance=make.flat(1.0))
    mesh = sphere(12, False)
    ball = make.part((mesh[0] * 0.5 + [4.0, 0, 0], mesh[1]), "white")
    one_pass = compiled(
        make.describe([("ball", "chart", (ball,), make.pose())], sky=sky, materials=[white]),
        MitsubaRenderer(width=7, height=5, step_nm=100.0),
        ["sky"],
    )
    for _, _, values in one_pass(3, samples, None):
        np.testing.assert_allclose(values, 1.0, rtol=2e-5)  # float32 sums of 1000 paths


def test_a_coloured_ball_below_a_coloured_sky(make):
    """Compare with the mean over a band of sky times reflectance, for a convex body.

    Such a body receives light from the sky only. The product of the separate means would be wrong,
    since both spectra have slopes.
    """
    sky = make.spectrum((345.0, 445.0, 545.0, 645.0, 745.0), (0.1, 1.0, 0.2, 0.9, 0.3))
    colour = make.spectrum((345.0, 400.0, 500.0, 610.0, 745.0), (0.9, 0.1, 0.8, 0.2, 1.0))
    mesh = sphere(12, False)
    ball = make.part((mesh[0] * 2 + [7.0, 0, 0], mesh[1]), "coloured")
    # tables begin at 360 nm
    settings = MitsubaRenderer(width=6, height=6, first_nm=420.0, last_nm=720.0, step_nm=100.0)
    scene = make.describe(
        [("ball", "chart", (ball,), make.pose())],
        sky=sky,
        materials=[make.material("coloured", reflectance=colour)],
    )
    one_pass = compiled(scene, settings, ["sky"])
    passes = 6
    found = np.mean([[v for _, _, v in one_pass(k, 1000, None)] for k in range(passes)], 0)
    fine = np.linspace(-50, 50, 40_001)
    truth = np.array(
        [np.mean(sky.at(nm + fine) * colour.at(nm + fine)) for nm in settings.bands_nm()]
    )
    apart = np.array(
        [np.mean(sky.at(nm + fine)) * np.mean(colour.at(nm + fine)) for nm in settings.bands_nm()]
    )
    # 2e-4: 200 wavelengths per band, each sampled 30 +- 1 times per tile, in 36 tiles; the ball
    # fills the picture
    np.testing.assert_allclose(found.mean(1), truth, rtol=2e-4)
    assert np.abs(apart / truth - 1).max() > 0.05


@pytest.mark.slow
def test_lanes_and_shared_rays_give_the_light_of_paths_alone(make, monkeypatch):
    """Compare 16 lanes per tile and 4 paths per camera ray with one path at a time, each with its
    own camera ray.
    """
    from isethdr_mitsuba.paths import work_items

    scene = make.street(8)
    settings = MitsubaRenderer(width=24, height=14, step_nm=100.0, max_depth=3)
    repeats = 8
    one_pass = compiled(scene, settings, scene.light_groups())
    piles = []
    assert work_items.lanes_and_shares(512) == (16, 4)
    for way in (work_items.lanes_and_shares, lambda samples: (1, 1)):
        monkeypatch.setattr(work_items, "lanes_and_shares", way)
        pile = np.stack(
            [
                np.stack([v for _, _, v in one_pass(len(piles) * 100 + k, 512)])
                for k in range(repeats)
            ]
        )
        # light of blocks of 7 x 4 tiles
        piles.append(
            pile.reshape(repeats, 4, 4, 2, 7, 6, 4).mean((2, 4, 6)).reshape(repeats, 4, 12)
        )
    a, b = piles
    error = np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1)) / repeats)
    lit = a.mean(0) > 0.01 * a.mean((0, 2))[:, None]
    # 1e-5: float32 sums
    z = (a.mean(0) - b.mean(0))[lit] / np.maximum(error, 1e-5 * a.mean(0))[lit]
    # Student's t with 14 degrees of freedom (standard deviation 1.08), of 35 blocks: no block is
    # beyond 5, and their mean shows no bias
    assert lit.sum() > 30 and np.abs(z).max() < 5 and abs(z.mean()) < 4 / np.sqrt(len(z))


@pytest.mark.slow
@pytest.mark.parametrize("samples", [5, 300])
def test_a_group_alone_is_the_same_with_lanes_and_shared_rays(make, samples):
    scene = make.street(6)
    settings = MitsubaRenderer(width=12, height=7, step_nm=100.0)
    groups = scene.light_groups()
    whole = picture(compiled(scene, settings, groups), 4, 4, 9, samples)
    some = picture(compiled(scene, settings, groups), 4, 4, 9, samples, [1, 3])
    for g, name in enumerate(groups):
        alone = picture(compiled(scene, settings, [name]), 1, 4, 9, samples)
        for band in range(4):
            assert np.array_equal(alone[0, band], whole[g, band]) and whole[g, band].any()
            assert g not in (1, 3) or np.array_equal(some[g, band], whole[g, band])


@pytest.mark.parametrize("samples", [64, 512])
def test_first_directions_are_spread_evenly(make, samples):
    """A black wall hides half of the sky from a wall at a right angle to it.

    Half of the paths find the sky. With independent directions, the number of these paths would
    have the variance of coin tosses.
    """
    behind = lambda mesh: (mesh[0], mesh[1][:, ::-1])
    wall = make.part(behind(make.quad(9.0, 9.0, 5.0)))
    black = make.quad(1e4, 1e4)
    side = make.part((black[0][:, [1, 0, 2]] + [5.0 - 1e4, -6.0, 0], black[1]), "black")
    scene = make.describe(
        [("wall", "wall", (wall,), make.pose()), ("side", "wall", (side,), make.pose())],
        sky=make.flat(1.0),
    )
    one_pass = compiled(
        scene, MitsubaRenderer(width=8, height=8, step_nm=300.0, last_nm=400.0), ["sky"]
    )
    passes = 12
    found = np.stack([next(v for _, _, v in one_pass(k, samples, None)) for k in range(passes)])
    # standard deviation for coin tosses: the light of a path is 0.5 or 0, with a mean of 0.25
    coins = 0.25 / np.sqrt(samples)
    assert found.mean() == pytest.approx(0.25, abs=5 * coins / np.sqrt(found.size))
    # 768 numbers determine a variance to 5 %; measured: 0.03 and 0.005 of that of coin tosses
    assert found.var() < 0.1 * coins**2


def test_all_places_together_are_the_mean_of_a_band():
    """The mean over all wavelengths of a band is its integral by the trapezoid rule, to rounding.

    The tables are linear between whole nanometres, and bands begin at whole or half nanometres.
    """
    from isethdr_mitsuba.paths.spectra import SPECTRUM_NM, BandTable

    rows = np.random.default_rng(1).random((3, len(SPECTRUM_NM)))
    for step, centres in (
        (10.0, [400.0, 550.0, 700.0, 820.0, 365.0]),
        (5.0, [502.5, 640.0]),
        (1.0, [555.0]),
        (150.0, [475.0]),
    ):
        # steps of 1/4 nm: the trapezoid rule is exact for a function that is linear between half
        # nanometres
        fine = np.linspace(-step / 2, step / 2, int(4 * step) + 1)
        truth = np.stack(
            [
                [
                    np.trapezoid(np.interp(nm + fine, SPECTRUM_NM, row), fine) / step
                    for nm in centres
                ]
                for row in rows
            ]
        )
        for u in (0.0, 0.37, 0.92):
            found = BandTable(rows, centres, step).at(u)
            np.testing.assert_allclose(found.mean(0)[:3, : len(centres)], truth, rtol=1e-12)
            np.testing.assert_allclose(
                found[:, 3], found[:, 2].mean(0)[None].repeat(len(found), 0), rtol=1e-15
            )
            assert found.shape[2] % 4 == 0 and np.array_equal(
                found[..., len(centres) - 1 :].min(-1), found[..., len(centres) - 1 :].max(-1)
            )


def test_bands_that_begin_anywhere_are_right_on_average():
    from isethdr_mitsuba.paths.spectra import SPECTRUM_NM, BandTable

    row = 1 + np.sin(SPECTRUM_NM)
    table = BandTable([row], [503.21], 7.3)
    fine = np.linspace(-3.65, 3.65, 200_001)
    mean = np.mean([table.at((k + 0.5) / 64).mean(0)[0, 0] for k in range(64)])
    # 1e-5: 64 x 30 midpoints over 7.3 nm of linear pieces err by 1 / (24 x 1920^2) of the change of
    # slope; the dense sum errs, too
    assert mean == pytest.approx(np.interp(503.21 + fine, SPECTRUM_NM, row).mean(), rel=1e-5)


def test_tiles_have_offsets_of_their_own():
    """Tiles have independent random offsets, so that neighbours do not use the same wavelengths.

    The mean over many tiles varies between passes as the mean of independent numbers does.
    """
    import mitsuba as mi
    from isethdr_mitsuba.paths.camera_rays import offsets

    tiles = 512
    passes = 400
    seed, tile = np.meshgrid(
        np.random.default_rng(4).integers(2**32, size=passes, dtype=np.uint32),
        np.arange(tiles, dtype=np.uint32),
        indexing="ij",
    )
    point, along, way, _ = offsets(mi.UInt32(seed.ravel()), mi.UInt32(tile.ravel()))
    means = np.stack(
        [
            np.array(v, float).reshape(passes, tiles).mean(1) / 2.0**32
            for v in (point.x, point.y, along, way.x, way.y)
        ],
        1,
    )
    # Uniform numbers have a variance of 1 / 12. The variance of 400 means is known to 7 %; five
    # times that is allowed. The mean of all is allowed 5 standard errors.
    np.testing.assert_allclose(means.var(0, ddof=1) * 12 * tiles, 1, atol=0.35)
    np.testing.assert_allclose(means.mean(0), 0.5, atol=5 / np.sqrt(12 * tiles * passes))
