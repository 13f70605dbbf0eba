"""Imaging with a field-dependent PSF: weights, rotated wavefronts, the limit of a constant PSF,
field points of the grid, energy, symmetry, the stated error.
"""

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, PrescribedLens, WavefrontLens
from isethdr_optics.field import grid, point_choice
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.prescription.prescription import load
from isethdr_optics.prescription.wavefront import zernike_um
from isethdr_optics.pupil import pupil_grid

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.zernike import rotated, zernike
from isethdr_core.uncertainty import ledger

PITCH = 0.0015  # tangent of the field angle per tile: 6 um behind a 4 mm lens
COMA = {0: {}, 8: {8: 0.06, 5: 0.03}}
KEEP = {"falloff": "none", "f_number": 4.0}


def field(lamps, shape=(72, 96), bands=(550.0,)):
    values = np.zeros((len(bands), *shape), np.float32)
    for row, column in lamps:
        values[:, row, column] = 1.0
    x, y = (quantities.centres(n, n * PITCH) for n in shape[::-1])
    return quantities.plane(values, list(bands), x, y, quantities.RADIANCE)


def noted(call):
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        result = call()
    return result, rows[0]


def grid_error(row):
    return next(e.value for e in row.errors if "places of the field" in e.label)


def wave(coefficients, x, y):
    return sum(c * zernike(j, x, y) for j, c in coefficients.items())


def test_turned_coefficients_are_the_turned_wavefront():
    x, y = np.random.default_rng(1).uniform(-0.7, 0.7, (2, 100))
    given = {1: 0.3, 2: 0.1, 3: -0.2, 5: 0.4, 7: 0.1, 8: 0.2, 12: 0.5, 13: -0.3}
    angle = 0.7
    c = np.cos(angle)
    s = np.sin(angle)
    np.testing.assert_allclose(
        wave(rotated(given, angle), x, y), wave(given, c * x + s * y, c * y - s * x), atol=1e-13
    )
    assert rotated({4: 0.2, 12: 0.1}, 1.1) == {4: 0.2, 12: 0.1}


@pytest.mark.parametrize("symmetric", [True, False])
def test_shares_are_a_partition_of_unity(symmetric):
    x = quantities.centres(40, 0.6)
    y = quantities.centres(30, 0.45)
    radius = float(np.hypot(x.max(), y.max()))
    for rings in (1, 2, 3):
        shares = [
            grid.weight(p, radius / rings, x, y) for p in grid.places(rings, radius, symmetric)
        ]
        assert min(s.min() for s in shares) >= 0
        np.testing.assert_allclose(sum(shares), 1.0, atol=1e-12)


@pytest.mark.slow
def test_a_wavefront_that_does_not_vary_gives_the_one_point_spread(monkeypatch):
    # sample small cores as finely as the core of the whole frame
    monkeypatch.setattr(pupil_grid, "FEWEST_SAMPLES", pupil_grid.CORE_SAMPLES)
    scene = field([(5, 90), (36, 48), (60, 10)])
    one, row = noted(lambda: WavefrontLens(zernike_um={4: 0.05, 12: 0.02}, **KEEP)(scene))
    constant = WavefrontLens(
        field_zernike_um={0: {4: 0.05, 12: 0.02}, 30: {4: 0.05, 12: 0.02}}, **KEEP
    )
    same, row_of_constant = noted(lambda: constant(scene))
    np.testing.assert_array_equal(same.values, one.values)
    for left in (row, row_of_constant):
        [bound] = [o.bound for o in left.left_out if "over the field" in o.what]
    monkeypatch.setattr(point_choice, "RINGS", (1,))  # force the field variation in
    forced, varied = noted(lambda: constant(scene))
    # relative error of any tile: 1e-7 for weights and results in float32, 2e-6 for light that
    # crosses the border of the cores
    np.testing.assert_allclose(forced.values, one.values, rtol=bound)
    assert bound == pytest.approx(3e-6)
    assert grid_error(varied) == 0.0


@pytest.mark.slow
def test_point_spreads_that_hardly_vary_are_left_out_within_their_bound(monkeypatch):
    lens = WavefrontLens(field_zernike_um={0: {}, 8: {8: 0.006}}, **KEEP)
    scene = field([(5, 90)])
    one, row = noted(lambda: lens(scene))
    [left] = [o for o in row.left_out if "over the field" in o.what]
    assert 1e-4 < left.bound <= 0.05
    monkeypatch.setattr(point_choice, "RINGS", (2,))
    forced = lens(scene)
    assert 0 < np.abs(forced.values - one.values).sum() <= left.bound * one.values.sum()


