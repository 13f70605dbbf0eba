"""A run leaves out unneeded work; the run that computes everything holds the same bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr

from isethdr_core import build, compose, run
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.quantities import LABELS
from isethdr_core.storage import store
from isethdr_core.testing import check
from isethdr_core.uncertainty.budget import stored_error

from .pipeline.test_chain import SMALL

DRAWS = [*SMALL, "draws=3", "report=false"]


def left(result) -> list[str]:
    return [o.what for row in result.ledger for o in row.left_out]


def same_readings(first, second) -> bool:
    [camera] = first.cameras
    return all(
        np.array_equal(*(r.open(f"{group}/{camera}")[name].values for r in (first, second)))
        for group, name in (("captures", "raw"), ("picture", "xyz"), ("truth", "xyz"))
    )


@pytest.mark.slow
def test_draws_of_a_noise_that_is_not_there_are_left_out():
    for sensor in (["sensor=ideal"], ["sensor=bayer", "sensor.noise=false"]):
        few, every = (run(compose([*DRAWS, *sensor, *more])) for more in ([], ["leave_out=false"]))
        assert "2 more noise realisations" in left(few) and "2 more noise realisations" not in left(
            every
        )
        assert same_readings(few, every) and few.scores == every.scores


def test_draws_of_a_noise_that_is_there_stay():
    result = run(compose([*DRAWS, "sensor=bayer"]))
    assert not [what for what in left(result) if "noise realisations" in what]


@dataclass(frozen=True)
class Liar:
    """Sensor that calls itself free of noise and is not."""

    noise: bool = False

    def __call__(self, light, generator):
        """Return a noisy shot."""
        return build("sensor", "bayer", pitch_um=3.0)(light, generator)

    def expected(self, light):
        """Return mean electrons."""
        return build("sensor", "bayer", pitch_um=3.0).expected(light)


def test_the_kit_catches_a_sensor_that_hides_its_noise(offer):
    offer("sensor", "liar", Liar)
    with pytest.raises(AssertionError, match="draws the same shot whatever the key|without noise"):
        check("sensor", "liar")


def test_lightings_that_only_a_report_shows_are_left_out_without_one():
    own = ("scene=uniform", "~versions", "lighting=ideal")
    base = [o for o in SMALL if o not in own] + [
        "scene=point_lights",
        "scene.disc_diameter_deg=0.1",
        "lighting=weights",
        "+lighting.weights.headlights=1",
        "sensor=ideal",
    ]
    rows = Ledger()
    shown = chain(compose(base))
    unseen = chain(compose([*base, "report=false"]))
    assert set(plan(shown, Ledger()).groups) == {"sky", "headlights"}
    assert plan(unseen, rows).groups == ("headlights",)
    assert "lighting day, and light groups that it alone needs" in [
        o.what for o in rows[0].left_out
    ]
    assert chain(compose([*base, "report=false", "leave_out=false"])).versions
    path = run(compose([*SMALL, "sensor=ideal", "report=false"])).path
    with pytest.raises(Exception, match="versions"):
        store.open_store(path, "versions/main")


def test_everything_is_asked_for_where_nothing_may_be_left_out():
    demand = plan(chain(compose([*SMALL, "sensor=bayer", "leave_out=false"])), Ledger())
    assert (
        demand.labels == set(LABELS)
        and demand.groups is demand.wavelength_nm is demand.response is None
    )


def test_light_is_stored_as_finely_whatever_is_left_out():
    # bayer needs 13 bits of the mantissa, ideal no more than usual
    for sensor in (
        "bayer",
        "ideal",
    ):
        few, every = (
            plan(chain(compose([*SMALL, f"sensor={sensor}", *more])), Ledger())
            for more in ([], ["leave_out=false"])
        )
        assert stored_error(few) == stored_error(every) and (stored_error(few) > 0) == (
            sensor == "bayer"
        )


def test_every_label_can_be_kept_with_a_run():
    from isethdr_core.pipeline.chain import Camera
    from isethdr_core.runs.run import _groups

    size = {"y": np.arange(4.0), "x": np.arange(6.0)}
    truth = xr.Dataset({"xyz": (("y", "x", "xyz_channel"), np.zeros((4, 6, 3)))}, coords=size)
    labels = xr.Dataset({"normal": (("y", "x", "xyz"), np.ones((4, 6, 3)))}, coords=size)
    kept = _groups({"a": Camera(xr.Dataset(), xr.Dataset(), truth, labels)}, {})["truth/a"]
    assert kept["normal"].dims == ("y", "x", "direction") and float(kept["normal"].min()) == 1.0


@pytest.mark.parametrize("name", ["leave_out", "report"])
def test_switches_are_true_or_false(name):
    with pytest.raises(
        ConfigError,
        match=f"{name} is 'some'; expected true or false; type for example {name}=false",
    ):
        run(compose([f"{name}=some"]))
