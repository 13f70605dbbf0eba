"""Bands without effect on a sensor or without light are left out; the other bands change by at most
the stated bound.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from isethdr_core import build
from isethdr_core.demand import Demand
from isethdr_core.errors import UnitError
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.pipeline import bands
from isethdr_core.pipeline.chain import Chain, on_sensor, plan
from isethdr_core.quantities import PHOTOCURRENT, RADIANCE, centres, plane
from isethdr_core.uncertainty import ledger

WIDE = tuple(np.arange(400.0, 1101.0, 10.0).tolist())


def chain(sensor, **more):
    lens = build("lens", "diffraction_limited", falloff="none", focal_length_mm=0.5)
    return Chain(
        build("scene", "uniform", last_nm=1100.0),
        None,
        build("lighting", "ideal"),
        {},
        lens,
        {},
        {"one": sensor},
        None,
        {},
        **more,
    )


@dataclass(frozen=True)
class InMetres:
    """A scene of another plugin that gives its wavelengths in metres."""

    def __call__(self):
        raise AssertionError("a plan makes no scene")

    def bands_nm(self):
        return 1e-9 * np.arange(400.0, 701.0, 10.0)


def test_bands_that_are_no_nanometres_are_refused_by_the_plan():
    parts = replace(chain(build("sensor", "bayer")), scene=InMetres())
    with pytest.raises(UnitError, match="InMetres has bands from 4e-07 .* nanometres, 100 to 3000"):
        plan(parts, ledger.Ledger())


def test_the_truth_keeps_the_bands_that_the_eye_sees_and_a_sensor_its_own():
    rows = ledger.Ledger()
    kept = plan(chain(build("sensor", "bayer")), rows).wavelength_nm
    assert kept[0] == 400.0 and 700.0 < kept[-1] < 1000.0
    [left] = [o for o in rows[0].left_out if "neither" in o.why]
    whole, part = (xyz_weights(w).sum(1) for w in (WIDE, kept))
    # a flat spectrum; every dropped band adds at most the bound times the largest weight
    assert np.abs(whole / part - 1).max() < left.bound * (len(WIDE) - len(kept))
    assert (
        plan(chain(build("sensor", "bayer", infrared_cut=False)), ledger.Ledger()).wavelength_nm
        is None
    )
    assert (
        plan(chain(build("sensor", "bayer"), leave_out=False), ledger.Ledger()).wavelength_nm
        is None
    )


def test_inner_bands_and_two_at_least_stay():
    assert bands.outer([0, 1, 0, 1, 0]) == slice(1, 4)
    assert bands.outer([1, 0, 0]) == slice(0, 2) and bands.outer([0, 0, 1]) == slice(1, 3)
    assert bands.outer([0, 0, 0]) == slice(0, 3) and bands.outer([1]) == slice(0, 1)


def some_light(dark=()):
    values = np.random.default_rng(1).random((len(WIDE), 24, 32)).astype(np.float32)
    values[[w in dark for w in WIDE]] = 0.0
    return plane(values, WIDE, centres(32, 0.032), centres(24, 0.024), RADIANCE)


def test_bands_without_light_go_through_no_lens_and_the_light_is_the_same():
    mixed = some_light(dark=[w for w in WIDE if w < 550 or w > 600])
    parts = chain(build("sensor", "ideal", curves="unit", cfa="W", pitch_um=1.0))
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        light = on_sensor(parts, mixed, Demand())
    assert [o.what for o in rows[0].left_out if o.why == "no light in them"] == ["65 of 71 bands"]
    np.testing.assert_array_equal(light.values, parts.lens(mixed).values)
    assert list(light.wavelength.values) == list(WIDE)


@pytest.mark.parametrize("names", [("bayer",), ("bayer", "rgbw")])
def test_photocurrent_of_fewer_bands_is_read_as_that_of_all(names, monkeypatch):
    monkeypatch.setattr("isethdr_optics.plan.planning.WORTH", 0)  # plan even for a small frame
    sensors = {n: build("sensor", n, pitch_um=1.0) for n in names}
    parts = Chain(
        None,
        None,
        None,
        {},
        build("lens", "diffraction_limited", focal_length_mm=0.5),
        {},
        sensors,
        None,
        {},
    )
    demand = plan(chain(sensors["bayer"]), ledger.Ledger())
    rows = ledger.Ledger()
    mixed = some_light()
    if len(names) > 1:
        demand = Demand(
            response=sum(
                (s.narrow(Demand()).response for s in list(sensors.values())[1:]),
                sensors["bayer"].narrow(Demand()).response,
            )
        )
    with ledger.stage(rows, "lens"):
        light = on_sensor(parts, mixed, demand)
    assert light.attrs["units"] == PHOTOCURRENT and list(light.attrs["wavelength_nm"]) == list(WIDE)
    sd = next(e.value for e in rows[0].errors if "noise" in e.unit)
    for sensor in sensors.values():
        few, every = (sensor.expected(v).values for v in (light, parts.lens(mixed)))
        # the lens states its bound in standard deviations of noise: shot noise, and read noise of
        # at least half an electron squared. 1e-5: bands are float32, and some are left out
        assert (np.abs(few - every) <= sd * np.sqrt(every + 0.5) + 1e-5 * every.max()).all()
