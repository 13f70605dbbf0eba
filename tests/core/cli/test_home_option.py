"""The option `--home` may stand anywhere on the command line; a mistyped home is an error."""

from __future__ import annotations

import os

import pytest

from isethdr_core.cli import home_option
from isethdr_core.cli.home_option import command_of, use_home, use_homes, without_homes
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage import home_folder


@pytest.mark.parametrize(
    "typed",
    [
        ["--home", "a b", "run", "lens=ideal"],
        ["run", "--home=a b", "lens=ideal"],
        ["run", "lens=ideal", "--home", "a b"],
    ],
)
def test_the_option_is_taken_from_any_place(typed):
    assert without_homes(typed) == (["run", "lens=ideal"], ["a b"])


def test_without_the_option_nothing_changes():
    assert without_homes(["catalog", "find", "name=--home"]) == (
        ["catalog", "find", "name=--home"],
        [],
    )


@pytest.mark.parametrize("typed", [["run", "--home"], ["--home=", "run"], ["--home", "-m"]])
def test_a_home_that_is_missing_is_refused(typed):
    with pytest.raises(ConfigError, match="--home has no path"):
        without_homes(typed)


def test_a_command_that_writes_takes_one_home(monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    rest, homes = without_homes(["run", "--home=a", "--home", "b"])
    assert (rest, homes) == (["run"], ["a", "b"])
    with pytest.raises(ConfigError, match="typed 2 times, but isethdr run works in one home"):
        use_homes(homes, "run")
    assert os.environ["ISETHDR_HOME"] == "elsewhere"


@pytest.mark.parametrize("command", ["run", "sequence", "train", "experiments"])
def test_a_command_that_writes_makes_a_home_and_says_so(tmp_path, monkeypatch, capsys, command):
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    use_home(str(tmp_path / "new"), command)
    assert os.environ["ISETHDR_HOME"] == str(tmp_path / "new")
    assert capsys.readouterr().err == f"new home folder:\n{tmp_path / 'new'}\n"
    (tmp_path / "new/runs").mkdir(parents=True)
    use_home(str(tmp_path / "new"), command)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("typed", [["dataset", "list"], ["dataset", "report", "night"]])
def test_a_subcommand_that_reads_makes_no_home(tmp_path, monkeypatch, capsys, typed):
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    with pytest.raises(CatalogError, match="there is no folder"):
        use_home(str(tmp_path / "new"), command_of(typed))
    assert capsys.readouterr().err == ""
    assert command_of(["dataset", "generate", "night"]) == "dataset"


def test_a_home_with_a_network_alone_is_a_home(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    (tmp_path / "new/training").mkdir(parents=True)
    for command in ("train", "run", "catalog"):
        use_home(str(tmp_path / "new"), command)
    assert capsys.readouterr().err == ""


def test_a_home_with_an_array_alone_is_a_home(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    (tmp_path / "new/arrays").mkdir(parents=True)
    for command in ("run", "catalog"):
        use_home(str(tmp_path / "new"), command)
    assert capsys.readouterr().err == ""
    # other programs have a folder of this name too
    (tmp_path / "new/letters").mkdir()
    with pytest.raises(CatalogError, match="no home folder"):
        use_home(str(tmp_path / "new"), "catalog")


@pytest.mark.parametrize("command", ["run", "catalog"])
def test_a_folder_of_other_files_is_no_home(tmp_path, monkeypatch, command):
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters/to_you").write_text("hello")
    expected = "expected a home folder" if command in home_option.MAKES_HOMES else "no home folder"
    with pytest.raises((ConfigError, CatalogError), match=expected):
        use_home(str(tmp_path / "letters"), command)


def test_a_mistyped_home_names_the_one_beside_it(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    (tmp_path / "my_home/runs").mkdir(parents=True)
    with pytest.raises(CatalogError, match="did you mean .*my_home'.*--home PATH"):
        use_home(str(tmp_path / "my_hone"), "catalog")


@pytest.mark.parametrize("command", ["run", "catalog"])
def test_a_home_without_permission_to_read_is_one_line(tmp_path, monkeypatch, command):
    def refused(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    monkeypatch.setattr(home_folder.os, "listdir", refused)
    with pytest.raises(CatalogError, match=f"no permission to read {tmp_path}.*; type --home PATH"):
        use_home(str(tmp_path), command)


def test_a_plan_accepts_a_home_that_is_not_there_yet(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    use_home(str(tmp_path / "new"), "plan")
    assert os.environ["ISETHDR_HOME"] == str(tmp_path / "new")
    assert not (tmp_path / "new").exists() and capsys.readouterr().err == ""


def test_a_missing_further_home_names_its_variable(tmp_path, monkeypatch):
    (tmp_path / "home/runs").mkdir(parents=True)
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("ISETHDR_OTHER_HOMES", f" {tmp_path / 'home'} \n")
    assert len(home_folder.existing_homes()) == 1, "spaces around a path are no part of it"
    monkeypatch.setenv("ISETHDR_OTHER_HOMES", "relative")
    with pytest.raises(CatalogError, match="relative, which ISETHDR_OTHER_HOMES .*_HOMES=/path$"):
        home_folder.existing_homes()
