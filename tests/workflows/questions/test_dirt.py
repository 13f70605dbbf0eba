"""Scatter, ghosts and noise are scored in every combination; the renderer's noise is separated."""

from __future__ import annotations

import errno
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from isethdr_workflows.dataset.pairs.sources import Source
from isethdr_workflows.questions import dirt, render_noise, term_scores
from isethdr_workflows.questions.radiance_versions import changed, checked_version
from isethdr_workflows.questions.term_scores import SCORES, SUBSETS, TERMS, key_of

from isethdr_core.display.preview import tristimulus
from isethdr_core.errors import CatalogError, ConfigError, UnitError
from isethdr_core.plugins.registry import build
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.storage.store import write_store

COST = {"scatter": 0.3, "ghosts": 0.0, "noise": 0.1}
STORE = "5ce4e00000000002-00000000"


def values(scale=1.0):
    """Return scores of a camera in which each term costs `COST` times a scale."""
    found = {}
    for subset in SUBSETS:
        loss = scale * sum(COST[term] for term in subset)
        found[key_of(subset)] = {name: -sign * loss for name, sign in SCORES.items()}
        if "noise" not in subset:
            found[key_of(subset)]["dynamic_range"] = math.nan
    return found


@pytest.fixture
def asked(monkeypatch, isethdr_home):
    """Return three scenes of three roads with made-up scores."""
    sources = tuple(Source(f"{k:05d}", f"road {k}", (), f"store{k}") for k in range(3))

    class Plain:
        scene = None
        renderer = None
        lighting = None
        cameras = {}

        def components(self):
            return []

    monkeypatch.setattr(dirt, "checked_chain", lambda _source: Plain())
    monkeypatch.setattr(
        dirt,
        "term_scores",
        lambda source, _version, _shots: {"bayer": values(1 + 0.1 * int(source.name))},
    )
    return dirt.Asked(sources, ("bayer",), 1)


def test_losses_are_positive_where_the_picture_is_worse(asked, capsys):
    rows = dirt.rows_of(asked, dirt.scored(asked))
    assert len(rows) == len(SCORES) * len(TERMS)
    of = {(row["score"], row["term"]): row for row in rows}
    for name in ("ssim", "ciede2000"):
        row = of[name, "scatter"]
        assert row["loss"] == pytest.approx(0.44)  # the mean of the scales 1, 1.1 and 1.2
        for rule in ("first", "last", "shapley"):
            assert row[rule] == pytest.approx(0.33)
        assert row["share"] == pytest.approx(0.75) and row["roads"] == 3
        assert row["share_high"] - row["share_low"] == pytest.approx(0, abs=1e-12)
        assert row["shapley_low"] < 0.33 < row["shapley_high"]
    ranges = of["dynamic_range", "scatter"]
    assert ranges["last"] == pytest.approx(0.33) and math.isnan(ranges["shapley"])
    text = dirt.text_of(rows, asked)
    assert "| ssim | scatter | 0.44 (" in text and " nan" not in text
    assert capsys.readouterr().out.count("\n") == 3


def test_an_interrupted_study_goes_on(asked, monkeypatch, capsys):
    calls = []

    def killed(source, _version, _shots):
        calls.append(source.name)
        if source.name == "00001" and len(calls) == 2:
            raise KeyboardInterrupt
        return {"bayer": values()}

    monkeypatch.setattr(dirt, "term_scores", killed)
    with pytest.raises(KeyboardInterrupt):
        dirt.scored(asked)
    dirt.scored(asked)
    assert calls == ["00000", "00001", "00001", "00002"]
    assert "scored before" in capsys.readouterr().out
    dirt.scored(asked, "half_a")  # another radiance is scored again
    assert len(calls) == 7


def test_scores_of_another_camera_of_the_same_name_are_not_used(asked, monkeypatch):
    # the overrides name a preset, which its owner can edit
    made = []

    def scored(exposure_s):
        camera = build("sensor", "bayer", exposure_s=exposure_s)
        chain = SimpleNamespace(scene=None, renderer=None, lighting=None, cameras={"mine": camera})
        chain.components = lambda: [camera]
        monkeypatch.setattr(dirt, "checked_chain", lambda _source: chain)
        monkeypatch.setattr(dirt, "term_scores", lambda *_: made.append(exposure_s) or {})
        dirt.scored(asked)

    scored(0.01)
    scored(0.01)
    assert made == [0.01] * 3
    scored(0.02)
    assert made == [0.01] * 3 + [0.02] * 3


def test_a_full_disk_is_one_line(asked, monkeypatch):
    def full(_path, _text):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(dirt, "write_text", full)
    with pytest.raises(CatalogError, match=r"No space left on device; scenes that are scored"):
        dirt.scored(asked)


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"shots": 0}, "shots is 0"), ({"cameras": ","}, "no camera"), ({"page": "no/x.md"}, "page")],
)
def test_mistakes_are_named_first(settings, message, isethdr_home):
    with pytest.raises(ConfigError, match=message):
        dirt.dirt(dataset="none", **settings)


def test_a_camera_without_noise_is_named_before_the_light_is_computed(monkeypatch):
    chain = SimpleNamespace(cameras={"ideal": build("sensor", "ideal")}, flares={})
    monkeypatch.setattr(term_scores, "built_for", lambda _source: (None, chain))
    with pytest.raises(ConfigError, match="noise of IdealSensor cannot be switched off"):
        term_scores.checked_chain(Source("00000", "road", (), "store"))


