"""Bad input: captures that cannot be read give one clear error; dark, saturated and tiny captures
give a right picture.
"""

import numpy as np
import pytest
from isethdr_isp import IdealIsp, LinearIsp, MergeIsp
from isethdr_isp.spectra import light

from isethdr_core.errors import UnitError
from isethdr_core.truth import variance_known

MONO = np.array([[0]])
EVERY = pytest.mark.parametrize(
    "isp",
    [
        IdealIsp(),
        LinearIsp(),
        MergeIsp(),
        LinearIsp(demosaic="guided"),
        LinearIsp(demosaic="learned"),
        MergeIsp(demosaic="learned", denoise="nl_means"),
    ],
    ids=str,
)


def replaced(captures, name, value):
    """Return captures with `value` in the first entry of the variable `name`."""
    out = captures.copy(deep=True)
    values = out[name].values.astype(float)
    values.flat[0] = value
    out[name] = (out[name].dims, values)
    return out


@EVERY
@pytest.mark.parametrize(
    "name, value, said",
    [
        ("gain_dn_per_e", 0.0, "gain_dn_per_e"),
        ("gain_dn_per_e", -1.0, "gain_dn_per_e"),
        ("gain_dn_per_e", np.nan, "gain_dn_per_e"),
        ("gain_dn_per_e", np.inf, "gain_dn_per_e"),
        ("exposure_s", np.inf, "exposure_s"),
        ("area_m2", 0.0, "area_m2"),
        ("black_dn", np.nan, "top above the black level"),
        ("black_dn", -np.inf, "finite"),
        ("top_dn", 1.0, "top above the black level"),
        ("read_noise_e", -1.0, "read_noise_e"),
        ("quantum_efficiency", np.nan, "quantum_efficiency"),
        ("quantum_efficiency", -0.1, "quantum_efficiency"),
        ("quantum_efficiency", np.inf, "quantum_efficiency"),
        ("raw", np.inf, "finite DN"),
    ],
)
def test_figures_that_cannot_be_are_named(bench, isp, name, value, said):
    with pytest.raises(UnitError, match=said):
        isp(replaced(bench.make(np.full((16, 16), 50.0)), name, value))


@EVERY
@pytest.mark.parametrize("name", ["throughput_sr", "focal_length_mm"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_attributes_that_cannot_be_are_named(bench, isp, name, value):
    captures = bench.make(np.full((16, 16), 50.0))
    captures.attrs[name] = value
    with pytest.raises(UnitError, match=f"{name} = .*expected"):
        isp(captures)


@EVERY
def test_shapes_that_cannot_be_are_named(bench, isp):
    good = bench.make(np.full((16, 16), 50.0))
    with pytest.raises(UnitError, match="raw with dims"):
        isp(good.transpose("x", "y", ...))
    with pytest.raises(UnitError, match="filter with dims"):
        isp(good.assign(filter=(("y",), good["filter"].values[:, 0])))
    with pytest.raises(UnitError, match="empty"):
        isp(good.isel(y=[]))
    with pytest.raises(UnitError, match="'raw'.*what a sensor returns"):
        isp(np.zeros((4, 4)))
    holed = good.copy(deep=True)
    holed["filter"] = (("y", "x"), np.random.default_rng(0).integers(0, 3, (16, 16)))
    with pytest.raises(UnitError, match="does not repeat|no learned filters"):
        isp(holed)


@EVERY
def test_a_single_pixel_is_an_error_under_a_filter_array_that_says_so(bench, isp):
    with pytest.raises(
        UnitError,
        match="the filter array samples only one|not sampled in the filter array|smaller than",
    ):
        isp(bench.make(np.full((1, 1), 50.0)))


@EVERY
@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (3, 1)])
def test_a_single_pixel_without_a_filter_array_is_right(bench, isp, shape):
    grey = 7 * light("daylight", bench.WAVELENGTH)
    picture = isp(
        bench.make(
            bench.mosaic_of(grey, shape, MONO, bench.QE_W[3:]), pattern=MONO, qe=bench.QE_W[3:]
        )
    )
    # one channel: exact for a grey in the balance light
    np.testing.assert_allclose(picture.xyz.values[..., 1], 7.0, rtol=1e-9)
    assert picture.xyz.shape == (*shape, 3) and picture.valid.values.all()
    assert not variance_known(picture) or picture.variance.values.min() > 0


@EVERY
def test_all_full_is_finite_and_nowhere_valid(bench, isp):
    captures = bench.make(np.full((24, 24), 5e9))
    picture = isp(captures)
    assert captures.saturated.values.all() and not picture.valid.values.any()
    assert np.isfinite(picture.xyz.values).all()
    assert not variance_known(picture) or np.isfinite(picture.variance.values).all()


@EVERY
def test_all_dark_has_the_mean_0_and_is_valid(bench, isp):
    picture = isp(bench.make(np.zeros((48, 48)), rng=np.random.default_rng(0)))
    y = picture.xyz.values[..., 1]
    variance = picture.variance.values[..., 1]
    # 4 standard errors: after learned demosaic and denoising, about 20 to 60 of the 2304 pixels are
    # independent
    assert abs(y.mean()) < 4 * y.std() / np.sqrt(20) and y.min() < 0 and picture.valid.values.all()
    assert not variance_known(picture) or variance.min() > 0
    exact = isp(
        bench.make(np.zeros((24, 24)), [{"name": "A", "charge": 0, "top_e": 1e9, "read": 0.0}])
    )
    np.testing.assert_array_equal(exact.xyz.values, 0.0)
    if variance_known(exact):
        # a reading without noise has a variance of 1e-12 e2, so that the isp can divide by it
        np.testing.assert_allclose(exact.variance.values, 0.0, atol=1e-12)


@EVERY
def test_infrared_alone_has_no_luminance(bench, isp):
    captures = bench.make(np.full((16, 16), 50.0))
    infrared = captures.assign_coords(wavelength=captures.wavelength.values + 450.0)
    with pytest.raises(UnitError, match="850 to 1150 nm hold no visible light"):
        isp(infrared)
