"""Noise realisations: scores are means over shots with different noise, with Student's interval."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.data.scores import Score
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline.chain import chain, imaging, plan, through_camera
from isethdr_core.pipeline.shot import Shot
from isethdr_core.runs.noise_realisations import over_draws
from isethdr_core.uncertainty.render_noise import HALF_DIFFERENCE, luminance_cd_m2
from isethdr_core.uncertainty.score_intervals import RendererError


def test_the_interval_holds_the_true_mean_as_often_as_it_says():
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(2000):
        (score,) = over_draws([[Score("m", float(v), "dB")] for v in rng.normal(3.0, 0.5, 4)])
        inside += score.low <= 3.0 <= score.high
    # four standard errors of a share
    assert abs(inside / 2000 - 0.95) < 4 * math.sqrt(0.95 * 0.05 / 2000)


def test_scores_that_cannot_be_averaged_keep_their_first_value_and_have_no_interval():
    first = [
        Score("a", 1.0, "", "", 0.5, 1.5),
        Score("b", 2.0, "", "person", 1.0, 3.0),
        Score("c", math.inf, "dB", "", 5.0, math.inf),
    ]
    other = [Score("a", 3.0, ""), Score("c", 7.0, "dB")]
    a, b, c = over_draws([first, other])
    assert a.value == 2.0 and a.low < 1.0 < 3.0 < a.high
    assert (b.value, c.value) == (2.0, math.inf)
    # an interval over the pixels of one picture is not an interval over shots
    for score in (b, c, *over_draws([first])):
        assert math.isnan(score.low) and math.isnan(score.high)


def test_renderer_noise_widens_the_interval_of_its_own_score_alone():
    shots = [[Score("a", v, "dB"), Score("a", v, "dB", "car")] for v in (1.0, 1.2, 0.9, 1.1)]
    frame, car = over_draws(shots)
    wide, same = over_draws(shots, {("a", "dB", ""): RendererError(0.5, 5)})
    assert wide.high - wide.low > 2 * (frame.high - frame.low)
    assert same == car and wide.value == frame.value


def test_a_run_takes_draws_that_differ_in_noise_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    chart = [
        "experiment=five_lights",
        "scene=macbeth",
        "scene.width=48",
        "scene.height=32",
        "~flare.dirt",
        "lens=ideal",
        "sensor=bayer",
        "sensor.rows=24",
        "sensor.columns=36",
        "lens.focal_length_mm=0.25",
        "~metric.detection",
        "~metric.contrast",
    ]
    one, four = (hdr.run(hdr.compose([*chart, f"draws={n}"])) for n in (1, 4))
    first, mean = (
        {(s["metric"], s["object"], s["unit"]): s for s in r.scores} for r in (one, four)
    )
    assert first.keys() == mean.keys()
    key = ("ciede2000", "", next(k[2] for k in first if k[0] == "ciede2000"))
    assert mean[key]["low"] < mean[key]["value"] < mean[key]["high"]
    assert mean[key]["value"] != first[key]["value"]
    # the first shot is the one that is stored
    np.testing.assert_array_equal(one.open("captures/bayer").raw, four.open("captures/bayer").raw)
    assert "draws bayer" in [row.stage for row in four.ledger] and "draws bayer" not in [
        row.stage for row in one.ledger
    ]
    assert first[key]["low"] in (None, "NaN") or math.isnan(first[key]["low"])
    assert [left.what for row in one.ledger for left in row.left_out if "scores" in left.what] == [
        "intervals of scores"
    ]
    # a chart has no renderer noise: nothing is missing in the interval of four shots
    assert "scores bayer" not in [row.stage for row in four.ledger]


@pytest.mark.slow
def test_the_intervals_of_a_rendered_scene_hold_the_noise_of_its_renderer():
    """The half buffers of a chart differ by 30 % in every tile; it is compared with the same chart
    without noise.
    """
    chart = [
        "scene=macbeth",
        "scene.width=48",
        "scene.height=32",
        "~flare.dirt",
        "~renderer",
        "lens=ideal",
    ]
    camera = ["sensor=bayer", "sensor.rows=24", "sensor.columns=36", "lens.focal_length_mm=0.25"]
    config = hdr.compose(["experiment=five_lights", *chart, *camera, "report=false"])
    parts = chain(config)
    parts = replace(parts, metrics={"colour": parts.metrics["colour"]})
    demand = plan(parts, Ledger())
    scene = parts.scene().load()
    mixed = parts.lighting(scene)
    made = imaging(parts, mixed, demand)
    light = made.light()
    halves = np.zeros((scene.sizes["light_group"], *mixed.shape[1:]))
    halves[0] = (
        0.3 * luminance_cd_m2(mixed) / mixed.attrs["weights"][str(scene.light_group.values[0])]
    )
    found = {}
    rows = {}
    for name, noise in (("exact", 0.0 * halves), ("noisy", halves), ("unknown", np.nan * halves)):
        stored = scene.assign({HALF_DIFFERENCE: (("light_group", "y", "x"), noise)}).assign_attrs(
            rendered_s=1.0
        )
        random = hdr.generator(seed=0, device="A", scene="chart")
        rows[name] = Ledger()
        shot = Shot(light, mixed, stored, random, made)
        seen = through_camera(parts, rows[name], "bayer", shot)
        found[name] = {(s.metric, s.object): s for s in seen.scores}
    width = {name: s["ciede2000", ""].high - s["ciede2000", ""].low for name, s in found.items()}
    assert width["noisy"] > 2 * width["exact"] > 0
    assert width["unknown"] == pytest.approx(width["exact"])
    assert {name: s["ciede2000", ""].value for name, s in found.items()} == dict.fromkeys(
        found, found["exact"]["ciede2000", ""].value
    )
    said = {
        name: [left.what for row in ledger for left in row.left_out if "scores" in left.what]
        for name, ledger in rows.items()
    }
    assert said == {"exact": [], "noisy": [], "unknown": ["renderer noise in scores"]}


@pytest.mark.parametrize("draws", ["0", "2.5", "many"])
def test_draws_are_a_whole_number(draws):
    with pytest.raises(ConfigError, match="draws is .* whole number.*draws=4"):
        hdr.run(hdr.compose([f"draws={draws}"]))