@pytest.mark.slow
def test_a_lamp_at_a_place_has_the_point_spread_of_that_place():
    """Image a lamp on the outermost ring with the PSF computed for its own field point.

    The remaining difference comes from the interpolation between two azimuths.
    """
    scene = field([(36, 95)], (73, 96))  # outermost tile on the +x axis: azimuth 0
    lens = WavefrontLens(field_zernike_um=COMA, error_allowed=0.02, **KEEP)
    light, row = noted(lambda: lens(scene))
    angle = float(np.arctan(scene.x[95]))
    own = node_lens(lens, lens.wavefront_at(angle), 0.0)(scene)
    # the ledger states the error of the middle band, as an L1 norm
    assert np.abs(light.values - own.values).sum() < 1.5 * grid_error(row) * own.values.sum()
    wrong = node_lens(lens, lens.wavefront_at(0.0), 0.0)(scene)
    assert np.abs(light.values - wrong.values).sum() > 5 * np.abs(light.values - own.values).sum()


@pytest.mark.slow
def test_the_error_between_places_is_what_the_ledger_says_and_finer_grids_are_better():
    errors = []
    scene = field([(20, 70)])
    u = float(scene.x[70])
    v = float(scene.y[20])
    for allowed in (0.1, 0.02):
        lens = WavefrontLens(field_zernike_um=COMA, error_allowed=allowed, **KEEP)
        light, row = noted(lambda lens=lens: lens(scene))
        own = node_lens(
            lens, lens.wavefront_at(np.arctan(np.hypot(u, v))), float(np.arctan2(-v, u))
        )(scene)
        errors.append(np.abs(light.values - own.values).sum() / own.values.sum())
        # the lamp lies between two rings and between two azimuths: both errors add
        assert errors[-1] < 2 * grid_error(row) <= 2 * allowed
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.slow
def test_the_stated_error_is_that_of_the_worst_band():
    """The same wavefront error in um is more wavelengths in blue light, so blue is the worst."""
    lens = WavefrontLens(field_zernike_um=COMA, error_allowed=0.9, **KEEP)
    stated = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(point_choice, "RINGS", (1,))
        for bands in ((550.0,), (450.0, 550.0, 650.0)):
            patch.setattr(
                "isethdr_optics.field.meridian.references_nm",
                lambda lens, waves, bands=bands: list(bands),
            )
            stated[bands] = grid_error(noted(lambda: lens(field([(36, 48)])))[1])
    assert stated[450.0, 550.0, 650.0] > 1.1 * stated[550.0,]


@pytest.mark.slow
def test_light_is_kept_never_negative_and_linear():
    lens = WavefrontLens(field_zernike_um=COMA, **KEEP)
    lamps = [(36, 48), (30, 66)]
    images = [lens(field([lamp])).values for lamp in lamps]
    sums = [i.sum() for i in images]
    # the share of light that leaves the frame differs between field points by a few 1e-4
    np.testing.assert_allclose(
        sums, WavefrontLens(**KEEP)(field(lamps[:1])).values.sum(), rtol=1e-3
    )
    assert min(i.min() for i in images) > 0
    np.testing.assert_allclose(lens(field(lamps)).values, sum(images), rtol=1e-5)


@pytest.mark.slow
def test_turning_the_field_turns_the_image():
    lens = WavefrontLens(field_zernike_um=COMA, **KEEP)
    right, up = (lens(field([at], (81, 81))).values[0] for at in ((40, 70), (10, 40)))
    np.testing.assert_allclose(np.rot90(right), up, rtol=1e-4, atol=1e-5 * up.max())
    # the coma of a lamp on +x points along x: its image is symmetric in y, but not in x
    np.testing.assert_allclose(right, right[::-1], rtol=1e-4, atol=1e-5 * right.max())
    part = right[:, 60:81]
    assert np.abs(part - part[:, ::-1]).sum() > 0.05 * part.sum()


@pytest.mark.slow
def test_mirrored_places_are_those_computed_one_by_one(monkeypatch):
    lens = WavefrontLens(field_zernike_um=COMA, error_allowed=0.2, **KEEP)
    scene = field([(10, 15), (50, 20), (60, 80)])
    mirrored = lens(scene).values
    monkeypatch.setattr(grid, "is_mirrored", lambda wavefronts: False)
    np.testing.assert_allclose(mirrored, lens(scene).values, rtol=1e-5)


def test_bad_fields_are_refused():
    with pytest.raises(ConfigError, match="rise from 0"):
        WavefrontLens(field_zernike_um={5: {4: 0.1}, 10: {4: 0.2}})
    with pytest.raises(ConfigError, match="error_allowed"):
        WavefrontLens(error_allowed=0.0)
    with pytest.raises(ConfigError, match="ends at 2 degrees"):
        WavefrontLens(field_zernike_um={0: {}, 2: {4: 0.1}})(field([(3, 3)]))


def gradients(coefficients, count=20000):
    """Return the slopes (x, y) of a wavefront, um per pupil radius, by finite differences.

    The points are uniformly distributed over the stop.
    """
    rng = np.random.default_rng(0)
    h = 1e-5
    r = np.sqrt(rng.random(count))
    turn = 2 * np.pi * rng.random(count)
    x = r * np.cos(turn)
    y = r * np.sin(turn)
    return (
        (wave(coefficients, x + a, y + b) - wave(coefficients, x - a, y - b)) / (2 * h)
        for a, b in ((h, 0), (0, h))
    )


