"""Accuracy knobs: wrong declarations are refused at loading, and bundled components declare
theirs.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import pytest

from isethdr_core import AccuracyKnob, Cost, ErrorShare, Spaced, build
from isethdr_core.errors import PluginError
from isethdr_core.plugins import abilities
from isethdr_core.plugins.accuracy_knobs import knobs_of, shares_of
from isethdr_core.plugins.registry import class_of, components
from isethdr_core.uncertainty.error_terms import Quantity

GOOD = AccuracyKnob("rays", (4, 8), Quantity.IRRADIANCE, Cost(1.0, 1.0))
TOLD = dataclasses.replace(GOOD, field="error", budgeted=True)


def lens(kind="lens", **declared) -> type:
    """Return a component class with two fields and the given declarations."""

    @dataclass(frozen=True)
    class Toy:
        rays: int = 8
        error: float | None = None

        def __call__(self, *arguments, **named):
            return None

        def irradiance(self, lens, mixed):
            return mixed

    for name, value in declared.items():
        setattr(Toy, name, value)
    return Toy


@pytest.mark.parametrize("declared", [(GOOD,), [GOOD, TOLD], (), None])
def test_what_is_well_declared_is_read(declared):
    cls = lens(accuracy_knobs=declared)
    abilities.check("lens", "toy", cls)
    assert knobs_of(cls()) == tuple(declared or ()) and shares_of(cls()) == ()


@pytest.mark.parametrize(
    ("kind", "knob", "said"),
    [
        ("lens", "rays", "expected a tuple"),
        ("lens", ("rays",), r"expected isethdr_core.AccuracyKnob\("),
        ("lens", (dataclasses.replace(GOOD, field="ray"),), "'ray', which is no field; .* rays"),
        ("lens", (dataclasses.replace(GOOD, independent={"sed": 1}),), "'sed', which is no field"),
        ("lens", (dataclasses.replace(GOOD, values=(1,)),), "at least 2"),
        ("lens", (dataclasses.replace(GOOD, values=8),), "at least 2"),
        ("lens", (dataclasses.replace(GOOD, error_of="colour"),), "expected one of radiance"),
        ("lens", (dataclasses.replace(GOOD, budgeted=True),), "default is 8; expected None"),
        ("lens", (dataclasses.replace(TOLD, cost=None),), r"expected Cost\(seconds, power\)"),
        ("lens", (dataclasses.replace(TOLD, cost=Cost(1.0, -1.0)),), "smaller error takes longer"),
        ("isp", (TOLD,), "the budget ends at the electrons"),
        ("lens", (dataclasses.replace(TOLD, error_of=Quantity.PICTURE),), "ends at the electrons"),
    ],
)
def test_what_no_study_and_no_budget_could_use_is_refused_at_loading(kind, knob, said):
    with pytest.raises(PluginError, match=f"{kind}/toy.*{said}"):
        abilities.check(kind, "toy", lens(accuracy_knobs=knob))


@pytest.mark.parametrize(
    ("kind", "share", "said"),
    [
        ("lens", (GOOD,), r"expected isethdr_core.ErrorShare\("),
        ("lens", (ErrorShare("a"),), "reserved share between 0 and 1"),
        ("lens", (ErrorShare("a", reserved=1.0),), "reserved share between 0 and 1"),
        ("lens", (ErrorShare("a", Cost(0.0)),), "seconds above 0"),
        ("flare", (ErrorShare("a", Cost(1.0)),), "AccuracyKnob with budgeted=True"),
    ],
)
def test_shares_that_cannot_be_divided_are_refused_at_loading(kind, share, said):
    with pytest.raises(PluginError, match=said):
        abilities.check(kind, "toy", lens(error_shares=share))


def test_values_of_an_iterator_can_be_read_again():
    knob = AccuracyKnob("rays", map(int, "48"), Quantity.IRRADIANCE)
    abilities.check("lens", "toy", lens(accuracy_knobs=(knob,)))
    assert knob.tried() == (4, 8) and knob.finest() == 8


def test_a_misspelt_declaration_is_refused_with_the_right_name():
    with pytest.raises(PluginError, match="accuracy_knob'; did you mean accuracy_knobs"):
        abilities.check("lens", "toy", lens(accuracy_knob=(GOOD,)))


def test_spaced_values_go_by_one_factor_from_the_cheapest_to_the_finest():
    values = list(Spaced(0.1, 1e-4, 4))
    assert values == pytest.approx([0.1, 0.01, 1e-3, 1e-4], rel=1e-12) and values[-1] == 1e-4
    assert list(Spaced(1, 100, 3)) == [1, 10, 100] and list(Spaced(1, 2, 5)) == [1, 2]
    for wrong in ((0.0, 1.0, 3), (1.0, -1.0, 3), (1.0, 2.0, 1)):
        with pytest.raises(ValueError, match="ends above 0"):
            Spaced(*wrong)


def test_a_cost_is_a_power_law_or_a_function():
    assert Cost(3.0, 2.0).of(0.1) == pytest.approx(300.0)
    assert Cost(3.0, -1.0).of(64) == pytest.approx(192.0)  # the value is a number of samples
    assert Cost(3.0).of(math.exp(-2)) == pytest.approx(6.0)


def test_costs_of_a_knob_are_ratios_and_not_known_without_a_model():
    assert GOOD.relative_cost(2, 8) == 4.0  # cost in inverse proportion to the value
    squares = dataclasses.replace(GOOD, cost=lambda rays: rays**2)
    assert squares.relative_cost(8, 4) == 4.0
    assert math.isnan(squares.relative_cost(8, 0))
    for cost in (None, Cost(1.0)):  # without a power, a constant is unknown
        assert math.isnan(dataclasses.replace(GOOD, cost=cost).relative_cost(8, 4))
    assert math.isnan(GOOD.relative_cost(None, 4))


BUNDLED = {
    ("renderer", "mitsuba"): {
        "samples",
        "error_allowed",
        "noise_share_allowed",
        "max_depth",
        "step_nm",
    },
    ("lens", "diffraction_limited"): {"speckle_error"},
    ("lens", "wavefront"): {"speckle_error", "error_allowed"},
    ("lens", "prescription"): {"speckle_error", "error_allowed"},
    ("flare", "ghosts"): {"error_allowed"},
    ("scene", "uniform"): {"step_nm"},
    ("scene", "macbeth"): {"step_nm"},
}


def test_bundled_components_declare_their_knobs_and_accept_every_value():
    declared = {}
    for (kind, name), comp in components().items():
        knobs = knobs_of(class_of(comp)())
        if knobs:
            declared[kind, name] = {knob.field for knob in knobs}
        for knob in knobs:
            for value in (*knob.tried(), knob.finest()):
                build(kind, name, **{knob.field: value, **knob.independent})
            first, *finer = knob.tried()
            costs = [knob.relative_cost(value, first) for value in (first, *finer, knob.finest())]
            assert costs == sorted(costs) or all(map(math.isnan, costs))  # cheapest first
    assert {key: declared.get(key) for key in BUNDLED} == BUNDLED
    charts = {key for key in declared if key[0] == "scene"}
    assert declared.keys() - charts == BUNDLED.keys() - charts
