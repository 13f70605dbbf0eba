"""The study of accuracy on any configuration: knobs with errors in closed form, results that are
kept after Ctrl-C, and mistakes.
"""

from __future__ import annotations

import csv
import math
import sys
from dataclasses import dataclass

import numpy as np
import pytest
import typer
import xarray as xr
from isethdr_isp.linear import LinearIsp
from isethdr_sensors.bayer import BayerSensor
from isethdr_workflows import accuracy as package
from isethdr_workflows.accuracy import accuracy, summary
from isethdr_workflows.accuracy.differences import Noise, difference
from isethdr_workflows.accuracy.stage_results import Results
from isethdr_workflows.study_command import study
from typer.testing import CliRunner

from isethdr_core import AccuracyKnob, Component, Cost, Score
from isethdr_core.errors import ConfigError
from isethdr_core.plugins import registry
from isethdr_core.uncertainty.error_terms import Quantity

from .command import FAST, WITHOUT_REPORT, isethdr

SMALL = ["scene=uniform", *FAST, "lighting=ideal", "sensor=bayer"]
PLUGIN = """
from dataclasses import dataclass
from typing import ClassVar
import numpy as np
from isethdr_core import AccuracyKnob, Component, Cost, hookimpl
from isethdr_core.data import quantities
from isethdr_core.error_terms import Quantity

@dataclass(frozen=True)
class AcmeVeil:
    '''A uniform veil, found with so many rays: 1 / rays of itself too bright.'''
    share: float = 0.5
    rays: int = 16
    accuracy_knobs: ClassVar = (
        AccuracyKnob("rays", (4, 16, 64), Quantity.IRRADIANCE, Cost(1.0, -1.0), reference=1024),
    )

    def irradiance(self, lens, mixed):
        share = self.share * (1 + 1 / self.rays)
        values = share * lens.throughput_sr() * np.asarray(mixed.values)
        x, y = (mixed[d].values * 1e-3 * lens.focal_length_mm for d in ("x", "y"))
        return quantities.plane(values, mixed.wavelength.values, x, y, quantities.IRRADIANCE)

@hookimpl
def isethdr_components():
    return [Component("flare", "acme_veil", AcmeVeil)]
"""


@dataclass(frozen=True)
class Pairs:
    """A metric of an outside package that is 1 / pairs too large."""

    pairs: int = 10

    accuracy_knobs = (
        AccuracyKnob("pairs", (10, 100), Quantity.SCORE, Cost(1.0, -1.0), reference=10_000),
    )

    def __call__(self, picture, truth, labels):
        value = 2.0 * (1 + 1 / self.pairs)
        return [Score("acme", value, "1", low=value - 0.1, high=value + 0.1)]


@dataclass(frozen=True)
class Steps(BayerSensor):
    """A sensor of an outside package that counts 1 / steps too many electrons."""

    steps: int = 8

    accuracy_knobs = (AccuracyKnob("steps", (4, 8), Quantity.ELECTRONS, reference=10_000),)

    def expected(self, light):
        return super().expected(light) * (1 + 1 / self.steps)


@dataclass(frozen=True)
class Passes(LinearIsp):
    """Image processing of an outside package that is 1 / passes too bright."""

    passes: int = 8

    accuracy_knobs = (AccuracyKnob("passes", (4, 8), Quantity.PICTURE, reference=10_000),)

    def __call__(self, captures):
        picture = super().__call__(captures)
        return picture.assign(xyz=picture["xyz"] * (1 + 1 / self.passes))


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "home"))
    return tmp_path


