"""Pixels of nonlinear response: the table of the captures gives level and variance back over the
whole range.
"""

import numpy as np
import pytest
from isethdr_isp.readout.captures_check import check_captures
from isethdr_isp.readout.electrons import readouts
from isethdr_isp.spectra import light as white

import isethdr_core as hdr
from isethdr_core.errors import UnitError
from isethdr_core.quantities import IRRADIANCE, centres, plane

W = np.arange(400.0, 701.0, 10.0)
THROUGHPUT = np.pi / 65
EXACT = {"cfa": "W", "prnu": 0.0, "dark_spread": 0.0, "column_e": 0.0}
SIZE = 120


def irradiance(level):
    """Return the irradiance of a uniform daylight grey of `level` cd/m2, one tile per pixel."""
    place = centres(SIZE, SIZE * 3.75e-6)
    values = np.broadcast_to(
        level * THROUGHPUT * white("daylight", W)[:, None, None], (len(W), SIZE, SIZE)
    )
    return plane(
        values.copy(),
        W,
        place,
        place,
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=THROUGHPUT,
        falloff="none",
        field_width=SIZE * 3.75e-6,
        field_height=SIZE * 3.75e-6,
    )


def shot(electrons, **fields):
    """Return (captures, cd/m2) of a grey that gives `electrons` per pixel."""
    per_cd = readouts(
        hdr.build("sensor", "lin_log", noise=False, **EXACT)(irradiance(1.0), None),
        white("daylight", W),
    )[0].sensitivity[0]
    level = electrons / per_cd
    return hdr.build("sensor", "lin_log", **EXACT, **fields)(
        irradiance(level), hdr.generator(seed=5)
    ), level


@pytest.mark.slow
@pytest.mark.parametrize("isp", ["linear", "merge", "ideal"])
@pytest.mark.parametrize("electrons", [1.0, 30.0, 1e3, 1.5e4, 1.9e4, 2.1e4, 2.2e4, 1e5, 1e6, 1e8])
def test_level_and_variance_of_draws(isp, electrons):
    captures, level = shot(electrons)
    picture = hdr.build("isp", isp)(captures)
    y = picture.xyz.values[..., 1]
    variance = picture.variance.values[..., 1]
    assert picture.valid.values.all()
    # the table has no bias, except 0.04 % where it bends within one standard deviation of the
    # noise; there readings state their variance to 5 %
    bend = 2.03e4 < electrons < 2.4e4
    bent = electrons > 1.8e4
    assert abs(y.mean() / level - 1) < 4 * y.std() / level / SIZE + (
        4e-4 if bend else 1e-4 if bent else 0.0
    )
    # 4 standard errors of a variance over 14 400 pixels: 1.2 % each, and 3 % at the bend, where the
    # distribution has a long tail
    assert variance.mean() / y.var() == pytest.approx(1, abs=0.05 + 0.09 if bend else 0.05)


def test_without_noise_it_is_exact_to_half_a_code():
    for electrons in (1.0, 1e3, 1e5, 1e8):
        captures, level = shot(electrons, noise=False)
        found = hdr.build("isp", "linear")(captures).xyz.values[..., 1].mean() / level
        # half a code, in electrons; beyond the knee, 391 electrons are a factor e of the light
        half_e = 0.5 * 25455 / 4031
        assert abs(found - 1) < 1.02 * (half_e / electrons if electrons < 1.8e4 else half_e / 391)


def test_linear_part_reads_as_the_bayer_sensor_does():
    light = irradiance(30.0)
    ours, bayer = (
        hdr.build("sensor", name, **EXACT)(light, hdr.generator(seed=5))
        for name in ("lin_log", "bayer")
    )
    ours, bayer = (readouts(c, white("daylight", W))[0] for c in (ours, bayer))
    # 1e-9 e: rounding of the interpolation in a table of up to about 1e4 e
    np.testing.assert_allclose(ours.charge_e, bayer.charge_e, atol=1e-9)
    np.testing.assert_allclose(ours.variance_e2(), bayer.variance_e2(), rtol=1e-9)


def test_saturated_only_where_the_table_ends():
    captures, _ = shot(1e8)
    assert (
        captures.saturated.values.all() and hdr.build("isp", "merge")(captures).valid.values.all()
    )
    captures, _ = shot(1e14)
    assert not hdr.build("isp", "merge")(captures).valid.values.any()


@pytest.mark.parametrize("bad", ["part", "falling"])
def test_a_table_that_cannot_be_followed_is_refused(bad):
    captures, _ = shot(1.0, noise=False)
    if bad == "part":
        captures = captures.drop_vars("response_e")
    else:
        captures["response_e"] = captures.response_e[:, ::-1]
    with pytest.raises(UnitError, match="alone" if bad == "part" else "rise"):
        check_captures(captures)


def test_merge_folds_a_bent_capture_with_a_longer_linear_one():
    """The captures are a nonlinear one and a linear one of ten times its exposure. Each level comes
    from the capture that can measure it.
    """
    import xarray as xr

    for electrons in (1e3, 1e5, 1e7):
        bent, level = shot(electrons)
        linear = hdr.build("sensor", "single", exposure_s=0.16, **EXACT)(
            irradiance(level), hdr.generator(seed=6)
        )
        names = ("response_dn", "response_e", "response_variance_e2")
        padding = {name: (bent[name].dims, np.full(bent[name].shape, np.nan)) for name in names}
        linear = linear.assign(padding).assign_coords(capture=["long"])
        linear["charge"] = linear.charge + 1
        both = xr.concat([linear, bent], "capture", data_vars="minimal")
        picture = hdr.build("isp", "merge")(both)
        y = picture.xyz.values[..., 1]
        assert picture.valid.values.all()
        # 4 standard errors and the curvature of the table
        assert abs(y.mean() / level - 1) < 4 * y.std() / level / SIZE + (
            2e-3 if electrons > 1e4 else 0.0
        )
        assert picture.variance.values[..., 1].mean() / y.var() == pytest.approx(1.0, abs=0.05)
        assert np.all(picture.source.values == (0 if electrons < 1e4 else 1))
