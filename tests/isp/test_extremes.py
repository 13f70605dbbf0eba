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


@pytest.mark.parametrize("level", [0.0, 1e18])
@pytest.mark.parametrize(("name", "exposure"), pairs_with_slow_ones())
def test_dark_and_full_pictures_are_finite(name, level, exposure):
    place = centres(24, 24 * 6e-6)
    values = np.broadcast_to(level * white("daylight", W)[:, None, None], (len(W), 24, 24)).copy()
    light = plane(
        values,
        W,
        place,
        place,
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=1.0,
        falloff="none",
        field_width=24 * 6e-6,
        field_height=24 * 6e-6,
    )
    captures = hdr.build("sensor", name, exposure_rule=exposure)(light, hdr.generator(seed=1))
    picture = hdr.build("isp", "merge")(captures)
    assert np.isfinite(picture.xyz.values).all() and np.isfinite(picture.variance.values).all()
    assert captures.saturated.values.all() == (level > 0) and picture.valid.values.all() == (
        level == 0
    )
