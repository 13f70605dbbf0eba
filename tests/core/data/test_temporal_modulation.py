"""Groups that vary in time stay separate components; their sum equals the light before the
separation.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isethdr_core.conformance.inputs import in_components, mixed, scene
from isethdr_core.data import quantities
from isethdr_core.data.temporal_modulation import components, each_component, time_mean
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.lighting import TargetsLighting, WeightsLighting
from isethdr_core.physics.detector.temporal_modulation import Modulation
from isethdr_core.uncertainty import ledger

PULSES = {"frequency_hz": 90.0, "duty": 0.1, "phase": 0.3}
RIPPLE = {"frequency_hz": 100.0, "depth": 0.4}
WEIGHTS = WeightsLighting({"sky": 0.3, "headlights": 2.0, "streetlights": 0.7}, others=1.0)


def varying(**modulation):
    return replace(WEIGHTS, modulation=modulation)(scene())


def test_without_modulation_nothing_changes():
    plain = WEIGHTS(scene())
    assert plain.dims == quantities.MIXED_DIMS and "modulation" not in plain.attrs
    for nothing in (
        {},
        {"sky": None},
        {"headlights": {"frequency_hz": 90.0, "duty": 1.0}},
        {"other": {"frequency_hz": 50.0, "depth": 0}},
    ):
        assert varying(**nothing).identical(plain)
    assert time_mean(plain) is plain


def test_components_are_the_groups_and_add_up_to_the_mix():
    out = varying(headlights=PULSES, streetlights=RIPPLE)
    assert out.dims == ("component", *quantities.MIXED_DIMS) and list(out.component.values) == [
        "constant",
        "headlights",
        "streetlights",
    ]
    assert [m for m, _ in components(out)] == [
        Modulation(),
        Modulation(90.0, 0.1, 0.0, 0.3),
        Modulation(100.0, 1.0, 0.4, 0.0),
    ]
    only = WeightsLighting({"headlights": 2.0})(scene())
    np.testing.assert_array_equal(out.sel(component="headlights").values, only.values)
    # three sums and their total are rounded to float32: 4 times half a unit in the last place
    np.testing.assert_allclose(time_mean(out).values, WEIGHTS(scene()).values, rtol=4 * 6e-8)
    assert out.attrs["modulation"]["headlights"] == {
        "frequency_hz": 90.0,
        "duty": 0.1,
        "depth": 0.0,
        "phase": 0.3,
    }


def test_lamps_alike_share_a_component_and_dark_ones_have_none():
    assert list(varying(headlights=PULSES, streetlights=PULSES).component.values) == [
        "constant",
        "headlights + streetlights",
    ]
    assert (
        replace(WEIGHTS, weights={"headlights": 0.0}, modulation={"headlights": PULSES})(
            scene()
        ).dims
        == quantities.MIXED_DIMS
    )
    everything = replace(
        WEIGHTS, modulation=dict.fromkeys(("sky", "headlights", "streetlights", "other"), RIPPLE)
    )(scene())
    assert everything.sizes["component"] == 1


def test_phases_are_drawn_by_seed_and_group():
    def phases(seed, **table):
        return [
            m.phase
            for m, _ in components(replace(WEIGHTS, modulation=table, seed=seed)(scene()))[1:]
        ]

    free = {**PULSES, "phase": [0.2, 0.6]}
    one = phases(1, headlights=free)
    assert 0.2 <= one[0] <= 0.6 and one == phases(1, headlights=free) != phases(2, headlights=free)
    both = phases(1, headlights=free, other=free)
    assert both[0] == one[0] != both[1]  # another group does not change it


def test_targets_speak_of_the_mean_over_time():
    plain = TargetsLighting(
        {"headlights": {"statistic": "max", "cd_m2": 5000.0}}, moves=["sky"], median_cd_m2=20.0
    )
    pulsed = replace(plain, modulation={"headlights": PULSES})
    assert pulsed(scene()).attrs["weights"] == plain(scene()).attrs["weights"]
    np.testing.assert_allclose(
        time_mean(pulsed(scene())).values, plain(scene()).values, rtol=3 * 6e-8
    )


def test_truth_and_pictures_of_the_scene_take_the_mean():
    out = varying(headlights=PULSES)
    np.testing.assert_array_equal(
        quantities.tristimulus(out).xyz.values, quantities.tristimulus(time_mean(out)).xyz.values
    )


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({"duty": 0.1}, "frequency_hz and either duty"),
        ({"frequency_hz": 90}, "either duty"),
        ({"frequency_hz": 90, "duty": 0.1, "depth": 0.1}, "either duty"),
        ({**PULSES, "dutty": 1}, "did you mean 'duty'"),
        ({**PULSES, "duty": 0.0}, "duty is 0"),
        ({**PULSES, "duty": 1.5}, "duty is 1.5"),
        ({**PULSES, "duty": float("nan")}, "duty is nan"),
        ({**RIPPLE, "depth": 1.2}, "depth is 1.2"),
        ({**PULSES, "frequency_hz": -1}, "frequency_hz is -1"),
        ({**PULSES, "frequency_hz": float("inf")}, "frequency_hz is inf"),
        ({**PULSES, "frequency_hz": 0}, "above 0"),
        ({**PULSES, "phase": 1.5}, "phase is 1.5"),
        ({**PULSES, "phase": [0.6, 0.2]}, "phase is"),
        ({**PULSES, "phase": "x"}, "expected numbers"),
        ({**PULSES, "phase": [0, 1, 2]}, "expected numbers"),
    ],
)
def test_modulations_that_cannot_be_are_refused(entry, said):
    for lighting in (WEIGHTS, TargetsLighting()):
        with pytest.raises(ConfigError, match="lighting.modulation.sky") as err:
            replace(lighting, modulation={"sky": entry})
        assert said in str(err.value)


def test_a_group_the_scene_lacks_is_refused():
    with pytest.raises(
        ConfigError, match=r"names the light group 'headlihts'.*did you mean 'headlights'"
    ):
        varying(headlihts=PULSES)


def test_components_state_what_they_have_in_common_once():
    class Lens:
        @each_component
        def __call__(self, light):
            ledger.error(float(light.max()), "W m-2 nm-1", "bound", "blur")
            ledger.error(float(light.max()), "relative", "bound", "rounding")
            ledger.left_out("rays", "few", float(light.max()), "relative")
            return light

    rows = ledger.Ledger()
    light = varying(headlights=PULSES, streetlights=RIPPLE)
    with ledger.stage(rows, "lens"):
        ledger.error(9.0, "relative", "bound", "rounding")  # stated before the components
        Lens()(light)
    peaks = [float(one.max()) for _, one in components(light)]
    assert [e.value for e in rows[0].errors] == [9.0, pytest.approx(sum(peaks)), max(peaks)]
    assert [o.bound for o in rows[0].left_out] == [max(peaks)]


def test_damaged_components_are_refused():
    good = in_components(mixed(), **PULSES)
    for bad, said in (
        (good.drop_vars("duty"), "no coordinate 'duty'"),
        (good.isel(component=[]), "at least one"),
        (good.transpose("y", ...), "first"),
        (good.assign_coords(duty=("component", [0.0])), "duty is 0"),
        (good.assign_coords(phase=("component", [np.nan])), "phase is nan"),
    ):
        with pytest.raises(UnitError, match=said):
            components(bad)