def table(folder) -> list[dict]:
    with (folder / package.TABLE).open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_the_command_measures_a_knob_of_an_outside_plugin(tmp_path):
    site = tmp_path / "site"
    info = tmp_path / "site" / "acme-1.0.dist-info"
    info.mkdir(parents=True)
    (site / "acme.py").write_text(PLUGIN)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[isethdr]\nacme = acme\n")
    settings = ["lens.falloff=none", "+flare@flare.veil=acme_veil", "knob=flare.veil.rays"]
    done = isethdr(
        "study",
        "accuracy",
        *SMALL,
        *settings,
        f"folder={tmp_path / 'out'}",
        plugins=[site],
        ISETHDR_HOME=str(tmp_path / "home"),
        ISETHDR_PLUGINS=WITHOUT_REPORT,
    )
    assert done.returncode == 0, done.stderr
    assert "flare.veil.rays" in done.stdout
    assert len((done.stdout + done.stderr).splitlines()) <= 20
    rows = table(tmp_path / "out")
    assert [int(row["value"]) for row in rows] == [4, 16, 64]
    assert [row["now"] for row in rows] == ["False", "True", "False"]
    for row in rows:
        # image and veil are uniform, so their light is 1 + s (1 + 1 / rays) times that of the
        # image; the error is relative to the light of the reference
        light, right = (1 + 0.5 * (1 + 1 / n) for n in (int(row["value"]), 1024))
        assert row["compared"] == "irradiance"
        # 1e-4: float32 rounds each light of 1.5 by 6e-8
        assert float(row["error"]) == pytest.approx(light / right - 1, rel=1e-4)
        assert float(row["relative_cost"]) == int(row["value"]) / 4
        assert float(row["cpu_s"]) > 0 and float(row["cpu_s_again"]) > 0
    # electrons are proportional to light, and the noise of a pixel is the same for all settings
    of_noise, own = (np.array([float(r[k]) for r in rows]) for k in ("error_of_noise", "error"))
    assert of_noise / of_noise[0] == pytest.approx(own / own[0], rel=1e-4)
    assert (tmp_path / "out" / package.PICTURE).stat().st_size > 5000


@pytest.mark.slow
def test_scores_are_compared_in_half_intervals(home, monkeypatch):
    monkeypatch.setitem(
        registry.components(), ("metric", "acme"), Component("metric", "acme", Pairs)
    )
    rows = accuracy(*SMALL, "+metric@metric.acme=acme", knob="metric.acme.pairs", folder=str(home))
    right = 2.0 * (1 + 1e-4)
    for row in rows:
        off = 2.0 * (1 + 1 / row["value"]) - right
        assert row["compared"] == "score" and row["error"] == pytest.approx(off / right, rel=1e-9)
        assert row["error_of_noise"] == pytest.approx(off / 0.1, rel=1e-9)


@pytest.mark.slow
def test_knobs_of_one_of_two_cameras_and_of_the_isp(home, monkeypatch):
    offered = Component("sensor", "acme", Steps), Component("isp", "acme", Passes)
    for component in offered:
        place = (component.kind, component.name)
        monkeypatch.setitem(registry.components(), place, component)
    monkeypatch.setattr(package, "draw", lambda *_: None)  # other tests draw
    setup = [*SMALL[:-1], "~cameras.rgbw", "~cameras.split_pixel", "isp=acme"]
    setup += ["sensor@cameras.bayer=acme", "+sensor@cameras.other=bayer"]
    for knob, compared in (("cameras.bayer.steps", "electrons"), ("isp.passes", "picture")):
        rows = accuracy(*setup, knob=knob, folder=str(home))
        assert [row["value"] for row in rows] == [4, 8]
        errors = [row["error"] for row in rows]
        # the error is 1 / steps less the 1e-4 of the reference; the other camera has no error
        assert errors[0] / errors[1] == pytest.approx((1 / 4 - 1e-4) / (1 / 8 - 1e-4), rel=1e-6)
        assert {row["compared"] for row in rows} == {compared}
        assert all(math.isnan(row["relative_cost"]) for row in rows)  # no model


@pytest.mark.slow
def test_narrower_bands_are_better_down_to_the_reference(home):
    rows = accuracy(
        *SMALL, "lens.falloff=none", knob="scene.step_nm", values="30,10,2", folder=str(home)
    )
    errors = [row["error_of_noise"] for row in rows]
    assert errors[0] > errors[1] > errors[2] == 0.0  # the last one is the reference
    [line] = summary.by_knob(rows)
    assert line["knob"] == "scene.step_nm" and line["now"] == 10.0 and line["tried"] == 3


