"""The command `isethdr study`, and the study of published figures."""

import csv
import inspect

import pytest
import typer
from isethdr_workflows import STUDIES, study_command
from isethdr_workflows.sensors.published_figures import published_figures
from isethdr_workflows.study_command import function_of, parameters_of, run_study, study
from typer.testing import CliRunner

from isethdr_core.errors import CatalogError, ConfigError


@pytest.fixture
def app():
    app = typer.Typer()
    app.command("study")(study)
    app.command("other")(lambda: None)  # so that `study` stays a command by name
    return app


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_exists_and_says_what_it_does(name):
    assert len(function_of(name).__doc__.splitlines()[0]) > 10


@pytest.mark.slow
def test_published_figures_are_met():
    rows = {row["figure"]: row for row in published_figures()}
    assert not [name for name, row in rows.items() if row["met"] == "NO"]
    assert sum(row["met"] == "yes" for row in rows.values()) >= 10
    assert abs(rows["AR0132AT largest SNR"]["ours"] - 43.9) < 0.3
    assert abs(rows["OVT dynamic range"]["ours"] - 119.6) < 0.05
    # 0.98 of 120 000 e, with 58.7 e of read noise and steps of 29.8 e:
    # 10 log10(117 600^2 / (117 600 + 58.7^2 + 29.8^2 / 12)) = 50.58 dB
    assert abs(rows["LOFIC 2.8 um, largest SNR"]["ours"] - 50.58) < 0.15  # 3 errors, 16 384 pairs
    # dark charge of 0.41 e and steps of 1.34 e: sqrt(0.83^2 + 0.41 + 1.34^2 / 12 + ...) = 1.13 e,
    # 2.7 dB
    assert abs(rows["  measured as it is"]["ours"] - (119.6 - 2.7)) < 0.2


@pytest.mark.slow
def test_command_prints_and_writes(app, tmp_path):
    path = tmp_path / "rows.csv"
    done = CliRunner().invoke(app, ["study", "published_figures", "seed=2", "--csv", str(path)])
    assert done.exit_code == 0 and "AR0132AT largest SNR" in done.output
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    assert rows[0]["figure"] == "AR0132AT largest SNR" and abs(float(rows[0]["ours"]) - 43.9) < 0.3


def test_a_folder_for_the_rows_that_does_not_exist_is_found_before_the_work(app, tmp_path):
    missing = tmp_path / "missing" / "rows.csv"
    done = CliRunner().invoke(app, ["study", "budget", "--csv", str(missing)])
    assert isinstance(done.exception, ConfigError) and str(missing) in str(done.exception)


def test_a_home_that_cannot_be_written_is_found_before_the_work(app, tmp_path, monkeypatch):
    (tmp_path / "home").write_text("a file")
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "home"))
    monkeypatch.setattr(study_command, "run_study", lambda *_: pytest.fail("work has started"))
    done = CliRunner().invoke(app, ["study", "published_figures"])
    assert isinstance(done.exception, CatalogError) and "cannot write" in str(done.exception)


def test_a_folder_in_place_of_a_file_for_the_rows_is_found_before_the_work(app, tmp_path):
    done = CliRunner().invoke(app, ["study", "published_figures", "--csv", str(tmp_path)])
    assert isinstance(done.exception, ConfigError) and "--csv rows.csv" in str(done.exception)


def test_without_a_name_the_studies_are_listed(app):
    done = CliRunner().invoke(app, ["study"])
    assert done.exit_code == 0 and all(name in done.output for name in STUDIES)


@pytest.mark.parametrize(
    "name, settings, message",
    [
        ("published_figure", [], "did you mean 'published_figures'"),
        ("published_figures", ["sed=1"], "did you mean 'seed'"),
        ("published_figures", ["seed"], "type key=value"),
        ("published_figures", ["seed=1e3"], "is no whole number"),
        ("level_curves", ["contrast_percent=x"], "is no number"),
    ],
)
def test_mistakes_are_told(name, settings, message):
    with pytest.raises(ConfigError, match=message):
        run_study(name, settings)


def test_the_help_of_a_study_names_its_settings_with_their_defaults(app):
    done = CliRunner().invoke(app, ["study", "emva1288", "--help"])
    assert done.exit_code == 0 and "--csv" not in done.output
    lines = done.output.splitlines()
    place = lines.index("pictures=32")
    assert lines[place + 1].startswith("  number of pictures in a stack. The dark stack has")
    assert "sensor=bayer" in lines and "size=128" in lines
    general = CliRunner().invoke(app, ["study", "--help"])
    assert general.exit_code == 0 and "--csv" in general.output
    unknown = CliRunner().invoke(app, ["study", "emva128", "--help"])
    assert "did you mean 'emva1288'" in str(unknown.exception)


@pytest.mark.parametrize("name", STUDIES)
def test_the_help_of_each_study_explains_every_setting(name):
    function = function_of(name)
    explained = [one for names, _ in parameters_of(function) for one in names]
    assert explained == list(inspect.signature(function).parameters)
    assert all(meaning for _, meaning in parameters_of(function))


@pytest.mark.parametrize("picture", ["missing/figure.png", "figure.xyz", "figure"])
def test_a_drawing_that_cannot_be_written_is_found_before_the_work(picture):
    with pytest.raises(ConfigError, match="picture is .*; expected a file that ends in .png"):
        run_study("paper_fig2", [f"picture={picture}"])


@pytest.mark.parametrize("name", ["preview", "paper_fig4"])
def test_a_study_that_draws_pixels_writes_no_vectors(name):
    with pytest.raises(
        ConfigError, match="expected a file that ends in .png, .jpg, .jpeg, .pdf, i"
    ):
        run_study(name, ["picture=figure.svg"])
