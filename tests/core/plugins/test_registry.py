"""Looking components up and building them from plain values."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from typing import Literal

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from isethdr_core import Component
from isethdr_core.component import KINDS
from isethdr_core.errors import ConfigError, PluginError
from isethdr_core.plugins.registry import (
    _check,
    broken_plugins,
    build,
    build_from_config,
    components,
    package_of_component,
    plugin_manager,
    reads_as_value,
)

from ..command_line import isethdr, write_plugin


@dataclass(frozen=True)
class Nano:
    """A sensor with fields of every form."""

    read_noise_e: float = 2.5
    rows: int = 8
    adc: Literal["ramp", "sar"] = "ramp"
    dead_pixels: tuple[tuple[int, int], ...] = ()
    fill_factor: tuple[float, float] = (1.0, 0.1)

    def __call__(self, light, generator):
        return light


@pytest.fixture(autouse=True)
def nano(offer):
    return offer("sensor", "nano", Nano)


def test_lists_become_tuples():
    made = build("sensor", "nano", dead_pixels=[[3, 4], [5, 6]], fill_factor=[1, 0.5])
    assert made == Nano(dead_pixels=((3, 4), (5, 6)), fill_factor=(1.0, 0.5))
    assert isinstance(made.fill_factor[0], float)
    hash(made)


def test_a_component_without_a_name_says_how_to_choose_one():
    """`metric.ssim=ssim_pu21` sets a text where a table is expected."""
    with pytest.raises(ConfigError, match="metric@TABLE.KEY=<name> for an entry of a table"):
        build_from_config("metric", "ssim_pu21")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"read_noise": 1.0}, "no field 'read_noise'; did you mean 'read_noise_e'"),
        ({"read_noise_e": "loud"}, "read_noise_e is 'loud'; expected a valid number"),
        ({"adc": "flash"}, "adc is 'flash'; expected 'ramp' or 'sar'"),
        ({"rows": 1.5}, "rows is 1.5; expected a valid integer"),
        ({"dead_pixels": [[1, 2, 3]]}, "dead_pixels"),
        ({"fill_factor": [1.0]}, "fill_factor"),
    ],
)
def test_wrong_fields_are_named(fields, message):
    with pytest.raises(ConfigError, match=message):
        build("sensor", "nano", **fields)


def test_unknown_names_suggest_the_nearest():
    with pytest.raises(ConfigError, match="sensor 'nanoo' is not installed; did you mean 'nano'"):
        build("sensor", "nanoo")
    with pytest.raises(ConfigError, match="unknown kind 'lense'; did you mean 'lens'"):
        build("lense", "ideal")
    with pytest.raises(ConfigError, match="no name"):
        build_from_config("sensor", {"read_noise_e": 1.0})
    assert build_from_config("sensor", {"name": "nano", "rows": 4}) == Nano(rows=4)


def test_what_a_component_must_be():
    @dataclass
    class Thawed:
        """Not frozen."""

    @dataclass(frozen=True)
    class NoDefault:
        """A field without a default."""

        rows: int

    @dataclass(frozen=True)
    class Named:
        """A field with the name of a key that the config needs."""

        name: str = "a"

        def __call__(self, picture, truth, labels):
            return []

    for comp, message in (
        (Component("metric", "x", Named), "a field is called 'name', .* for example metric_name"),
        (Component("sensor", "x", Thawed), "must be a frozen dataclass"),
        (Component("sensor", "x", int), "must be a frozen dataclass"),
        (Component("sensor", "x", NoDefault), "'rows' has no default"),
        (Component("sensr", "x", Nano), "unknown kind; did you mean 'sensor'"),
        (Component("sensor", 3, Nano), "a sensor has the name 3"),
        (Component("sensor", "", Nano), "a sensor has the name ''"),
        ("nano", "expected isethdr_core.Component"),
        (Component("sensor", "x", "acme.Nano"), 'expected a class or "package.module:Class"'),
        (Component("sensor", "x", None), 'expected a class or "package.module:Class"'),
    ):
        with pytest.raises(PluginError, match=message):
            _check(comp)


def test_a_component_whose_name_cannot_be_typed_is_left_out_alone(tmp_path):
    names = {"p p/x": "expected letters", "Null": "reads as a value", "1e5": "reads as a value"}
    offered = ", ".join(f"Component('metric', {name!r}, Zero)" for name in (*names, "zero"))
    source = (
        "from dataclasses import dataclass\nfrom isethdr_core import Component, hookimpl\n"
        "@dataclass(frozen=True)\nclass Zero:\n"
        "    def __call__(self, picture, truth, labels):\n        return []\n"
        f"@hookimpl\ndef isethdr_components():\n    return [{offered}]\n"
    )
    write_plugin(tmp_path, "acme_names", source)
    done = isethdr("plugins", "metric", plugins=[tmp_path])
    assert done.returncode == 0 and "zero" in done.stdout
    for name, said in names.items():
        assert f"has the name {name!r}" in done.stderr and said in done.stderr


def test_built_ins_come_through_the_same_entry_points():
    assert {name for name, _ in plugin_manager().list_name_plugin()} >= {
        "core",
        "scenes",
        "mitsuba",
        "optics",
        "sensors",
        "isp",
        "metrics",
    }
    assert broken_plugins() == ()
    assert {kind for kind, _ in components()} == set(KINDS)
    assert {package_of_component(c) for (_, name), c in components().items() if name != "nano"} == {
        "isethdr_core",
        "isethdr_scenes",
        "isethdr_mitsuba",
        "isethdr_optics",
        "isethdr_sensors",
        "isethdr_isp",
        "isethdr_metrics",
    }


def test_spaces_between_the_names_of_plugins_do_not_matter(monkeypatch):
    monkeypatch.setenv("ISETHDR_PLUGINS", "core, isp")
    loaded = [name for name, _ in plugin_manager.__wrapped__().list_name_plugin()]
    assert sorted(loaded) == ["core", "isp"]


def test_a_name_in_isethdr_plugins_that_no_package_offers_is_a_warning(monkeypatch, caplog):
    monkeypatch.setenv("ISETHDR_PLUGINS", "core, sensor,")
    loaded = [name for name, _ in plugin_manager.__wrapped__().list_name_plugin()]
    assert loaded == ["core"]
    [said] = [record.getMessage() for record in caplog.records]
    assert said.startswith(
        "ISETHDR_PLUGINS names 'sensor', which no installed package offers; did you mean 'sensors'?"
    )


def test_a_class_registered_by_its_place_is_imported_on_use():
    code = """