def test_after_ctrl_c_the_same_command_goes_on(home, monkeypatch):
    measured = []

    def counted(self, job):
        measured.append(job.value)
        row = {"knob": job.configured.name, "value": job.value, "now": False, "allowed": 0.1}
        row |= {"error_of_noise": 1 / len(measured), "cpu_s": 1.0}
        return None if job.is_reference else row | {"compared": "electrons", "reference": ""}

    def stopped(self, job):
        if len(measured) == 3:  # the reference and two settings
            raise KeyboardInterrupt
        return counted(self, job)

    # the slow tests measure; this one counts what would be measured
    monkeypatch.setattr(package, "_of_base", lambda *_: package.Study(None, None, 0.1))
    monkeypatch.setattr(package.Study, "measure", stopped)
    app = typer.Typer()
    app.command("study")(study)
    app.command("other")(lambda: None)
    arguments = ["study", "accuracy", *SMALL, "knob=scene.step_nm"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 130 and "stopped: 2 of 5 settings are measured" in done.output
    [folder] = (home / "home" / "studies").iterdir()
    kept = table(folder)
    assert [float(row["value"]) for row in kept] == [50.0, 30.0]
    assert (folder / package.PICTURE).exists()

    measured.clear()
    monkeypatch.setattr(package.Study, "measure", counted)
    monkeypatch.setattr(package, "draw", lambda *_: None)  # drawn above
    rows = accuracy(*SMALL, knob="scene.step_nm")
    assert measured == [package.REFERENCE, *(row["value"] for row in rows[2:])]
    assert table(folder)[:2] == kept and len(rows) == len(table(folder)) == 5

    measured.clear()
    assert accuracy(*SMALL, knob="scene.step_nm") == rows and not measured
    # rows of another configuration do not count
    accuracy(*SMALL, "seed=3", knob="scene.step_nm", values="50", folder=str(folder))
    assert package.REFERENCE in measured
    # they do not replace the rows of the first call in the same folder
    measured.clear()
    assert accuracy(*SMALL, knob="scene.step_nm") == rows and not measured


@pytest.mark.parametrize("order", [("bright", "dim"), ("dim", "bright")])
def test_a_saturated_camera_does_not_hide_the_error_of_another(order):
    unsaturated = {"bright": np.zeros((1, 2, 2), bool), "dim": np.ones((1, 2, 2), bool)}
    sigma = dict.fromkeys(order, np.full((1, 2, 2), 2.0))
    right, off = (
        Results(electrons={name: xr.DataArray(np.full((1, 2, 2), value)) for name in order})
        for value in (100.0, 103.0)
    )
    found = difference(off, right, Quantity.ELECTRONS, Noise(sigma, unsaturated, True))
    assert (found.own, found.half, found.of_noise) == (3.0, 3.0, 1.5)


def test_a_missing_library_of_drawings_is_found_before_the_work(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ConfigError, match=r"needs matplotlib.*pip install 'isethdr\[report\]'"):
        accuracy("no override")


def test_a_configuration_without_knobs_is_refused(home, monkeypatch):
    from isethdr_scenes.charts.chart import Chart

    monkeypatch.setattr(Chart, "accuracy_knobs", None)
    with pytest.raises(ConfigError, match="no component .* declares an accuracy knob .*type for"):
        accuracy(*SMALL)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"knob": "scene.stepnm"}, "did you mean 'scene.step_nm'"),
        ({"values": "10,5"}, "no knob; type knob=scene.step_nm"),
        ({"knob": "scene.step_nm", "values": "10,["}, "cannot be read; .*values=50.0,30.0"),
        (
            {"knob": "scene.step_nm", "values": "10,-5"},
            "scene.step_nm cannot be set to scene.step_nm=-5: .*0.1 to 3000",
        ),
    ],
)
def test_mistakes_are_told_before_any_work(home, monkeypatch, settings, said):
    monkeypatch.setattr(package, "all_stages", lambda *_, **__: pytest.fail("work has started"))
    with pytest.raises(ConfigError, match=said):
        accuracy(*SMALL, **settings)


def test_an_error_of_a_score_without_interval_is_not_zero_standard_deviations():
    """A knob of one metric leaves the scores of the others as they are."""

    def error(changed: Score, right: Score):
        other = Score("other", 3.0, "1", low=2.0, high=4.0)
        results = (Results(scores={"front": [other, score]}) for score in (changed, right))
        found = difference(*results, Quantity.SCORE, Noise({}, {}, True))
        return found.own, found.half, found.of_noise

    assert error(Score("acme", 2.2, "1"), Score("acme", 2.0, "1")) == pytest.approx(
        (0.1, 0.1, math.nan), nan_ok=True
    )
    known = Score("acme", 2.0, "1", low=1.6, high=2.4)
    assert error(Score("acme", 2.2, "1"), known) == pytest.approx((0.1, 0.1, 0.5))
    assert error(known, known) == (0.0, 0.0, 0.0)
    assert all(map(math.isnan, error(Score("acme", math.nan, "1"), known)))