def test_a_change_that_is_told_and_leaves_the_limits_turns_an_answer():
    row = {"shapley": 0.2, "shapley_low": 0.1, "shapley_high": 0.3}
    row |= {"half_buffers": 0.05, "half_buffers_low": 0.04, "half_buffers_high": 0.06}
    row |= {"denoised": -0.3, "denoised_low": -0.4, "denoised_high": -0.2}
    assert render_noise.changes(row) == "denoised"
    assert render_noise.changes(row | {"denoised_high": 0.1}) == "none"


def test_rows_name_the_rule_by_which_a_loss_is_a_term_s(asked):
    answers = {
        version: dirt.scored(asked, version)
        for version in ("stored", *render_noise.HALF_BUFFERS, "denoised")
    }
    rows = {(row["score"], row["term"]): row for row in render_noise.rows_of(asked, answers)}
    for score, rule in (("ssim", "Shapley"), ("dynamic_range", "last")):
        row = rows[score, "scatter"]
        assert row["rule"] == rule and row["shapley"] == pytest.approx(0.33)
        assert row["denoised"] == row["half_buffers"] == 0 and row["changes"] == "none"


def rendered(halves: bool = True):
    """Return scene radiance of two groups, with half buffers, some tiles black."""
    random = np.random.default_rng(3)
    light = random.gamma(4.0, size=(2, 3, 8, 10)).astype(np.float32)
    light[0, :, 0, 0] = 0.0
    scene = scene_radiance(
        light, ("sky", "headlights"), (450.0, 550.0, 650.0), centres(10, 0.4), centres(8, 0.3)
    )
    if halves:
        y = tristimulus(scene)[:, 1]
        share = random.uniform(-1.2, 1.2, y.shape)  # beyond 1, one half found no light
        planes = (y * share).astype(np.float32)
        scene["half_difference"] = ("light_group", "y", "x"), planes
        scene["xyz_noise"] = (
            ("light_group", "xyz_channel", "y", "x"),
            np.repeat(np.abs(planes)[:, None], 3, 1),
        )
    return scene


def test_both_halves_have_the_stored_radiance_as_their_mean():
    scene = rendered()
    stored = scene.radiance.values.astype(float)
    a, b = (changed(scene, name).radiance.values.astype(float) for name in ("half_a", "half_b"))
    whole = np.abs(scene.half_difference.values) <= tristimulus(scene)[:, 1]
    mean = np.moveaxis((a + b) / 2, 1, -1)[whole]
    np.testing.assert_allclose(mean, np.moveaxis(stored, 1, -1)[whole], rtol=1e-6)
    difference = tristimulus(changed(scene, "half_a"))[:, 1] - tristimulus(scene)[:, 1]
    np.testing.assert_allclose(
        difference[whole], scene.half_difference.values[whole], rtol=1e-4, atol=1e-4
    )
    assert min(a.min(), b.min()) >= 0
    assert changed(scene, "stored") is scene
    smooth = changed(scene, "denoised")
    assert np.isfinite(smooth.radiance.values).all()
    assert smooth.radiance.values[0, :, 0, 0].max() == 0
    luminances = [np.log(tristimulus(one)[1, 1]) for one in (smooth, scene)]
    assert luminances[0].std() < 0.8 * luminances[1].std()


def test_a_scene_without_half_buffers_and_an_unknown_version_are_named():
    with pytest.raises(UnitError, match="no variable 'half_difference'"):
        changed(rendered(halves=False), "half_a")
    with pytest.raises(ConfigError, match="did you mean 'denoised'"):
        checked_version("denoise")


@pytest.mark.slow
def test_of_a_lamp_in_the_dark_dirt_costs_more_than_ghosts(isethdr_home):
    """The study runs the whole chain on one scene with every set of terms. Coated ghosts change the
    picture less than dirt, and Shapley values add up to the whole loss.
    """
    chart = build(
        "scene",
        "point_lights",
        width=96,
        height=54,
        horizontal_field_deg=5.2,
        luminance_cd_m2=1e6,
        background_cd_m2=1.0,
        disc_diameter_deg=0.3,
        discs=4,
        first_nm=450.0,
        last_nm=650.0,
        step_nm=50.0,
    )()
    write_store(
        Path(isethdr_home) / "scenes", STORE, {"": chart}, {"kind": "scene", "recipe": STORE[:16]}
    )
    rows = dirt.dirt(
        *("lighting=day", "lighting.others=1", "cameras.bayer.rows=48", "cameras.bayer.columns=84"),
        dataset=STORE,
        cameras="bayer",
        page=str(isethdr_home / "dirt.md"),
    )
    of = {(row["score"], row["term"]): row for row in rows}
    scatter = of["log_luminance_error", "scatter"]["first"]
    assert scatter > 0 and scatter > 3 * abs(of["log_luminance_error", "ghosts"]["first"])
    assert of["ssim", "noise"]["first"] > 0
    whole = [of["ssim", term]["shapley"] for term in TERMS]
    assert sum(whole) == pytest.approx(of["ssim", "noise"]["loss"], abs=1e-9)
    assert "bayer: 1 scene, 1 road" in (isethdr_home / "dirt.md").read_text()