import sys
from isethdr_core.plugins.registry import build, class_of, components
comp = components()["isp", "merge"]
assert comp.target == "isethdr_isp.merge:MergeIsp" and comp.package == "isethdr_isp"
assert comp.class_name == "MergeIsp"
assert not {"isethdr_isp.merge", "numpy", "xarray"} & set(sys.modules)
made = build("isp", "merge")
assert type(made) is comp.cls is class_of(comp) and type(made).__module__ == "isethdr_isp.merge"
from isethdr_isp import MergeIsp
assert MergeIsp is comp.cls
try:
    from isethdr_isp import MergedIsp
except ImportError as err:
    assert "MergedIsp" in str(err)
else:
    raise AssertionError("a class that nobody offers was found")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_hydra_imports_the_chosen_components_alone():
    code = """
import sys
from isethdr_core import compose
compose(["scene=uniform", "~renderer", "lens=ideal", "~flare.dirt", "sensor=bayer"])
assert "isethdr_sensors.bayer" in sys.modules
assert not {"isethdr_sensors.lofic", "isethdr_scenes.tunnel"} & set(sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_class_that_does_not_load_is_said_with_its_package(offer):
    offer("lens", "lost", "acme_lost.lenses:Lost")
    with pytest.raises(PluginError, match="lens/lost of package 'acme_lost' did not load"):
        build("lens", "lost")


def test_names_that_the_command_line_reads_as_values_are_those_of_hydra():
    parser = OverridesParser.create()
    for name in ("null", "TRUE", "false", "nan", "Inf", "5", "1.5", "1e5", "1_000", "5."):
        assert not isinstance(parser.parse_override(f"sensor={name}").value(), str), name
        assert reads_as_value(name), name
    for name in ("on", "none", "e5", "007", "0_1", "5a", "a-b", "a.b", "_a", "infinity", "nano"):
        assert parser.parse_override(f"sensor={name}").value() == name
        assert not reads_as_value(name), name


def test_plugins_that_exit_are_left_out_and_the_others_work(tmp_path):
    """`quits` ends the process while it is imported, `lazy` while it lists its components."""
    (tmp_path / "acme_quits.py").write_text("raise SystemExit(5)\n")
    (tmp_path / "acme_lazy.py").write_text(
        "import sys\nfrom isethdr_core import hookimpl\n"
        "@hookimpl\ndef isethdr_components():\n    sys.exit(3)\n"
    )
    for name in ("acme_quits", "acme_lazy"):
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[isethdr]\n{name} = {name}\n")
    done = isethdr("plugins", "isp", plugins=[tmp_path])
    assert done.returncode == 0, done.stderr
    assert "linear" in done.stdout
    told = " ".join((done.stdout + done.stderr).split())
    assert "SystemExit: 5; it must not exit while it loads" in told
    assert "SystemExit: 3; it must not exit while it loads" in told


def test_a_class_whose_module_exits_is_said_with_its_package(offer, tmp_path, monkeypatch):
    (tmp_path / "acme_exits.py").write_text("raise SystemExit(5)\n")
    monkeypatch.syspath_prepend(tmp_path)
    offer("lens", "exits", "acme_exits:Lens")
    with pytest.raises(PluginError, match="lens/exits of package 'acme_exits' did not load .*: 5;"):
        build("lens", "exits")
