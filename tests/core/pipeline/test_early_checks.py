"""Mistakes in combinations of components are refused by a plan, before any work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from isethdr_core.cli.commands import main
from isethdr_core.cli.plan_summary import print_plan
from isethdr_core.config.composition import compose
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError, PluginError
from isethdr_core.pipeline.bands import offered_nm
from isethdr_core.pipeline.chain.narrowing import narrowed
from isethdr_core.pipeline.early_checks import ListsCaptures, ListsGroups, check_statements
from isethdr_core.pipeline.memory import held_bytes
from isethdr_core.plugins.registry import build, components
from isethdr_core.runs import run as runs
from isethdr_core.runs.processor import kernels

CHART = [
    "scene=point_lights",
    "scene.width=24",
    "scene.height=16",
    "scene.horizontal_field_deg=4",  # makes the sensor small
    "~renderer",
    "~versions",
    "~flare.dirt",
    "lens=ideal",
    "lighting=ideal",
    "sensor=split_pixel",
]
TARGETS = ["lighting=targets", "lighting.median_cd_m2=1"]
PULSES = {"frequency_hz": 100, "duty": 0.5}
MODULATED = "+lighting.modulation.tail={frequency_hz: 100, duty: 0.5}"


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (
            ["isp=linear", "isp.capture=longg"],
            "isp.capture is 'longg'; expected the name of .*; type isp",
        ),
        (
            [
                *TARGETS,
                "lighting.moves=[sky]",
                "+lighting.targets.ambient={statistic: max, cd_m2: 1}",
            ],
            "no light group 'ambient'.*type ~lighting.targets.ambient",
        ),
        ([*TARGETS, "lighting.moves=[moon]"], "has no such light group"),
        (["lighting=weights", "+lighting.weights.tail=1"], "no light group 'tail'"),
        (
            ["lighting=weights", "+lighting.weights.sky=1", MODULATED],
            "'tail', which the scene does not have .*; type ~lighting.modulation.tail",
        ),
        (
            [*TARGETS, "lighting.moves=[sky]", "lighting.others=0", MODULATED],
            "'tail', which the scene does not have .*; type ~lighting.modulation.tail",
        ),
        (["lighting=iset"], "lighting iset needs the groups"),
        (
            ["isp.demosaic=learned", "sensor.cfa=CY/YM"],
            "filter array CY/YM, .*expected one of RG/GB, RG/WB, .*type isp.demosaic=guided",
        ),
        (
            ["scene=macbeth", "lens=diffraction_limited", "+flare@flare.w=windscreen"]
            + ["lens.distortion={model:brown_conrady,k1:-0.1}"],
            "windscreen and a lens that distorts",
        ),
        (
            ["lens=ideal", "lens.falloff=none", "scene.projection=equidistant"]
            + ["+flare@flare.d=drops"],
            "flare drops and a field in 'equidistant' projection",
        ),
        (["isp.demosaic=malvar", "sensor.cfa=RG/WB"], "'malvar' and the filter array RG/WB"),
        (["isp.demosaic=menon", "sensor=single"], "'menon' and the filter array W;"),
    ],
)
def test_a_plan_refuses_what_another_component_lacks(overrides, said, isethdr_home):
    with pytest.raises(ConfigError, match=said):
        print_plan([*CHART, *overrides])
    assert not isethdr_home.exists()


@pytest.mark.parametrize(
    "further",
    [
        ["~lighting.modulation.tail"],
        ["+lighting.weights.tail=0"],
        ["lighting.modulation.tail=null"],
    ],
)
def test_a_plan_takes_a_modulation_that_is_left_out_or_of_weight_0_by_name(further, isethdr_home):
    print_plan([*CHART, "lighting=weights", "+lighting.weights.sky=1", MODULATED, *further])


def test_a_modulated_group_of_the_scene_may_have_weight_0():
    lighting = build("lighting", "weights", weights={"sky": 1}, modulation={"lamps": PULSES})
    lighting.check_groups(("sky", "lamps"))


def test_the_command_ends_with_a_mistake_of_the_user(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["isethdr", "plan", *CHART, "isp=linear", "isp.capture=none"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith("error: isp.capture is 'none'")


def test_a_rendered_scene_tells_its_groups_before_it_is_built(isethdr_home):
    with pytest.raises(ConfigError, match="no light group 'ambient'.*headlights"):
        print_plan(["+lighting.targets.ambient={statistic: max, cd_m2: 1}"])


@pytest.mark.parametrize(
    "cell", ["RGGB", "BG/GR", "GRBG", "RG/WB", "WB/RG", "BW/GR", "GWRW/WBWG/BWGW/WGWR", "W"]
)
def test_every_shift_of_a_trained_array_is_taken(cell):
    isp = build("isp", "merge", demosaic="learned")
    isp.check_shot(build("sensor", "ideal", cfa=cell).shot_form())


def test_letters_that_no_filters_are_trained_for_are_refused(tmp_path):
    table = tmp_path / "qe.csv"
    table.write_text("wavelength_nm,X,Y,Z\n380,0.1,0.2,0.3\n780,0.1,0.2,0.3\n")
    sensor = build("sensor", "ideal", cfa="XY/YZ", qe_csv=str(table))
    with pytest.raises(ConfigError, match="XY/YZ.*expected one of RG/GB, RG/WB, WGWR/"):
        build("isp", "linear", demosaic="learned").check_shot(sensor.shot_form())


def offered(kind):
    """Return the names of the components of a kind."""
    return sorted(c.name for c in components().values() if c.kind == kind)


@pytest.mark.parametrize("name", offered("sensor"))
def test_the_form_of_a_shot_is_that_of_its_captures(name):
    from isethdr_core import generator
    from isethdr_core.conformance.inputs import irradiance

    sensor = build("sensor", name)
    assert isinstance(sensor, ListsCaptures)
    shot = sensor(irradiance(1e-3, 24, 24, 5e-6), generator())
    form = sensor.shot_form()
    assert tuple(shot["capture"].values.tolist()) == form.captures
    rows = len(form.filters)
    columns = len(form.filters[0])
    seen = shot["channel"].values[shot["filter"].values[:rows, :columns]]
    np.testing.assert_array_equal(seen, [list(row) for row in form.filters])


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        pytest.param("tunnel", {}, marks=pytest.mark.slow),
        pytest.param("night_drive", {}, marks=pytest.mark.slow),
        pytest.param("night_drive", {"street_lamps": (0, 0)}, marks=pytest.mark.slow),
        ("point_lights", {"width": 24, "height": 16}),
        ("uniform", {"width": 24, "height": 16}),
        ("macbeth", {"width": 24, "height": 16}),
    ],
)
def test_the_groups_a_scene_tells_are_those_it_has(name, fields):
    scene = build("scene", name, **fields)
    made = scene()
    described = isinstance(made, ListsGroups)
    has = made.light_groups() if described else tuple(made.light_group.values.tolist())
    assert scene.light_groups() == has


@pytest.mark.parametrize(
    ("method", "value", "said"),
    [
        ("camera_field", (0.4, 0.2), r"camera_field\(\) returned \(0.4, 0.2\); expected \(width"),
        ("camera_field", None, r"camera_field\(\) returned None"),
        ("camera_field", (0.4, 0.2, "fisheye"), "'tangent', 'equidistant'"),
        ("camera_field", (0.4, 0.0, "tangent"), "two numbers above 0"),
        ("tile_counts", None, r"tile_counts\(margin=False\) returned None; expected \(rows"),
        ("tile_counts", (0, 0), "1 or more"),
        ("tile_counts", (3.0,), "two whole numbers of tiles"),
        ("tile_counts", (0.3, 0.5), r"returned \(0.3, 0.5\); expected .*whole"),
        ("tile_counts", (True, 2), "whole numbers"),
        ("bands_nm", None, r"bands_nm\(\) returned None; expected .* ascending"),
        ("bands_nm", (), "at least one"),
        ("bands_nm", (460.0, 400.0), r"returned \(460.0, 400.0\)"),
        ("bands_nm", "abc", r"returned 'abc'"),
        ("bands_nm", (None,), r"returned \(None,\)"),
        ("bands_nm", np.array(5.0), r"returned array\(5"),
        ("bands_nm", (400.0, float("nan"), 500.0), "nan, 500.0.*finite"),
        ("narrow", None, r"narrow\(demand\) returned None; expected a Demand"),
        ("held_bytes", 1e6, r"held_bytes\(\) returned 1000000.0; expected {description: bytes}"),
        ("kernels", None, r"kernels\(\) returned None; expected {library"),
    ],
)
def test_a_statement_in_another_form_names_component_and_method(method, value, said):
    stating = type("Acme", (), {method: lambda self, *_, **__: value})()
    calls = {
        "camera_field": lambda: check_statements(stating, None),
        "tile_counts": lambda: check_statements(None, stating),
        "bands_nm": lambda: offered_nm(stating),
        "narrow": lambda: narrowed(stating, Demand()),
        "held_bytes": lambda: held_bytes(stating, (), None),
        "kernels": lambda: kernels(stating),
    }
    with pytest.raises(PluginError, match=f"Acme.*{said}"):
        calls[method]()


def test_kernels_are_asked_for_before_radiance_is_made(isethdr_home, monkeypatch, offer):
    # a class of its own: Python remembers which abilities a class has
    @dataclass(frozen=True)
    class NoKernels(components()["lens", "ideal"].cls):
        """A lens that states no kernels."""

        def kernels(self):
            return None

    offer("lens", "no_kernels", NoKernels)
    monkeypatch.setattr(runs, "scene_radiance", None)  # would fail in another way
    with pytest.raises(PluginError, match=r"kernels\(\) returned None"):
        runs.run(compose([*CHART, "lens=no_kernels", "report=false"]))
