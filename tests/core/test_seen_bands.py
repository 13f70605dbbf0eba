"""Bands outside all sensors' responses pass through no lens; forcing them through changes no
electron beyond the bound.
"""

from dataclasses import replace

import numpy as np

from isethdr_core import build
from isethdr_core.demand import Demand
from isethdr_core.pipeline.chain import Chain, on_sensor
from isethdr_core.quantities import RADIANCE, centres, plane
from isethdr_core.uncertainty import ledger

BANDS = np.arange(400.0, 1001.0, 50.0)


def chain(sensor):
    return Chain(
        None, None, None, {}, build("lens", "ideal", falloff="none"), {}, {"one": sensor}, None, {}
    )


def test_blind_bands_are_not_transformed_and_nothing_is_lost(monkeypatch):
    from isethdr_optics.imaging import irradiance as imaging

    seen = []
    irradiance = imaging.irradiance
    monkeypatch.setattr(
        imaging,
        "irradiance",
        lambda cube, optics, *rest: (
            seen.append(optics.wavelength_nm) or irradiance(cube, optics, *rest)
        ),
    )
    values = np.random.default_rng(1).random((len(BANDS), 24, 32)).astype(np.float32)
    mixed = plane(values, BANDS, centres(32, 0.032), centres(24, 0.024), RADIANCE)
    sensor = build("sensor", "bayer")
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        light = on_sensor(chain(sensor), mixed, Demand())
    assert max(seen[0]) < 1000.0 and min(seen[0]) == 400.0
    [left] = [o for o in rows[0].left_out if "bands" in o.what]
    forced = chain(sensor).lens(mixed)
    assert (
        list(light.wavelength.values) == list(BANDS) and light.attrs.keys() == forced.attrs.keys()
    )
    few, all_ = (sensor.expected(v).values for v in (light, forced))
    assert not np.array_equal(light.values, forced.values)
    # each band adds at most the bound, a share of the largest number of electrons. 1e-6 more:
    # bands are rounded to float32
    assert np.abs(few - all_).max() <= (left.bound * len(BANDS) + 1e-6) * all_.max()


def test_a_sensor_that_sees_all_gets_all():
    mixed = plane(
        np.ones((3, 8, 8), np.float32),
        [500.0, 550.0, 600.0],
        centres(8, 0.02),
        centres(8, 0.02),
        RADIANCE,
    )
    parts = chain(replace(build("sensor", "bayer")))
    np.testing.assert_array_equal(
        on_sensor(parts, mixed, Demand()).values, parts.lens(mixed).values
    )
