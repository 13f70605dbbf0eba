"""Config files are code. Files from outside the working folder are refused before Hydra opens them,
unless their folder is trusted.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

import isethdr_core as hdr
from isethdr_core.config import trust
from isethdr_core.errors import ConfigError

from ..cli.test_commands import SMALL
from ..command_line import isethdr

HARMFUL = """# @package _global_
seed: 7
hydra:
  callbacks:
    harm:
      _target_: builtins.open
      file: {mark}
      mode: w
"""


@pytest.fixture
def work(tmp_path: Path, monkeypatch) -> Path:
    """Return a working folder. A stranger's folder lies next to it; each has an experiment that
    creates the file `mark`.
    """
    monkeypatch.delenv(trust.VARIABLE, raising=False)
    for owner in ("work/conf", "stranger"):
        folder = tmp_path / owner / "experiment"
        folder.mkdir(parents=True)
        (folder / "mine.yaml").write_text(HARMFUL.format(mark=tmp_path / "mark"))
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "work"


def stranger(work: Path) -> Path:
    return work.parent / "stranger"


def test_files_of_the_working_folder_compose(work):
    assert hdr.compose([*SMALL, "sensor=bayer", "experiment=mine"]).seed == 7


def ways(work: Path) -> list[list[str]]:
    """Return lists of arguments; each list would load the stranger's experiment."""
    there = stranger(work)
    name = "experiment=mine"
    return [
        ["--config-dir", str(there), name],
        [f"--config-dir={there}", name],
        ["-cd", str(there), name],
        ["-cd", "../stranger", name],
        ["--config-path", str(there), "--config-name", "experiment/mine"],
        [f"hydra.searchpath=[file://{there}]", name],
        [f"hydra.searchpath=['{there}']", name],
        [f"hydra.searchpath=[{there}]", name],
        [f"+hydra.searchpath=[pkg://isethdr_core.config.conf,file://{there}]", name],
        ["hydra.searchpath=[file://conf/../../stranger]", name],
        ["experiment=../../../stranger/experiment/mine"],
        ["experiment='../../../stranger/experiment/mine'"],
        ["experiment=[../../../stranger/experiment/mine]"],
        ["experiment=mine,../../../stranger/experiment/mine", "-m"],
        ["+scene@scene=../../../stranger/experiment/mine"],
        ["--experimental-rerun", str(there / "config.pickle")],
        ["--config-name", "../../stranger/experiment/mine"],
    ]


def test_files_of_a_stranger_are_refused_by_every_way(work):
    for arguments in ways(work):
        with pytest.raises(ConfigError, match=r"ISETHDR_TRUST"):
            trust.check_arguments([*SMALL, *arguments])
        overrides = [a for a in arguments if not a.startswith("-")]
        if len(overrides) == len(arguments):
            with pytest.raises(ConfigError, match=r"ISETHDR_TRUST"):
                hdr.compose([*SMALL, *overrides])


def test_a_folder_that_is_named_is_trusted_with_all_below_it(work, monkeypatch):
    monkeypatch.setenv(trust.VARIABLE, f"/nowhere:{stranger(work)}")
    trust.check_arguments(["--config-dir", str(stranger(work)), "experiment=mine"])
    trust.check_folder(stranger(work) / "experiment")
    with pytest.raises(ConfigError, match="not trusted"):
        trust.check_folder(work.parent)
    overrides = [*SMALL, "sensor=bayer", f"hydra.searchpath=[file://{stranger(work)}]"]
    assert hdr.compose([*overrides, "experiment=mine"]).seed == 7


def test_installed_packages_and_ordinary_overrides_need_no_trust(work):
    trust.check_arguments(["hydra.searchpath=[pkg://isethdr_core.config.conf]", "sensor=rgbw"])
    typed = ["+lighting.weights.sky=1", "~renderer", "scene.folder=../scenes", "seed=1,2"]
    trust.check_overrides(OverridesParser.create().parse_overrides(typed))


def test_the_command_refuses_before_anything_of_the_file_runs(work):
    from_there = ["--config-dir", str(stranger(work)), "experiment=mine"]
    arguments = [*from_there, *SMALL, "sensor=bayer"]
    refused = isethdr("run", *arguments)
    [line] = refused.stderr.splitlines()
    assert refused.returncode == 2 and line.startswith("error: config files in")
    assert not (work.parent / "mark").exists()


@pytest.mark.slow
def test_a_trusted_file_runs_what_it_names(work):
    from_there = ["--config-dir", str(stranger(work)), "experiment=mine"]
    arguments = [*from_there, *SMALL, "sensor=bayer"]
    trusted = isethdr("run", *arguments, ISETHDR_TRUST=str(stranger(work)))
    assert trusted.returncode == 0 and (work.parent / "mark").exists(), "a config file is code"


def test_the_variable_to_type_is_quoted_for_the_shell(tmp_path):
    with pytest.raises(ConfigError, match="type ISETHDR_TRUST='[^']*/my files' before"):
        trust.check_folder(tmp_path / "my files")
