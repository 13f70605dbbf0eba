"""Lenses: energy, limits, sampling, dark tiles around a lamp, and refusals."""

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, IdealLens, WavefrontLens
from isethdr_optics.psf.kernels import KernelRequest, kernels
from scipy.special import j0, j1

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.physics.resampling.area import resample_mean
from isethdr_core.uncertainty import ledger

LENS = DiffractionLimitedLens(falloff="none")


def mixed(values, pitch_um=2.0, wave=(550.0,), focal_mm=4.0):
    values = np.asarray(values, float)
    values = np.broadcast_to(values, (len(wave), *values.shape[-2:]))
    y, x = (quantities.centres(n, n * pitch_um * 1e-3 / focal_mm) for n in values.shape[-2:])
    return quantities.plane(values, wave, x, y, quantities.RADIANCE)


def point(ny, nx, value=1.0, at=None, background=0.0):
    out = np.full((ny, nx), background)
    out[at or (ny // 2, nx // 2)] = value
    return out


def test_point_spread_at_the_airy_rings():
    psf = LENS.psf([450, 650], pitch_um=0.1, size=256)
    r = np.hypot(psf.x.values[None, :], psf.y.values[:, None]) * 1e6
    for i, wave in enumerate((0.45, 0.65)):
        for zero, want in ((3.8317, 0.8378), (7.0156, 0.9099)):
            # 2e-3: the circle's border in samples of 0.1 um
            assert float(psf.values[i][r <= zero / np.pi * wave * 4].sum()) == pytest.approx(
                want, abs=2e-3
            )
    assert psf.dims == ("wavelength", "y", "x") and np.unravel_index(
        psf.values[0].argmax(), (256, 256)
    ) == (128, 128)


def test_coarse_samples_are_integrals_and_never_sum_above_one():
    fine = LENS.psf([550], 1.0, 255)
    coarse = LENS.psf([550], 5.0, 51)
    assert (fine.attrs["sample"], coarse.attrs["sample"]) == ("point", "integral")
    # both cover the same square; 1 um sampling resolves the cutoff period of 2.2 um
    assert float(coarse.sum()) == pytest.approx(float(fine.sum()), rel=1e-5)
    assert float(LENS.psf([400], 6.0, 64).sum()) < 1


def test_no_aberration_is_diffraction_limited():
    a = WavefrontLens().psf([500], 1.0, 64)
    b = DiffractionLimitedLens().psf([500], 1.0, 64)
    np.testing.assert_array_equal(a, b)
    light = mixed(point(9, 11, 1e6, background=1.0))
    np.testing.assert_array_equal(WavefrontLens()(light), DiffractionLimitedLens()(light))


@pytest.mark.slow
def test_fast_lens_on_coarse_tiles_is_ideal():
    tile_um = 50.0
    blur_um = 0.55
    scene = mixed(np.random.default_rng(0).uniform(1, 2, (12, 14)), pitch_um=tile_um)
    kind = dict(f_number=1.0, falloff="none")
    got = DiffractionLimitedLens(**kind)(scene) / IdealLens(**kind)(scene)
    # A tile keeps 1 - s of its light and exchanges s with tiles that differ by no more than its own
    # value (values are 1 to 2, and 0 outside). s = integral of (1 - MTF) tile^2 sinc^2 sinc^2, and
    # 1 - MTF(f) <= min(1, 4 / pi blur f), which is at most the sum of that bound at |fx| and at
    # |fy|.
    f = (np.arange(4_000_000) + 0.5) * 1e-6 / blur_um
    most = (
        4
        * np.sum(np.minimum(4 / np.pi * blur_um * f, 1) * tile_um * np.sinc(f * tile_um) ** 2)
        * (f[1] - f[0])
    )
    assert np.abs(got - 1).max() < most + 1e-3  # the kernel's middle is exact to 1e-3
    assert most < 0.024 and np.abs(got - 1).max() > 0.1 * most


def test_wavefront_tilt_moves_light_right_and_up_and_defocus_spreads_it():
    psf = WavefrontLens(zernike_um={2: 0.25}).psf([550], 0.5, 64).values[0]
    assert np.unravel_index(psf.argmax(), psf.shape) == (32, 40)  # 4 N c = 4 um to +x
    psf = WavefrontLens(zernike_um={1: 0.25}).psf([550], 0.5, 64).values[0]
    assert np.unravel_index(psf.argmax(), psf.shape) == (24, 32)  # OSA's y points up
    sharp, soft = (
        WavefrontLens(zernike_um={4: c}).psf([550], 0.5, 64).values[0].max() for c in (0.0, 0.05)
    )
    # Marechal's formula
    assert soft / sharp == pytest.approx(np.exp(-((2 * np.pi * 0.05 / 0.55) ** 2)), rel=0.02)


def test_irradiance_conserves_energy_up_to_what_is_stated():
    book = ledger.Ledger()
    with ledger.stage(book, "lens"):
        light = LENS(mixed(point(41, 41, 5e4)))
    outside = book[0].errors[0].value
    share = float(light.sum()) / (5e4 * LENS.throughput_sr())
    # The kernel reaches from one border of the frame to the other, twice as far as from its middle
    # to a border. So a lamp in the middle loses at least the stated share.
    assert 1 - 4 * outside < share <= 1 - outside
    assert 0 < outside < 0.01


def test_uniform_scene_and_attributes():
    light = IdealLens(f_number=2.8, transmittance=0.9, falloff="none")(mixed(np.full((4, 6), 3.0)))
    factor = 0.9 * np.pi / (1 + 4 * 2.8**2)
    np.testing.assert_allclose(light, 3 * factor, rtol=1e-12)
    assert light.attrs["throughput_sr"] == pytest.approx(factor)
    assert light.attrs["field_width"] == pytest.approx(12e-6) and light.x.values[
        -1
    ] == pytest.approx(5e-6)
    quantities.check_irradiance(light)
    assert IdealLens(pupil="aplanatic").throughput_sr() == pytest.approx(np.pi / 64)


def test_kernel_does_not_depend_on_how_finely_the_scene_is_tiled():
    coarse = np.random.default_rng(1).uniform(0, 1, (9, 9)) * 10.0 ** np.random.default_rng(
        2
    ).integers(0, 4, (9, 9))
    fine = np.kron(coarse, np.ones((3, 3)))
    a = LENS(mixed(coarse, 3.0))
    b = LENS(mixed(fine, 1.0))
    mean = resample_mean(b.values, b.x.values, b.y.values, a.x.values, a.y.values, 3e-6, 3e-6)
    # both kernels are exact to 1e-4 (768 pupil samples)
    np.testing.assert_allclose(a, mean, rtol=2e-4)


@pytest.mark.slow
def test_kernel_against_the_airy_pattern_far_out():
    k = kernels(KernelRequest(LENS, (), np.array([550.0]), (4.0, 4.0), (150, 150)))
    y, x = np.indices(k.bands[0].shape) - 150
    r = np.hypot(y, x)
    for low, high in ((20, 45), (45, 70), (70, 100), (100, 140)):
        a, b = (np.pi * q * 4.0 / 2.2 for q in (low, high))
        want = (j0(a) ** 2 + j1(a) ** 2) - (j0(b) ** 2 + j1(b) ** 2)
        ring = (r >= low) & (r < high)
        got = k.bands[0][ring].sum(dtype=float)
        # 5 %: the ring's borders follow whole tiles; sampling error of its sum
        assert got == pytest.approx(want, rel=0.05), (
            low,
            high,
        )


def test_dark_tiles_beside_a_lamp_agree_with_direct_sums():
    scene = mixed(
        point(40, 50, 1e8, (20, 25), background=1.0)
        * np.random.default_rng(3).uniform(0.9, 1.1, (40, 50)),
        3.0,
    )
    light = LENS(scene)
    k = kernels(
        KernelRequest(
            LENS,
            (),
            np.array([550.0]),
            tuple(1e6 * 4e-3 * quantities.tile_pitch(scene, d) for d in ("y", "x")),
            (39, 49),
        )
    ).bands[0]
    x = scene.values[0].astype(np.longdouble) * np.longdouble(LENS.throughput_sr())
    flipped = k[::-1, ::-1].astype(np.longdouble)
    for i, j in ((20, 26), (19, 25), (0, 0), (39, 49), (20, 49), (2, 25)):
        want = np.sum(x * flipped[39 - i : 79 - i, 49 - j : 99 - j])
        assert float(light[0, i, j]) == pytest.approx(float(want), rel=1e-7)
    assert float(light.min()) > 0


def test_linear_and_bands_are_independent():
    rng = np.random.default_rng(4)
    wave = (500.0, 510.0, 520.0)
    a, b = (mixed(rng.uniform(0, 1, (3, 12, 16)), wave=wave) for _ in range(2))
    both = a.copy(data=2 * a.values + b.values)
    # float64 rounding
    np.testing.assert_allclose(LENS(both), 2 * LENS(a) + LENS(b).values, rtol=1e-12)
    a32 = a.astype(np.float32)
    assert LENS(a32).dtype == np.float32


def test_ledger_states_the_convolution_as_it_happened(monkeypatch):
    from isethdr_core.physics.convolution import direct_sums, linear

    values = 10.0 ** np.random.default_rng(5).uniform(0, 12, (40, 50))
    # no transform reaches 1e-14, so many tiles need direct sums
    monkeypatch.setattr(linear, "RELATIVE", 1e-14)
    monkeypatch.setattr(direct_sums, "_few_sources", lambda *a: None)
    books = []
    for products in (4e10, 0):  # direct sums for all such tiles, and for none
        monkeypatch.setattr(direct_sums, "MOST_PRODUCTS", products)
        book = ledger.Ledger()
        with ledger.stage(book, "lens"):
            light = LENS(mixed(values, 3.0))
        books.append(({e.label: e for e in book[0].errors}, light))
    (whole, exact), (cut, rough) = books
    assert not any("too dark" in w for w in whole)
    assert whole["convolution with the kernel"].value < 1e-7
    (note,) = [e for w, e in cut.items() if "too dark" in w]
    assert (
        note.unit == quantities.IRRADIANCE and 0 < float(np.abs(exact - rough).max()) < note.value
    )


def test_cos4_acts_on_the_source():
    x = quantities.centres(21, 1.0)
    scene = quantities.plane(np.ones((1, 21, 21)), [550.0], x, x, quantities.RADIANCE)
    light = IdealLens()(scene)
    np.testing.assert_allclose(
        light.values[0] / light.values[0, 10, 10],
        np.cos(np.arctan(np.hypot(x[None, :], x[:, None]))) ** 4,
        rtol=1e-12,
    )


def test_bad_input_is_refused():
    good = mixed(np.ones((4, 4)))
    for bad in (np.nan, -1.0, np.inf):
        with pytest.raises(UnitError):
            LENS(mixed(point(4, 4, bad)))
    with pytest.raises(UnitError):
        LENS(good.assign_attrs(units="photons"))
    with pytest.raises(ConfigError, match="f_number"):
        DiffractionLimitedLens(f_number=0.4, pupil="aplanatic")
    with pytest.raises(ConfigError, match="transmittance"):
        IdealLens(transmittance=1.2)
    with pytest.raises(ConfigError, match="zernike_um"):
        WavefrontLens(zernike_um={4: 400.0}).psf([550], 1.0, 64)
    with pytest.raises(ConfigError, match="diffraction_limited"):
        IdealLens()(good, [ApertureFlare()])


@pytest.mark.parametrize(
    ("distortion", "said"),
    [
        (
            {"model": "table", "angle_deg": [10, 20], "radius_per_focal_length": [0.17, 0.34]},
            "ends",
        ),
        ({"model": "brown_conrady", "k1": -2.0}, "folds the field over"),
    ],
)
def test_a_distortion_that_does_not_fit_the_field_is_refused_before_any_work(distortion, said):
    with pytest.raises(ConfigError, match=f"lens.distortion .*{said}"):
        IdealLens(distortion=distortion).image_size_m(0.9, 0.5)


def test_a_table_of_wavefronts_that_ends_within_the_field_is_refused_before_any_work():
    lens = WavefrontLens(field_zernike_um={0: {}, 20: {8: 0.1}})
    wide, narrow = (2 * np.tan(np.radians(half)) for half in (22.5, 15.0))
    with pytest.raises(ConfigError, match="ends at 20 degrees, the field reaches 25.4"):
        lens.image_size_m(wide, wide * 9 / 16)
    assert lens.image_size_m(narrow, narrow * 9 / 16) == pytest.approx(
        DiffractionLimitedLens().image_size_m(narrow, narrow * 9 / 16), rel=1e-12
    )
