"""The command line: quick help, one-line errors, exit codes, and commands of plugins."""

from __future__ import annotations

import errno
import io
import re

import pytest
from omegaconf import OmegaConf

import isethdr_core
from isethdr_core.cli.commands import main
from isethdr_core.cli.plan_summary import print_plan
from isethdr_core.cli.plugin_list import print_plugins
from isethdr_core.cli.run_help import print_run_help
from isethdr_core.config.composition import compose
from isethdr_core.config.main_config import settings
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.component import KINDS
from isethdr_core.plugins.ranges import on_command_line
from isethdr_core.plugins.registry import BrokenPlugin

from ..command_line import here, isethdr, write_plugin

SENSOR = '''
from dataclasses import dataclass
from isethdr_core import Component, hookimpl

@dataclass(frozen=True)
class Copy:
    """A sensor of the same name as another."""

    def __call__(self, light, generator):
        return light

@hookimpl
def {hook}():
    return [Component("sensor", "{name}", Copy)]
'''
SMALL = [
    "scene=uniform",
    "scene.width=24",
    "scene.height=16",
    "scene.horizontal_field_deg=2",
    "~renderer",
    "lighting=ideal",
    "~versions",
    "lens=ideal",
    "~flare.dirt",
    "isp=linear",
    "~metric.contrast",
]


def test_help_is_there_and_names_the_commands(monkeypatch, capsys):
    code, out, err = here(monkeypatch, capsys, "--help")
    assert code == 0 and not err
    assert all(
        re.search(rf"^\s+{name}\b", out, re.MULTILINE)
        for name in ("run", "plan", "plugins", "doctor")
    )


def test_plugins_lists_components_presets_and_packages(monkeypatch, capsys):
    code, out, _ = here(monkeypatch, capsys, "plugins", "sensor")
    assert code == 0
    assert {"bayer", "bayer_imx363"} <= {line.strip() for line in out.splitlines()}
    assert "(isethdr_sensors)" in out and "lens" not in out.split("\n")[0]
    code, _, err = here(monkeypatch, capsys, "plugins", "sensr")
    assert code == 2 and err.startswith("error: unknown kind 'sensr'; did you mean 'sensor'")


def test_the_version_is_that_of_the_package(monkeypatch, capsys):
    _, out, _ = here(monkeypatch, capsys, "--version")
    assert out == f"isethdr {isethdr_core.__version__}\n"


def test_help_and_lists_fit_80_columns(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    print_run_help()
    print_plugins("sensor")
    print_plugins("lens", "wavefront")
    print_plugins("sensor", "bayer_imx363")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) > 200 and max(map(len, lines)) <= 80


def test_the_help_of_run_names_every_kind_and_setting(capsys):
    print_run_help()
    shown = capsys.readouterr().out
    assert all(f"\n  {kind} " in shown for kind in KINDS)
    config = compose()
    for setting in settings():
        assert f"\n  {setting.name}={setting.default}\n      {setting.meaning[:20]}" in shown
        assert on_command_line(OmegaConf.select(config, setting.name)) == setting.default


def test_a_field_is_shown_with_all_that_is_known_of_it(capsys):
    assert print_plugins("sensor", "bayer") == 0
    shown = capsys.readouterr().out
    assert "defined by ImagingSensor in isethdr_sensors.imaging_sensor" in shown
    assert "\n  exposure_s=0.016  [1e-09 to 3600 s]\n      exposure time" in shown
    assert "  exposure_speed_m_s=0.0  [0 to 200 m/s]" in shown
    assert "[fixed, centre, histogram, percentile, highlights]" in shown
    assert "presets of bayer" in shown and "sets pitch_um=1.4" in shown


