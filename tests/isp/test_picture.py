"""Linear and ideal isp: absolute level, linearity, variance, lens falloff, ideal limits and bad
input.
"""

import numpy as np
import pytest
from isethdr_isp import IdealIsp, LinearIsp, MergeIsp
from isethdr_isp.spectra import LIGHTS, light, radiances, reflectances

from isethdr_core.errors import UnitError
from isethdr_core.physics.photometry import xyz, xyz_bar
from isethdr_core.uncertainty import ledger

SHAPE = (12, 16)


@pytest.mark.parametrize("balance", LIGHTS)
@pytest.mark.parametrize("isp", [LinearIsp, MergeIsp])
@pytest.mark.parametrize("filters", ["bayer", "rgbw"])
def test_uniform_grey_keeps_its_absolute_luminance(bench, balance, isp, filters):
    pattern, qe = (bench.BAYER, bench.QE) if filters == "bayer" else (bench.RGBW, bench.QE_W)
    for level in (1e-3, 1e4):
        grey = level * light(balance, bench.WAVELENGTH)
        picture = isp(balance=balance)(
            bench.make(bench.mosaic_of(grey, SHAPE, pattern, qe), pattern=pattern, qe=qe)
        )
        expected = xyz(grey, bench.WAVELENGTH)
        # the matrix is exact for this grey; 1e-9: rounding of signals of 1e-2 DN on a black level
        # of 64 DN
        np.testing.assert_allclose(
            picture.xyz.values, np.broadcast_to(expected, (*SHAPE, 3)), rtol=1e-9
        )
        assert picture.valid.values.all()


def test_grey_in_any_other_light_is_off_by_no_more_than_stated(bench):
    book = ledger.Ledger()
    for name in LIGHTS:
        with ledger.stage(book, "isp") as row:
            picture = LinearIsp()(bench.make(bench.mosaic_of(light(name, bench.WAVELENGTH), SHAPE)))
        [bound] = [e.value for e in row.errors if "grey" in e.label]
        assert 0 < bound < 0.1
        assert abs(picture.xyz.values[5, 5, 1] - 1) <= bound * (1 + 1e-9)


def test_linear_in_the_light(bench):
    rng = np.random.default_rng(0)
    a, b = rng.uniform(0, 1e4, (2, *SHAPE))
    one, two, both = (LinearIsp()(bench.make(m)).xyz.values for m in (a, b, 2 * a + 3 * b))
    # 1e-9: rounding of the sum
    np.testing.assert_allclose(2 * one + 3 * two, both, rtol=0, atol=1e-9 * np.abs(both).max())


def test_negative_electrons_stay_negative(bench):
    captures = bench.make(np.zeros(SHAPE))
    captures["raw"] -= 5.0  # codes below the black level, as read noise makes
    picture = LinearIsp()(captures)
    assert (picture.xyz.values[..., 1] < 0).all() and (picture.variance.values > 0).all()


@pytest.mark.parametrize("isp", [LinearIsp, MergeIsp, IdealIsp])
def test_a_saturated_sample_spoils_the_pixels_it_is_interpolated_into(bench, isp):
    captures = bench.make(np.full(SHAPE, 100.0))
    captures["saturated"][0, 4, 6] = True  # red
    expected = np.ones(SHAPE, bool)
    expected[3:6, 5:8] = False
    np.testing.assert_array_equal(isp()(captures).valid.values, expected)


def test_dark_charge_is_subtracted_and_its_noise_kept(bench):
    # dark charge adds noise; an infinite design SNR disregards noise, so both have the same matrix
    dark, plain = (
        LinearIsp(design_snr=np.inf)(bench.make(np.full(SHAPE, 50.0), dark=d)) for d in (400.0, 0.0)
    )
    np.testing.assert_allclose(dark.xyz.values, plain.xyz.values, rtol=1e-9)
    # variance per sample: 50 + 400 + 2^2 against 50 + 2^2
    np.testing.assert_allclose(dark.variance.values / plain.variance.values, 454 / 54, rtol=1e-9)


def test_reported_variance_is_the_measured_one(bench):
    rng = np.random.default_rng(3)
    shape = (44, 48)  # takes no longer than 12 x 16 pixels
    mean = bench.mosaic_of(2 * light("daylight", bench.WAVELENGTH), shape)  # about 25 e
    pictures = [LinearIsp()(bench.make(mean, rng=rng, step_e=4.0)) for _ in range(20)]
    values = np.stack([p.xyz.values for p in pictures])[:, 2:-2, 2:-2]
    reported = np.mean([p.variance.values for p in pictures], 0)[2:-2, 2:-2]
    # 10 %: one standard error is sqrt(2 / 19) / sqrt(1760 / 9) = 2.3 %, for the mean over 1760
    # pixels of variances from 20 realisations, where 9 neighbours share their error
    np.testing.assert_allclose(values.var(0, ddof=1).mean((0, 1)), reported.mean((0, 1)), rtol=0.1)


