"""Imaging plans: a lens without one gets a plan that leaves nothing out, and one that plans is
asked once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, IdealLens

from isethdr_core import build
from isethdr_core.demand import Demand
from isethdr_core.errors import UnitError
from isethdr_core.pipeline.chain import Chain, imaging_plan, on_sensor
from isethdr_core.pipeline.imaging_plan import LightBudget, TrivialPlan, imaged, plans_imaging
from isethdr_core.quantities import RADIANCE, centres, plane
from isethdr_core.uncertainty import ledger

SENSOR = build("sensor", "bayer", pitch_um=20.0, rows=4, columns=6)


def mixed(width=12, height=8, bands=(450.0, 550.0, 650.0)):
    values = np.random.default_rng(1).random((len(bands), height, width)).astype(np.float32)
    return plane(values, list(bands), centres(width, 0.12), centres(height, 0.08), RADIANCE)


def chain(lens, leave_out=True):
    return Chain(None, None, None, {}, lens, {}, {"one": SENSOR}, None, {}, leave_out=leave_out)


class OnlyCall:
    """A lens of the least kind."""

    def __call__(self, mixed, flares=()):
        """Return irradiance."""
        return IdealLens()(mixed, flares)


@dataclass(frozen=True)
class Darker(IdealLens):
    """A lens that makes its own light and inherits a plan of other light."""

    def __call__(self, mixed, flares=(), error_allowed=0.0):
        """Return half the irradiance."""
        light = super().__call__(mixed, flares, error_allowed)
        return light.copy(data=light.values / 2)


def test_only_call_is_required_of_a_lens():
    asked = SENSOR.narrow(Demand())
    plan = imaging_plan(chain(OnlyCall()), mixed(), asked)
    assert isinstance(plan, TrivialPlan) and not plan.terms and not plan.left_out
    np.testing.assert_array_equal(plan.image(mixed()).values, IdealLens()(mixed()).values)
    assert plan.light_errors(mixed(), np.ones((1, 3))) is None


def test_a_subclass_that_makes_other_light_is_not_planned_by_what_it_inherits():
    assert plans_imaging(IdealLens()) and not plans_imaging(Darker())
    whole, half = (
        on_sensor(chain(one), mixed(), Demand()).values for one in (IdealLens(), Darker())
    )
    np.testing.assert_array_equal(half, whole / 2)


def test_nothing_is_left_out_where_that_is_switched_off():
    plan = imaging_plan(chain(IdealLens(), leave_out=False), mixed(), SENSOR.narrow(Demand()))
    assert isinstance(plan, TrivialPlan) and plan.image(mixed()).shape == mixed().shape


def test_what_a_plan_leaves_out_and_its_errors_are_stated_once_by_whoever_makes_the_light():
    lens, budget = DiffractionLimitedLens(), LightBudget()
    with ledger.stage(rows := ledger.Ledger(), "lens"):
        plan = lens.plan((), mixed(), None, budget)
        assert not rows and not plan.left_out == ()
        imaged(plan, mixed())
    [row] = rows
    assert [row.left_out.count(one) for one in plan.left_out] == [1] * len(plan.left_out)
    assert all(term in row.errors for term in plan.terms)


def test_a_plan_serves_other_light_on_the_same_field():
    lens, light = DiffractionLimitedLens(), mixed()
    plan = lens.plan((), light, None, LightBudget())
    twice = light.copy(data=2 * light.values)
    # float32: twice the light, but for the rounding of the transforms
    np.testing.assert_allclose(plan.image(twice).values, 2 * plan.image(light).values, rtol=1e-6)


@pytest.mark.parametrize("other", [{"width": 13}, {"bands": (450.0, 550.0, 660.0)}])
def test_a_plan_refuses_light_on_another_field(other):
    plan = IdealLens().plan((), mixed(), None, LightBudget())
    with pytest.raises(UnitError, match="another|other values"):
        plan.image(mixed(**other))


def test_a_plan_refuses_light_that_is_none_though_its_field_was_sound():
    plan, light = IdealLens().plan((), mixed(), None, LightBudget()), mixed()
    light.values[0, 0, 0] = -1.0
    with pytest.raises(UnitError):
        plan.image(light)


def test_bands_that_no_sensor_sees_are_dark_in_the_light_and_were_not_computed():
    budget = LightBudget(sensed_nm=(550.0, 650.0))
    plan = IdealLens().plan((), mixed(), None, budget)
    light = plan.image(mixed())
    assert list(light.wavelength.values) == [450.0, 550.0, 650.0]
    assert not light.values[0].any() and plan.optics.gains.shape == (2,)


def test_a_window_cuts_the_light_of_a_lens_that_keeps_it_in_place():
    response = SENSOR.narrow(Demand()).response
    budget = LightBudget(window_m=response.window_m)
    seen = IdealLens().plan((), mixed(), response, budget).image(mixed())
    whole = IdealLens()(mixed()).sel(x=seen.x, y=seen.y)
    assert seen.size < mixed().size
    np.testing.assert_array_equal(seen.values, whole.values)
    all_of_it = replace(response, window_m=None)
    assert IdealLens().plan((), mixed(), all_of_it, LightBudget()).image(mixed()).shape == (
        3,
        8,
        12,
    )
