"""Ranges of fields: declared where a field is defined, checked when a component is built."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, make_dataclass
from typing import Annotated, Any, Literal

import pytest

from isethdr_core import Range, build
from isethdr_core.cli.plugin_list import field_text
from isethdr_core.component import Component
from isethdr_core.config.composition import schema
from isethdr_core.conformance.ranges import bad_fields
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.field_docs import allowed, choices, field_rows, unit_of
from isethdr_core.plugins.ranges import check_ranges, field_types, on_command_line, range_text


@dataclass(frozen=True)
class Probe:
    """A lens with fields of every form."""

    f_number: Annotated[float, Range(0.5, 64)] = 4.0
    blades: Annotated[int, Range(0, 64)] = 6
    design_snr: Annotated[float, Range(0.1, math.inf)] = 20.0
    shift_um: float = 0.0
    samples: Annotated[int, Range(1, 4096)] | None = None
    zernike_um: dict[Annotated[int, Range(0, 230)], Annotated[float, Range(-100, 100)]] = field(
        default_factory=dict
    )
    falloff: Literal["cos4"] | dict[float, Annotated[float, Range(0, 1)]] = "cos4"
    ends: tuple[Annotated[float, Range(0, 1)], Annotated[float, Range(0, 1)]] = (0.5, 1.0)
    notes: dict[str, Any] = field(default_factory=dict)
    unit: Literal["not_stated", "cd/m2", "reflectance"] = "not_stated"

    def __call__(self, mixed, flares=()):
        return mixed

    def __post_init__(self) -> None:
        check_ranges(self)


@pytest.fixture(autouse=True)
def probe(offer):
    return offer("lens", "probe", Probe)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"f_number": 1e30}, r"f_number is 1e\+30; expected 0.5 to 64; type .* lens.f_number=4.0"),
        ({"f_number": math.nan}, "f_number is nan; expected 0.5 to 64"),
        ({"f_number": True}, "f_number is True; expected 0.5 to 64"),
        ({"f_number": "wide"}, "f_number is 'wide'; expected a valid number"),
        ({"blades": -1}, "blades is -1; expected 0 to 64; type .* lens.blades=6"),
        ({"blades": 1.7}, "blades is 1.7; expected a valid integer"),
        ({"design_snr": -math.inf}, "design_snr is -inf; expected 0.1 to inf"),
        ({"shift_um": math.nan}, "shift_um is nan; expected a finite number"),
        ({"shift_um": math.inf}, "shift_um is inf; expected a finite number"),
        ({"samples": 0}, "samples is 0; expected 1 to 4096; type .* lens.samples=null"),
        (
            {"zernike_um": {4: math.nan}},
            r"zernike_um is {4: nan} with nan in it; expected -100 to 100; type .*zernike_um={4:0}",
        ),
        ({"zernike_um": {-1: 0.1}}, r"zernike_um is {-1: 0.1} with -1 in it; expected 0 to 230"),
        ({"falloff": {10.0: 2.0}}, r"falloff is {10.0: 2.0} with 2.0 in it; expected 0 to 1"),
        ({"falloff": "cos5"}, "falloff is 'cos5'; expected 'cos4' or a valid dictionary"),
        ({"ends": [0.5, 1.5]}, r"with 1.5 in it; expected 0 to 1; type .* lens.ends=\[0.5,1.0\]"),
        ({"unit": "furlong"}, "'cd/m2' or 'reflectance'; type .* lens.unit=cd/m2"),
        ({"unit": "reflectanse"}, "did you mean 'reflectance'.; type .* lens.unit=reflectance"),
        ({"ends": [0.5]}, r"ends is \[0.5\]; expected one more element"),
    ],
)
def test_a_value_that_does_not_fit_is_named_with_what_was_expected_and_what_to_type(
    fields, message
):
    with pytest.raises(ConfigError, match=message):
        build("lens", "probe", **fields)


def test_both_ends_are_allowed_and_infinity_where_a_range_ends_in_it():
    made = build(
        "lens",
        "probe",
        f_number=64,
        blades=0,
        design_snr=math.inf,
        samples=4096,
        zernike_um={"4": -100},
        ends=[0, 1],
    )
    assert made.design_snr == math.inf and made.f_number == 64.0
    assert made.zernike_um == {4: -100.0} and made.ends == (0.0, 1.0)


def test_objects_made_directly_are_checked_where_they_ask_for_it():
    with pytest.raises(ConfigError, match="Probe: f_number is nan; expected 0.5 to 64"):
        Probe(f_number=math.nan)


@pytest.mark.parametrize(
    ("annotation", "default", "message"),
    [
        (Annotated[float, Range(3, 4)], 2.0, "is 2.0, a mistaken default of the plugin; .*=3$"),
        (int, 2.5, "is 2.5, a mistaken default of the plugin; .*lens.size=<value>$"),
        (Literal["a", "b"], "c", "is 'c', a mistaken default of the plugin; .*lens.size=a$"),
    ],
)
def test_a_default_that_does_not_fit_is_no_advice(offer, annotation, default, message):
    def call(self, mixed, flares=()):
        return mixed

    methods = {"__call__": call}
    offer(
        "lens",
        "mistaken",
        make_dataclass("Made", [("size", annotation, default)], frozen=True, namespace=methods),
    )
    with pytest.raises(ConfigError, match=message):
        build("lens", "mistaken", size=default)
    with pytest.raises(ConfigError, match="size is 9.5; expected") as found:
        build("lens", "mistaken", size=9.5)
    assert not str(found.value).endswith(f"={default}")


def test_a_plain_check_of_a_plugin_becomes_our_error(offer):
    @dataclass(frozen=True)
    class Checked:
        """A lens that refuses with ValueError."""

        f_number: float = 4.0

        def __post_init__(self):
            raise ValueError("no such lens")

        def __call__(self, mixed, flares=()):
            return mixed

    offer("lens", "checked", Checked)
    with pytest.raises(ConfigError, match="lens 'checked': no such lens"):
        build("lens", "checked")


def test_hydra_sees_plain_types_and_people_see_the_ranges():
    node = schema(Component("lens", "probe", Probe))()
    assert node.f_number == 4.0 and node.zernike_um == {}
    texts = [field_text(row) for row in field_rows(Probe)]
    assert texts[:4] == [
        "f_number=4.0  [0.5 to 64]",
        "blades=6  [0 to 64]",
        "design_snr=20.0  [0.1 to inf]",
        "shift_um=0.0  [um]",
    ]
    assert range_text(field_types(Probe)["zernike_um"]) == "0 to 230: -100 to 100"


def test_the_documentation_of_a_field_states_unit_and_switches():
    assert unit_of("frames_per_s", float) == "1/s" and unit_of("dark_e_per_s", float) == "e/s"
    assert unit_of("people_per_km", float) == "1/km" and unit_of("wedge_mrad", float) == "mrad"
    assert unit_of("speed_limit_kmh", float) == "km/h" and unit_of("exposure_s", float) == "s"
    assert allowed(bool | None) == "true, false, or `null`" and allowed(bool) == "true, false"
    assert choices(bool | None) == ("true", "false")


def test_the_kit_tries_every_number_of_every_field():
    bad = list(bad_fields(Probe()))
    assert {next(iter(b)) for b in bad} == set(field_types(Probe)) - {"notes", "unit"}
    for values in bad:
        with pytest.raises(ConfigError, match="expected"):
            build("lens", "probe", **values)
    assert {"blades": -1} in bad and {"blades": 65} in bad and {"blades": 0.5} in bad
    assert {"design_snr": math.inf} not in bad and {"shift_um": math.inf} in bad


def test_a_range_belongs_to_a_number(offer):
    @dataclass(frozen=True)
    class Vague:
        """A lens whose range annotates more than a number."""

        shift_um: Annotated[float | None, Range(0, 1)] = None

        def __call__(self, mixed, flares=()):
            return mixed

    offer("lens", "vague", Vague)
    with pytest.raises(TypeError, match="expected int or float"):
        build("lens", "vague")
    with pytest.raises(ValueError, match="least <= most"):
        Range(2, 1)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "null"),
        (True, "true"),
        ({4: 0.1}, "{4:0.1}"),
        ((1, 2.5), "[1,2.5]"),
        ("", "''"),
        (math.inf, "inf"),
    ],
)
def test_examples_are_written_as_the_command_line_takes_them(value, text):
    assert on_command_line(value) == text
