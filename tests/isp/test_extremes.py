"""Captures that are all dark or all saturated give finite pictures; only saturated ones are
invalid.
"""

import numpy as np
import pytest
from isethdr_isp.spectra import light as white

import isethdr_core as hdr
from isethdr_core.quantities import IRRADIANCE, centres, plane

W = np.arange(400.0, 701.0, 10.0)


def pairs_with_slow_ones():
    """Return each sensor with each exposure rule. All sensors share the code of the rules, so only
    the pairs with `fixed` or with `bayer` are quick tests; the others are slow.
    """
    sensors = ("bayer", "split_pixel", "dual_gain", "staggered", "lofic", "lin_log")
    rules = ("fixed", "centre", "histogram", "highlights")
    return [
        pytest.param(s, r, marks=[pytest.mark.slow] * (s != "bayer" and r != "fixed"))
        for s in sensors
        for r in rules
    ]


def light_on(pixels: int, pitch_m: float, level: float, **falloff):
    """Return uniform daylight on a square of pixels behind a lens of f/4 and 4 mm."""
    place = centres(pixels, pixels * pitch_m)
    spectrum = level * white("daylight", W)[:, None, None]
    return plane(
        np.broadcast_to(spectrum, (len(W), pixels, pixels)).copy(),
        W,
        place,
        place,
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=1.0,
        field_width=pixels * pitch_m,
        field_height=pixels * pitch_m,
        **falloff,
    )


@pytest.mark.parametrize("level", [0.0, 1e18])
@pytest.mark.parametrize(("name", "exposure"), pairs_with_slow_ones())
def test_dark_and_full_pictures_are_finite(name, level, exposure):
    light = light_on(24, 6e-6, level, falloff="none")
    captures = hdr.build("sensor", name, exposure_rule=exposure)(light, hdr.generator(seed=1))
    picture = hdr.build("isp", "merge")(captures)
    assert np.isfinite(picture.xyz.values).all() and np.isfinite(picture.variance.values).all()
    assert captures.saturated.values.all() == (level > 0) and picture.valid.values.all() == (
        level == 0
    )


@pytest.mark.parametrize(
    ("name", "fields", "isp"),
    [
        ("bayer", {}, "linear"),
        ("interleaved", {"cfa": "RGrg/GBgb"}, "merge"),
        ("ideal", {"cfa": "W", "curves": "unit"}, "ideal"),
    ],
)
def test_pixels_without_light_through_the_lens_are_finite_and_not_valid(name, fields, isp):
    # the corner of the sensor is 1.2 degrees off the axis
    table = {"angle_deg": [0.0, 0.7, 0.9, 2.0], "relative": [1.0, 1.0, 0.0, 0.0]}
    light = light_on(40, 3e-6, 1e-3, falloff="table", falloff_table=table)
    sensor = hdr.build("sensor", name, pitch_um=3.0, **fields)
    picture = hdr.build("isp", isp)(sensor(light, hdr.generator(seed=1)))
    corner, centre = (picture["valid"].values[part, part] for part in (slice(2), slice(18, 22)))
    assert not corner.any() and centre.all()
    assert np.isfinite(picture.xyz.values).all() and np.isfinite(picture.variance.values).all()
