"""Sweeps (`-m`) are prepared for Hydra: values are listed, and fields of swept components kept."""

from __future__ import annotations

import re
from contextlib import nullcontext
from pathlib import Path

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from isethdr_core.config import hydra_app, sweeps
from isethdr_core.config.composition import register_with_hydra
from isethdr_core.config.hydra_app import run_with_hydra
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.presets import presets

from ..command_line import here, isethdr


@pytest.fixture
def tried(monkeypatch, tmp_path, isethdr_home):
    """Return the list of jobs that are tried in an empty working folder. None of them is built."""
    register_with_hydra()
    jobs = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sweeps, "compose", lambda job: jobs.append(job) or {})
    monkeypatch.setattr(sweeps, "chain", lambda config: None)
    return jobs


def test_a_pattern_sweeps_over_the_names_that_it_matches(tried):
    sweep = sweeps.prepared(["-m", "sensor=glob(typical_*)"]).sweep
    names = sorted(name for name in presets("sensor") if name.startswith("typical_"))
    assert len(names) > 1 and sweep.total == len(names) and sweep.varied == ("sensor",)
    assert tried == [[f"sensor={name}"] for name in names]


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("sensor=glob(no_such_*)", "has no value; expected one or more"),
        ("seed=range(0,0)", r"seed=range\(0,0\) has no value; .* type for example seed=1,2"),
        ("seed=interval(0,1)", "is an interval, .* type for example seed=1,2"),
        ("hydra.sweeper.params.seed='1,2'", "cannot be set by an override; .* seed=1,2"),
        ("+hydra.sweeper.params.seed='1,2'", "cannot be set by an override; .* seed=1,2"),
        ("name=a,b", "name=a,b sweeps over the name; .* type for example name=night"),
    ],
)
def test_values_that_cannot_be_listed_are_refused_before_the_first_job(tried, typed, message):
    with pytest.raises(ConfigError, match=message):
        sweeps.prepared(["-m", typed])
    assert not tried


@pytest.mark.parametrize(
    ("typed", "field"),
    [
        ("flare@flare.dirt=haze,film", "flare.dirt.scattered=0.01"),
        ("+flare@flare.veil=haze,film", "flare.veil.scattered=0.01"),
        ("experiment=night_drive,tunnel", "lens.f_number=2"),
        ("sensor=bayer,rgbw", "sensor.bits=12"),
    ],
)
def test_a_field_of_a_swept_component_is_a_sweep_of_one_value(tried, typed, field):
    key, _, value = field.partition("=")
    arguments = sweeps.prepared(["-m", typed, field, "lighting=ideal", "seed=1"]).arguments
    assert arguments[:-1] == ["-m", typed, f"{key}=choice({value})", "lighting=ideal", "seed=1"]
    kept = sweeps.prepared(["-m", "seed=1,2", field]).arguments
    assert field in kept, "a component that is not swept owns its field"


def test_values_of_a_config_file_are_part_of_the_sweep(tried, tmp_path):
    mine = tmp_path / "conf" / "experiment" / "mine.yaml"
    mine.parent.mkdir(parents=True)
    text = "# @package _global_\nhydra: {sweeper: {params: {seed: '1,2', draws: '2,3,4'}}}\n"
    mine.write_text(text)
    ready = sweeps.prepared(["-m", "experiment=mine", "seed=7"])
    assert ready.sweep.varied == ("draws",) and ready.sweep.total == 3
    assert ready.sweep.overrides == ("draws=2,3,4", "experiment=mine", "seed=7")
    assert ready.arguments[1:3] == ["experiment=mine", "seed=7"], "Hydra adds the others itself"