def test_lens_falloff_is_undone_and_noise_grows_with_it(bench):
    grey = 100 * light("daylight", bench.WAVELENGTH)
    short = 0.02  # mm: a field of 50 degrees on this small chip
    picture = LinearIsp()(
        bench.make(
            bench.mosaic_of(grey, SHAPE, falloff="cos4", focal=short), falloff="cos4", focal=short
        )
    )
    own = picture.xyz.values[..., 1]
    fall = bench.cos4_falloff(picture.x.values[None], picture.y.values[:, None], short * 1e-3)
    assert fall.min() < 0.2
    # the falloff is undone before the demosaic, so only rounding is left
    np.testing.assert_allclose(own, 100.0, rtol=1e-9)
    sd = np.sqrt(picture.variance.values[..., 1]) / own
    assert sd[0, 0] > 1.5 * sd[6, 8]


def test_mono_needs_no_other_channel(bench):
    pattern = np.array([[0]])
    qe = bench.QE_W[3:]
    grey = 7 * light("daylight", bench.WAVELENGTH)
    for isp in (LinearIsp(), MergeIsp(), IdealIsp()):
        picture = isp(bench.make(bench.mosaic_of(grey, SHAPE, pattern, qe), pattern=pattern, qe=qe))
        np.testing.assert_allclose(picture.xyz.values[..., 1], 7.0, rtol=1e-9)


def test_ideal_isp_is_exact_with_colour_matching_channels(bench):
    # three captures, one per colour matching function; every pixel has all three, so nothing is
    # estimated
    per_photon = xyz_bar(bench.WAVELENGTH) / bench.WAVELENGTH * 200
    specs = [
        {"name": c, "charge": k, "top_e": 1e12, "read": 0.0, "qe": per_photon[k : k + 1]}
        for k, c in enumerate("XYZ")
    ]
    for radiance in radiances(bench.WAVELENGTH)[::17]:
        captures = bench.make(np.ones(SHAPE), specs, pattern=np.array([[0]]), qe=per_photon[:1])
        for k, s in enumerate(specs):
            e = float((bench.electrons_per_radiance(s) @ radiance)[0])
            captures["raw"][k] = (
                captures["black_dn"].values[k] + captures["gain_dn_per_e"].values[k] * e
            )
        picture = IdealIsp()(captures)
        np.testing.assert_allclose(
            picture.xyz.values[3, 3], xyz(radiance, bench.WAVELENGTH), rtol=1e-7
        )


def test_linear_and_merge_reduce_to_ideal_without_noise(bench):
    mosaic = np.random.default_rng(5).uniform(10, 1e4, SHAPE)
    captures = bench.make(mosaic, [{"name": "A", "charge": 0, "top_e": 1e9, "read": 0.0}])
    expected = IdealIsp()(captures)
    for isp in (LinearIsp(design_snr=float("inf")), MergeIsp(design_snr=float("inf"))):
        np.testing.assert_allclose(
            isp(captures).xyz.values, expected.xyz.values, rtol=1e-9, atol=1e-9
        )


def test_white_pixels_are_used_and_lower_the_noise(bench):
    """In low light, an RGBW sensor has less noise in Y than a sensor with blind W pixels."""
    grey = 0.05 * light("daylight", bench.WAVELENGTH)
    rgbw = LinearIsp(design_snr=5.0)(
        bench.make(
            bench.mosaic_of(grey, SHAPE, bench.RGBW, bench.QE_W), pattern=bench.RGBW, qe=bench.QE_W
        )
    )
    blind = bench.QE_W.copy()
    blind[3] *= 1e-9
    rgb = LinearIsp(design_snr=5.0)(
        bench.make(bench.mosaic_of(grey, SHAPE, bench.RGBW, blind), pattern=bench.RGBW, qe=blind)
    )
    assert rgbw.variance.values[..., 1].mean() < 0.85 * rgb.variance.values[..., 1].mean()


def test_reflectances_are_physical():
    r = reflectances(np.arange(380.0, 781.0, 5.0))
    assert r.min() > 0 and r.max() < 1 and len(r) > 50


def test_bad_input_says_what_is_missing(bench):
    good = bench.make(np.ones(SHAPE))
    with pytest.raises(UnitError, match="lack 'gain_dn_per_e'"):
        LinearIsp()(good.drop_vars("gain_dn_per_e"))
    with pytest.raises(UnitError, match="did you mean 'A'|one of: A"):
        LinearIsp(capture="B")(good)
    broken = good.copy(deep=True)
    broken["raw"][0, 0, 0] = np.nan
    with pytest.raises(UnitError, match="NaN"):
        MergeIsp()(broken)
    broken = good.copy(deep=True)
    broken.attrs["falloff"] = "cos5"
    with pytest.raises(UnitError, match="cos5"):
        LinearIsp()(broken)
    del broken.attrs["throughput_sr"]
    with pytest.raises(UnitError, match="throughput_sr"):
        LinearIsp()(broken)
    with pytest.raises(UnitError, match="raw with dims"):
        LinearIsp()(good.transpose("x", "y", ...))
