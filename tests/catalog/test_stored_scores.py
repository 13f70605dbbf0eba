"""A metric that was not part of a run reads the run's stored pictures."""

import re

import pytest
from isethdr_catalog.commands import catalog
from isethdr_catalog.stored_scores import scores_of
from typer.testing import CliRunner

import isethdr_core as hdr
from isethdr_core.errors import CatalogError, ConfigError, PluginError
from isethdr_core.pipeline.chain import camera_scores

SMALL = [
    "experiment=five_lights",
    "lens=ideal",
    "~flare@flare.dirt",
    "scene.width=64",
    "scene.height=36",
    "scene.horizontal_field_deg=9",  # makes the sensor small
    "~cameras.split_pixel",
    "~metric.detection",
    "~metric.contrast",
    "draws=1",
    "report=false",
]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def result(home):
    """Return one run for all tests of this file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ISETHDR_HOME", str(home))
        patch.setenv("ISETHDR_CACHE", str(home / "cache"))
        return hdr.run(hdr.compose(SMALL))


@pytest.mark.slow
def test_a_stored_picture_has_the_scores_of_its_run(result):
    """With one noise realisation, a run's scores are those of its stored picture up to rounding."""
    for name in ("ssim", "pixel_shares"):
        found = scores_of(result.path, hdr.build("metric", name))
        assert found
        assert {row["camera"] for row in found} == set(result.cameras)
        for row in found:
            (before,) = (
                s["value"]
                for s in result.scores
                if all(s[k] == row[k] for k in ("camera", "metric", "object"))
            )
            half = (row["high"] - row["low"]) / 2
            # stored pictures are rounded to a twentieth of their noise; a mean over many pixels
            # changes by less. Scores without an interval, as of small objects, may change by 1 %
            tolerance = half / 20 if half > 0 else 0.01 * abs(before)
            assert row["value"] == pytest.approx(before, abs=tolerance)


@pytest.mark.slow
def test_a_new_metric_runs_no_stage(result, monkeypatch):
    def refused(*_):
        raise AssertionError("a stage of the chain ran")

    monkeypatch.setattr(camera_scores, "stage", refused)
    metric = hdr.build("metric", "ssim_pu21")
    files = sorted(result.path.rglob("*"))
    rows = scores_of(result.path, metric)
    assert rows
    assert not {s["metric"] for s in result.scores} & {row["metric"] for row in rows}
    assert {row["camera"] for row in rows} == set(result.cameras)
    assert sorted(result.path.rglob("*")) == files


def test_the_command_prints_what_the_function_returns(result, home, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    call = CliRunner().invoke
    out = call(catalog, ["score", result.key[:8], "metric=ssim", "compression=10"])
    assert out.exit_code == 0, out.exception
    for camera in result.cameras:
        assert re.search(rf"{camera} +\S+", out.output)
    assert "no metric" in str(call(catalog, ["score", result.key[:8], "bins=3"]).exception)
    assert "has no value" in str(call(catalog, ["score", result.key[:8], "ssim"]).exception)
    wrong = call(catalog, ["score", result.key[:8], "metric=ssim", "white=3"]).exception
    assert isinstance(wrong, ConfigError)


def test_only_runs_have_pictures(tmp_path):
    from isethdr_core import store

    scene = store.write_store(tmp_path, "s", {}, {"kind": "scene"})
    with pytest.raises(CatalogError, match="holds a scene; expected a run"):
        scores_of(scene, hdr.build("metric", "ssim"))


def test_a_metric_that_returns_no_scores_is_named(result):
    class Bare:
        def __call__(self, picture, truth, labels):
            return [0.5]

    with pytest.raises(PluginError, match="metric 'Bare' returned .* expected a list of"):
        scores_of(result.path, Bare())