def test_a_preset_is_shown_with_what_it_sets_and_its_component(capsys):
    print_plugins("sensor", "typical_rgbw")
    shown = capsys.readouterr().out
    assert "(from typical_bayer)" in shown and "\n  cfa=RG/WB\n" in shown
    assert "component dual_gain" in shown
    # settings of typical_bayer apply too, and the list of fields shows them
    assert "\n  pitch_um=3.0  (set by typical_bayer)\n" in shown
    assert "\n  pitch_um=3.0  [0.05 to 100000 um]  (default 2.8)\n" in shown
    assert "\n  black_dn=64.0  [0 to 16777216 DN]\n" in shown
    with pytest.raises(ConfigError, match="did you mean 'bayer'"):
        print_plugins("sensor", "bayr")


def test_a_mistake_is_one_line():
    """tests/workflows/test_failures.py tests other mistakes, all in one process."""
    shown = isethdr("run", *SMALL, "sensor=rgwb")
    assert shown.returncode == 2
    lines = shown.stderr.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: ") and "did you mean 'rgbw'" in lines[0]


def test_a_choice_by_interpolation_is_refused():
    """Hydra would resolve the choice to nothing, and its message would name internal keys."""
    with pytest.raises(ConfigError, match=r"^sensor is '\$\{seed\}'; expected a name"):
        compose([*SMALL, "sensor=${seed}"])


@pytest.mark.slow
def test_run_and_plan(isethdr_home, capsys):
    # leave out the report: its plots take as long as all other steps together
    quick = {"ISETHDR_PLUGINS": "core,scenes,mitsuba,optics,sensors,isp,metrics,workflows"}
    # tests/workflows/test_command_and_python.py tests what the command itself does
    print_plan([*SMALL, "sensor=bayer"])
    assert "light groups" in capsys.readouterr().out and not (isethdr_home / "runs").exists()
    first = isethdr("run", *SMALL, "sensor=bayer", **quick)
    assert (
        first.returncode == 0
        and "sensor bayer" in first.stdout
        and "log_luminance_error" in first.stdout
    )
    [stored] = (isethdr_home / "runs").glob("*.zarr")
    assert str(stored) in first.stdout
    print_plan([*SMALL, "sensor=bayer"])
    assert "is stored" in capsys.readouterr().out


NO_ARGUMENT = """
from isethdr_core import hookimpl

@hookimpl
def isethdr_before_stage(stage, weather):
    pass
"""
BROKEN = {
    "broken_acme": ("raise RuntimeError('no licence')", ["RuntimeError: no licence"]),
    "thawed": (
        SENSOR.format(hook="isethdr_components", name="acme").replace("frozen=True", ""),
        ["must be a frozen dataclass"],
    ),
    "mumble": (
        SENSOR.format(hook="isethdr_component", name="acme"),
        ["unknown hook 'isethdr_component'; did you mean 'isethdr_components'"],
    ),
    "rainy": (NO_ARGUMENT, ["weather"]),
}


@pytest.fixture(scope="module")
def beside_broken(tmp_path_factory):
    """Return the finished command `isethdr plugins sensor`, with all of `BROKEN` installed."""
    folder = tmp_path_factory.mktemp("broken")
    for package, (source, _) in BROKEN.items():
        write_plugin(folder, package, source)
    return isethdr("plugins", "sensor", plugins=[folder])


@pytest.mark.parametrize("package", BROKEN)
def test_a_broken_plugin_is_one_loud_line_and_not_a_crash(beside_broken, package):
    assert beside_broken.returncode == 0 and "bayer" in beside_broken.stdout
    said = beside_broken.stdout.splitlines()
    [loud] = [line for line in said if line.startswith(f"broken plugin {package} ")]
    assert all(words in loud for words in BROKEN[package][1])
    assert sum(f"'{package}'" in line for line in beside_broken.stderr.splitlines()) == 1
    assert "Traceback" not in beside_broken.stderr


def test_a_broken_plugin_is_an_error_if_asked(monkeypatch, capsys):
    strict = ("plugins", "sensor", "--strict")
    assert here(monkeypatch, capsys, *strict)[0] == 0
    broken = BrokenPlugin("acme", "acme", "no licence")
    monkeypatch.setattr("isethdr_core.plugins.registry.broken_plugins", lambda: (broken,))
    assert here(monkeypatch, capsys, *strict)[0] == 1
    assert here(monkeypatch, capsys, *strict[:2])[0] == 0


