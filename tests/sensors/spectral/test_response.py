"""Sensors take irradiance or photocurrent: a photocurrent computed from the irradiance by hand
gives the same electrons in every sensor.
"""

import numpy as np
import pytest

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.physics.radiometry import band_widths_nm, photon_energy_j
from isethdr_core.plugins.registry import build, components

BANDS = np.arange(400.0, 701.0, 20.0)
SENSORS = sorted(name for kind, name in components() if kind == "sensor")


def irradiance():
    values = np.random.default_rng(0).uniform(0, 1e-3, (len(BANDS), 30, 40))
    x = quantities.centres(40, 40 * 5e-6)
    y = quantities.centres(30, 30 * 5e-6)
    return quantities.plane(
        values,
        BANDS,
        x,
        y,
        quantities.IRRADIANCE,
        f_number=4.0,
        focal_length_mm=6.0,
        throughput_sr=0.05,
        falloff="none",
        field_width=40 * 5e-6,
        field_height=30 * 5e-6,
    )


def photocurrent(light, response):
    efficiency = response.efficiency(BANDS)
    values = np.tensordot(
        efficiency * band_widths_nm(BANDS) / photon_energy_j(BANDS), light.values, 1
    )
    attrs = {k: v for k, v in light.attrs.items() if k != "units"}
    return quantities.photocurrent(
        values, response.channels, light.x.values, light.y.values, BANDS, efficiency, **attrs
    )


@pytest.mark.parametrize("name", SENSORS)
def test_every_sensor_accepts_both(name):
    sensor = build("sensor", name)
    light = irradiance()
    response = sensor.narrow(Demand()).response
    if response is None:  # without noise, no error is small enough to neglect
        assert not sensor.model().noise
        return
    short = photocurrent(light, response)
    # rounding of float64: the sums run in another order
    np.testing.assert_allclose(
        sensor.expected(short).values, sensor.expected(light).values, rtol=1e-12
    )


def test_light_that_goes_astray_has_rows_of_its_own():
    sensor = build("sensor", "bayer", optical_crosstalk_percent=5.0)
    light = irradiance()
    response = sensor.narrow(Demand()).response
    assert len(response.channels) == len(set(response.channels)) == 6
    np.testing.assert_allclose(
        sensor.expected(photocurrent(light, response)).values,
        sensor.expected(light).values,
        rtol=1e-12,
    )


def test_the_longest_exposure_counts():
    fixed = build("sensor", "bayer", exposure_s=0.01)
    solved = build("sensor", "bayer", exposure_rule="centre", exposure_max_s=0.02)
    areas = [s.narrow(Demand()).response.area_exposure_m2_s for s in (fixed, solved)]
    assert areas[1] == pytest.approx(2 * areas[0])
    assert areas[0] == pytest.approx((3.75e-6) ** 2 * 0.01)


def test_a_photocurrent_says_what_it_is():
    light = photocurrent(irradiance(), build("sensor", "bayer").narrow(Demand()).response)
    quantities.check_photocurrent(light)
    for wrong in (
        light.assign_attrs(units="A"),
        light.transpose("y", "x", "channel"),
        -light.assign_attrs(light.attrs),
    ):
        with pytest.raises(quantities.UnitError):
            quantities.check_photocurrent(
                wrong.assign_attrs(
                    light.attrs | {"units": wrong.attrs.get("units", light.attrs["units"])}
                )
            )
