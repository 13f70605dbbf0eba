"""Shading: a uniform scene through lenses of every kind of relative illumination comes back flat
and at its own level. The isp finds the illumination in the attributes of the light.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_isp.readout.electrons import falloff
from isethdr_isp.spectra import light as white

import isethdr_core as hdr
from isethdr_core.demand import Demand
from isethdr_core.quantities import RADIANCE, centres, plane

W = np.arange(400.0, 701.0, 100.0)
# a field of 20 degrees to the side and 24 degrees to the corner
COLUMNS = 60
ROWS = 44
TILE = 0.012
BARREL = {"model": "brown_conrady", "k1": -0.2}
FISHEYE = {"model": "kannala_brandt", "k1": 0.02}
TABLE = {0: 1.0, 10: 0.9, 20: 0.6, 40: 0.3}
LENSES = {
    "none": ("ideal", {"falloff": "none"}),
    "cos4": ("ideal", {}),
    "cos4, barrel": ("ideal", {"distortion": BARREL}),
    "cos4, fisheye": ("ideal", {"distortion": FISHEYE}),
    "table": ("ideal", {"falloff": TABLE}),
    "table, barrel": ("ideal", {"falloff": TABLE, "distortion": BARREL}),
    "traced": ("prescription", {"wavefront": "none", "lateral_colour": "none"}),
    "traced, lateral colour": ("prescription", {"wavefront": "none"}),
    "prescription, table": (
        "prescription",
        {"wavefront": "none", "lateral_colour": "none", "falloff": TABLE},
    ),
}
# Largest relative error for each lens; 1e-3 for those not listed. It comes from float32; with
# distortion, from tiles that straddle the curve, as the lens states; for traced lenses, from
# diffraction into the dark beyond the scene, 0.1 % eight tiles inside its border; with lateral
# colour, from a magnification that depends on wavelength, as the ledger states.
WORST = {
    "none": 1e-6,
    "cos4": 1e-6,
    "table": 1e-6,
    "traced": 2.5e-3,
    "traced, lateral colour": 4e-3,
    "prescription, table": 2.5e-3,
}
INNER = slice(8, -8)
SLOW = ("traced", "prescription")


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow) if n.startswith(SLOW) else n for n in LENSES],
)
def test_a_uniform_scene_comes_back_flat(name):
    kind, fields = LENSES[name]
    lens = hdr.build("lens", kind, focal_length_mm=4.0, f_number=4.0, **fields)
    level = np.broadcast_to(
        100 * white("daylight", W)[:, None, None], (len(W), ROWS, COLUMNS)
    ).copy()
    mixed = plane(level, W, centres(COLUMNS, COLUMNS * TILE), centres(ROWS, ROWS * TILE), RADIANCE)
    sensor = hdr.build("sensor", "ideal", pitch_um=4000 * TILE, cfa="RGGB")
    shot = sensor(lens(mixed), hdr.generator(seed=1))
    corrected = falloff(shot)
    seen = hdr.build("isp", "ideal")(shot).xyz.values[INNER, INNER, 1]
    assert seen == pytest.approx(100, rel=WORST.get(name, 1e-3))
    # there is shading to correct, and without the correction the picture would show it
    if name != "none":
        assert corrected[INNER, INNER].min() < 0.95
        shot.attrs["falloff"] = "none"
        shot.attrs.pop("distortion", None)
        assert hdr.build("isp", "ideal")(shot).xyz.values[INNER, INNER, 1].min() < 96


def test_photocurrent_is_corrected_like_irradiance():
    mixed = plane(
        np.broadcast_to(100 * white("daylight", W)[:, None, None], (len(W), ROWS, COLUMNS)).copy(),
        W,
        centres(COLUMNS, COLUMNS * TILE),
        centres(ROWS, ROWS * TILE),
        RADIANCE,
    )
    sensor = hdr.build(
        "sensor", "bayer", pitch_um=4000 * TILE, bits=0, full_well_e=1e9, swing_v=1e9
    )
    light = hdr.build("lens", "ideal", falloff=TABLE, distortion=BARREL).photocurrent(
        mixed, (), sensor.narrow(Demand()).response
    )
    shot = replace(sensor, noise=False)(light, hdr.generator(seed=1))
    seen = hdr.build("isp", "linear", design_snr=np.inf)(shot).xyz.values[INNER, INNER, 1]
    np.testing.assert_allclose(seen, 100, rtol=1e-3)