@pytest.mark.parametrize(
    ("name", "f_number", "nm"),
    [("singlet", 8.0, 450.0), ("double_gauss", 4.0, 587.56), ("cooke_triplet", 5.6, 587.56)],
)
def test_slopes_of_a_traced_wavefront_land_where_the_rays_do(name, f_number, nm):
    """Compare spot and centroid of independent rays with the slopes of the fitted wavefront.

    The law: transverse aberration = dW / d(direction cosine).
    """
    from isethdr_optics.prescription.exit_pupil import exit_pupil
    from isethdr_optics.prescription.figures import chief_mm

    from isethdr_core.physics.optics import paraxial
    from isethdr_core.physics.optics.ray_trace import collimated, follow, sequential

    lens = load(name).stopped(f_number).scaled(8.0)
    indices = lens.indices(nm)
    pupil_z, radius = paraxial.entrance_pupil(lens.surfaces[:-1], lens.indices(nm))
    front = lens.surfaces[0].z_mm
    for tangent in (0.0, 0.1, 0.2):
        found, left, scale = zernike_um(lens, tangent, nm)
        pupil = exit_pupil(lens, tangent, lens.reference_nm)
        across = np.linspace(-1.4, 1.4, 61) * radius
        x, y = np.meshgrid(across, across)
        rays = follow(
            lens.surfaces,
            indices,
            sequential(len(lens.surfaces)),
            collimated(x + (front - pupil_z) * tangent, y, front, tangent, 0.0),
            keep_hits=True,
        )
        inside = np.hypot(*rays.hits_mm[lens.stop]) <= lens.surfaces[lens.stop].semi_diameter_mm
        inside &= np.isfinite(rays.position_mm[0])
        spot = 1e3 * rays.position_mm[:2, inside]
        sx, sy = (
            -g / (scale * radius)
            for g, radius in zip(gradients(found), (pupil.meridional, pupil.sagittal))
        )
        # 2 %: the slopes are at points uniform over the exit pupil, the rays are uniform over the
        # entrance pupil
        assert np.hypot(sx.std(), sy.std()) == pytest.approx(np.hypot(*spot.std(axis=1)), rel=0.02)
        centroid = float(spot[0].mean() - 1e3 * chief_mm(lens, tangent, nm)[0])
        assert sx.mean() == pytest.approx(centroid, abs=0.02 * spot.std() + 0.2 * abs(centroid))
        assert left < 1e-3


@pytest.mark.slow
def test_the_lens_of_a_prescription_images_with_its_own_wavefronts():
    same = dict(
        f_number=4.0, focal_length_mm=8.0, distortion="none", falloff="none", lateral_colour="none"
    )
    lens = PrescribedLens(error_allowed=0.2, **same)
    flat = PrescribedLens(wavefront="none", **same)
    scene = field([(36, 48)], (73, 97))
    own, row = noted(lambda: lens(scene))
    perfect = flat(scene)
    assert own.values.max() < perfect.values.max()  # aberrations lower the peak
    assert own.values.sum() == pytest.approx(perfect.values.sum(), rel=2e-3)  # but keep the sum
    axis = node_lens(lens, lens.wavefront_at(0.0), 0.0, 0.0)(scene)
    ratio = lens.gains_sr([550.0])[0] / axis.throughput_sr  # gain of the traced beam
    np.testing.assert_allclose(own.values, axis.values * ratio, rtol=1e-4)
    assert any("between traced wavelengths" in e.label for e in row.errors)
    traced_f_number = 4.0 / lens.exit_pupil_at(0.0)[0]
    reference = WavefrontLens(
        f_number=traced_f_number, focal_length_mm=8.0, zernike_um=lens.wavefront_at(0.0)
    )
    sharp, want = (one.psf(587.56, size=32).values for one in (lens, reference))
    np.testing.assert_allclose(sharp, want, atol=1e-3 * want.max())  # interpolated wavelengths


def test_a_stop_that_off_axis_rays_cannot_fill_is_refused():
    with pytest.raises(ConfigError, match="rays"):
        zernike_um(load("double_gauss").stopped(3.0), float(np.tan(np.radians(40.0))), 587.56)


@pytest.mark.slow
def test_flares_stay_where_they_are_in_the_pupil():
    from isethdr_optics import ApertureFlare

    lens = WavefrontLens(field_zernike_um=COMA, error_allowed=0.2, **KEEP)
    scene = field([(36, 20)])
    dirt = [ApertureFlare(blades=6, seed=1)]
    dusty = lens(scene, dirt)
    clean = lens(scene)
    bare = DiffractionLimitedLens(**KEEP)
    loss = float(bare(scene, dirt).sum() / bare(scene).sum())
    assert float(dusty.sum() / clean.sum()) == pytest.approx(loss, rel=2e-3)