def test_a_sweep_from_another_folder_has_a_name_and_a_record(tried, tmp_path):
    folder = tmp_path / "studies"
    folder.mkdir()
    ready = sweeps.prepared(["-m", "--config-dir", str(folder), "name=night", "seed=1,2"])
    assert ready.sweep.name == "night" and ready.sweep.total == 2
    assert ready.arguments[:4] == ["-m", "--config-dir", str(folder), "seed=1,2"]
    assert not tried, "Hydra alone reads that folder"
    shown = ["-m", "--cfg", "job", "seed=1,2"]
    assert sweeps.prepared(shown) == sweeps.Prepared(shown, None)


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("scene=macbet", "scene 'macbet' is not installed; did you mean 'macbeth'"),
        ("~metric.foo", "metric.foo cannot be left out"),
        ("hydra/launcher=submitit_slurn", r"'submitit_slurn' is not installed[^`]*$"),
        ("hydra/sweeper=foo", r"hydra/sweeper 'foo' is not installed[^`]*$"),
        ("+hydra.sweeper.params={seed:'1,2'}", "cannot be set by an override; .* seed=1,2"),
        ("seed=range(1,3,0)", "composed: range.. arg 3 must not be zero$"),
    ],
)
def test_a_mistake_beside_own_presets_is_a_mistake_of_the_user(
    monkeypatch, tmp_path, isethdr_home, typed, message
):
    (tmp_path / "conf").mkdir()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=message):
        run_with_hydra(["-m", "sensor=bayer", typed])


def test_an_abbreviated_option_starts_a_sweep_with_a_record(monkeypatch, tried):
    begun = []
    monkeypatch.setattr(hydra_app, "begin", begun.append)
    monkeypatch.setattr(hydra_app, "_start_hydra", lambda sweeping: 0)
    monkeypatch.setattr(sweeps, "finish", begun.append)
    monkeypatch.setattr(sweeps, "watched", lambda sweep: nullcontext())
    monkeypatch.setattr(hydra_app, "exit_on_sigterm", lambda: None)
    monkeypatch.setattr("sys.argv", ["isethdr"])
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
    run_with_hydra(["--multi", "name=night", "seed=1,2"])
    assert [sweep.name for sweep in begun] == ["night", "night"]


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        (["hydra.mode=MULTIRUN"], "expected -m for a sweep; type isethdr run -m, .* hydra.mode$"),
        (["++hydra.mode=RUN", "-m"], "expected -m for a sweep; .* or isethdr run for a single run"),
        (["hydra.sweep.dir=/here"], "expected a name; type for example name=night"),
        (["-m", "hydra.sweep.dir=/here"], "expected a name; type for example name=night"),
        (["hydra.sweep.dir=/here", "hydra.mode=MULTIRUN"], "expected a name"),
    ],
)
def test_a_sweep_without_a_record_is_refused(monkeypatch, capsys, isethdr_home, typed, message):
    code, _, said = here(monkeypatch, capsys, "run", "sensor=bayer", "seed=1,2", *typed)
    [line] = said.splitlines()
    assert code == 2 and re.search(message, line)
    assert not isethdr_home.exists()


def test_a_sweep_that_a_config_file_asks_for_is_refused(tmp_path, isethdr_home):
    (tmp_path / "conf" / "experiment").mkdir(parents=True)
    config = "# @package _global_\nhydra:\n  mode: MULTIRUN\n"
    (tmp_path / "conf" / "experiment" / "own.yaml").write_text(config)
    folder = str(tmp_path / "conf")
    choices = ("sensor=bayer", "experiment=own")
    done = isethdr("run", "--config-dir", folder, *choices, ISETHDR_TRUST=folder)
    assert done.returncode == 2
    assert "remove hydra.mode from the file and type isethdr run -m" in done.stderr.splitlines()[-1]


@pytest.mark.parametrize(
    "path", ["/a b=c,d", "/it's", "/back\\slash", "/end\\", "/x\\'y", "/\\\\'", '/"']
)
def test_hydra_reads_the_folder_of_a_sweep_as_it_is(path):
    [override] = OverridesParser.create().parse_overrides(
        [f"hydra.sweep.dir={sweeps._quoted(Path(path))}"]
    )
    assert override.value() == path