@pytest.mark.slow
def test_two_plugins_of_the_same_name_are_both_named(tmp_path):
    folder = write_plugin(
        tmp_path, "copycat", SENSOR.format(hook="isethdr_components", name="bayer")
    )
    shown = isethdr("plugins", plugins=[folder])
    assert shown.returncode == 2
    assert shown.stderr.strip().splitlines()[-1].startswith("error: two plugins offer sensor/bayer")
    assert "copycat" in shown.stderr and "isethdr_sensors" in shown.stderr
    without = isethdr("plugins", "sensor", plugins=[folder], ISETHDR_PLUGINS="core,sensors")
    assert without.returncode == 0


@pytest.mark.slow
def test_two_packages_may_call_their_entry_point_the_same(tmp_path):
    for package, sensor in (("one_acme", "nano"), ("two_acme", "pico")):
        source = SENSOR.format(hook="isethdr_components", name=sensor)
        folder = write_plugin(tmp_path, package, source, entry_point="acme")
    shown = isethdr("plugins", "sensor", plugins=[folder])
    assert shown.returncode == 0 and "broken" not in shown.stdout + shown.stderr
    listed = {line.split()[0] for line in shown.stdout.splitlines() if line.startswith("  ")}
    assert {"nano", "pico", "bayer"} <= listed
    without = isethdr("plugins", "sensor", plugins=[folder], ISETHDR_PLUGINS="core,sensors")
    assert "nano" not in without.stdout and "pico" not in without.stdout


def test_plan_has_a_help_of_its_own(monkeypatch, capsys):
    code, out, err = here(monkeypatch, capsys, "plan", "--help")
    assert code == 0 and "plan [override ...]" in " ".join(out.split()) and not err


def test_plugins_can_be_chosen():
    shown = isethdr("plugins", "sensor", ISETHDR_PLUGINS="core,optics")
    assert shown.returncode == 0 and "bayer" not in shown.stdout


def test_a_disk_that_cannot_be_written_is_one_line(monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device", "/data/x.csv")

    monkeypatch.setattr("isethdr_core.cli.plan_summary.print_plan", full)
    code, _, said = here(monkeypatch, capsys, "plan")
    assert code == 2 and said.count("\n") == 1
    assert "cannot read or write /data/x.csv: No space left on device" in said


@pytest.mark.parametrize(
    ("errors", "written"),
    [
        ("strict", b"1 ? 2\n"),
        ("surrogateescape", b"1 ? 2\n"),  # of the locale C
        ("xmlcharrefreplace", b"1 &#177; 2\n"),  # from PYTHONIOENCODING
    ],
)
def test_a_character_that_the_encoding_lacks_is_a_question_mark(monkeypatch, errors, written):
    out = io.TextIOWrapper(io.BytesIO(), encoding="ascii", errors=errors)
    monkeypatch.setattr("sys.stdout", out)
    monkeypatch.setattr("sys.argv", ["isethdr", "catalog", "sql", "x"])
    monkeypatch.setattr("isethdr_core.cli.commands._with_plugins", lambda _: lambda: print("1 ± 2"))
    main()
    out.flush()
    assert out.buffer.getvalue() == written


@pytest.mark.parametrize(
    "typed",
    [
        ["run"],
        ["run", "-m", "seed=1,2"],
        ["plan"],
        ["--home", "rel"],
        ["catalog", "find"],
        ["catalog", "rm", "1f3a"],
    ],
)
def test_a_working_folder_that_was_deleted_is_one_line(monkeypatch, tmp_path, capsys, typed):
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    monkeypatch.delenv("ISETHDR_HOME", raising=False)
    folder.rmdir()
    code, _, said = here(monkeypatch, capsys, *typed)
    assert code == 2 and said.count("\n") == 1
    assert "the working folder was deleted; expected a folder that exists" in said
