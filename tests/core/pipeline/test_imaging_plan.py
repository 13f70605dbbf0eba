"""Imaging plans: a lens without a plan gets one that leaves nothing out; a plan states its errors
once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, IdealLens

from isethdr_core import build, compose, run
from isethdr_core.demand import Demand
from isethdr_core.errors import UnitError
from isethdr_core.pipeline.chain import Chain, imaging_plan, on_sensor
from isethdr_core.pipeline.imaging_plan import (
    FieldAhead,
    ImagingOutline,
    LightBudget,
    TrivialPlan,
    imaged,
    outlined,
    plans_imaging,
)
from isethdr_core.quantities import RADIANCE, centres, plane
from isethdr_core.uncertainty import ledger

METRICS = ("dynamic_range", "snr", "colour", "ssim", "log_luminance", "contrast", "detection")
SENSOR = build("sensor", "bayer", pitch_um=20.0, rows=4, columns=6)


def mixed(width=12, height=8, bands=(450.0, 550.0, 650.0)):
    values = np.random.default_rng(1).random((len(bands), height, width)).astype(np.float32)
    return plane(values, list(bands), centres(width, 0.12), centres(height, 0.08), RADIANCE)


def chain(lens, leave_out=True):
    return Chain(None, None, None, {}, lens, {}, {"one": SENSOR}, None, {}, leave_out=leave_out)


class OnlyCall:
    """A lens with `__call__` alone."""

    def __call__(self, mixed, flares=()):
        """Return irradiance."""
        return IdealLens()(mixed, flares)


@dataclass(frozen=True)
class Darker(IdealLens):
    """A lens that overrides `__call__` and inherits the plan of its base class."""

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


def test_the_inherited_plan_of_a_subclass_with_its_own_call_is_not_used():
    assert plans_imaging(IdealLens()) and not plans_imaging(Darker())
    whole, half = (
        on_sensor(chain(one), mixed(), Demand()).values for one in (IdealLens(), Darker())
    )
    np.testing.assert_array_equal(half, whole / 2)


def test_inherited_errors_of_other_light_are_not_used():
    weights = np.ones((1, 3))
    assert TrivialPlan(IdealLens()).light_errors(mixed(), weights) is not None
    assert TrivialPlan(Darker()).light_errors(mixed(), weights) is None


def test_leave_out_false_leaves_nothing_out():
    plan = imaging_plan(chain(IdealLens(), leave_out=False), mixed(), SENSOR.narrow(Demand()))
    assert isinstance(plan, TrivialPlan) and plan.image(mixed()).shape == mixed().shape


def test_errors_and_omissions_of_a_plan_are_stated_once_when_light_is_imaged():
    lens = DiffractionLimitedLens()
    budget = LightBudget()
    with ledger.stage(rows := ledger.Ledger(), "lens"):
        plan = lens.plan((), mixed(), None, budget)
        assert not rows and plan.left_out
        imaged(plan, mixed())
    [row] = rows
    assert [row.left_out.count(one) for one in plan.left_out] == [1] * len(plan.left_out)
    stated = [replace(term, source=row.source(term.source.key)) for term in plan.terms]
    assert stated and all(term in row.errors for term in stated)


def test_a_plan_serves_other_light_on_the_same_field():
    lens = DiffractionLimitedLens()
    light = mixed()
    plan = lens.plan((), light, None, LightBudget())
    twice = light.copy(data=2 * light.values)
    # twice the light, up to the rounding of the transforms in float32
    np.testing.assert_allclose(plan.image(twice).values, 2 * plan.image(light).values, rtol=1e-6)


@pytest.mark.parametrize("other", [{"width": 13}, {"bands": (450.0, 550.0, 660.0)}])
def test_a_plan_refuses_light_on_another_field(other):
    plan = IdealLens().plan((), mixed(), None, LightBudget())
    with pytest.raises(UnitError, match="another|other values"):
        plan.image(mixed(**other))


def test_a_plan_refuses_negative_light_on_its_own_field():
    plan = IdealLens().plan((), mixed(), None, LightBudget())
    light = mixed()
    light.values[0, 0, 0] = -1.0
    with pytest.raises(UnitError):
        plan.image(light)


def test_bands_beyond_every_sensor_are_dark_and_not_computed():
    budget = LightBudget(sensed_nm=(550.0, 650.0))
    plan = IdealLens().plan((), mixed(), None, budget)
    light = plan.image(mixed())
    assert list(light.wavelength.values) == [450.0, 550.0, 650.0]
    assert not light.values[0].any() and plan.optics.gains.shape == (2,)


def test_a_window_crops_the_light_of_a_lens_without_blur():
    response = SENSOR.narrow(Demand()).response
    budget = LightBudget(window_m=response.window_m)
    cropped = IdealLens().plan((), mixed(), response, budget).image(mixed())
    whole = IdealLens()(mixed()).sel(x=cropped.x, y=cropped.y)
    assert cropped.size < mixed().size
    np.testing.assert_array_equal(cropped.values, whole.values)
    uncropped = replace(response, window_m=None)
    plan = IdealLens().plan((), mixed(), uncropped, LightBudget())
    assert plan.image(mixed()).shape == mixed().shape


def test_the_outline_of_a_lens_without_a_plan_leaves_nothing_out():
    """The lens images all bands and tiles, whatever the sensors see."""
    budget = LightBudget(window_m=(1e-4, 1e-4), sensed_nm=(550.0,))
    ahead = FieldAhead((0.4, 0.3, "tangent"), (450.0, 550.0, 650.0))
    assert outlined(OnlyCall(), (), ahead, budget) == ImagingOutline()
    assert outlined(Darker(), (), ahead, budget) == ImagingOutline()
    known = outlined(IdealLens(falloff="none"), (), ahead, budget)
    assert not known.margin
    assert [note.what for note in known.left_out][-2:] == [
        "1 of 3 bands through the lens",
        "99.5 % of the camera's field through the lens",
    ]


def test_a_run_plans_its_light_once(monkeypatch, isethdr_home):
    """The lens errors that the picture of each camera states need no further plan."""
    made = []
    own = IdealLens.plan

    def counted(self, flares, field, response=None, budget=None):
        made.append(budget)
        return own(self, flares, field, response, budget)

    monkeypatch.setattr(IdealLens, "plan", counted)
    overrides = ["scene=uniform", "scene.width=24", "scene.height=16", "lighting=ideal"]
    overrides += ["scene.horizontal_field_deg=2", "~renderer", "~versions", "lens=ideal"]
    overrides += ["~flare.dirt", "report=false", "draws=1"]
    result = run(compose([*overrides, *(f"~metric.{m}" for m in METRICS)]))
    assert len(result.cameras) == 3
    assert sum(row.stage.startswith("picture ") for row in result.ledger) == 3
    assert len(made) == 1
