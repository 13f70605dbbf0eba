"""A run is computed once, stored completely or not at all, and leaves a defined state when it
fails.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from isethdr_core import build, compose, run
from isethdr_core.conformance.renderer import world
from isethdr_core.data.scores import Score
from isethdr_core.errors import ConfigError, PluginError
from isethdr_core.pipeline.chain import chain
from isethdr_core.plugins.registry import components
from isethdr_core.runs.run import run_key

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
    "draws=1",
    "+metric@metric.mean=ideal",
    *(
        f"~metric.{name}"
        for name in (
            "shares",
            "dynamic_range",
            "snr",
            "colour",
            "ssim",
            "log_luminance",
            "contrast",
            "detection",
        )
    ),
]


def test_a_run_is_computed_once():
    config = compose([*SMALL, "sensor=ideal"])
    first = run(config)
    second = run(config)
    assert (
        first.computed
        and not second.computed
        and first.key == second.key
        and first.path == second.path
    )
    assert second.scores == first.scores and second.ledger == first.ledger


def test_all_that_can_change_the_result_names_the_run():
    configs = [
        compose([*SMALL, *more])
        for more in (
            ["sensor=ideal"],
            ["sensor=ideal", "seed=1"],
            ["sensor=ideal", "sensor.exposure_s=0.01"],
            ["sensor=ideal", "device=B"],
            ["sensor=ideal", "scene.luminance_cd_m2=50"],
        )
    ]
    keys = [run_key(config, chain(config)) for config in configs]
    assert len(set(keys)) == 5 and run(configs[0]).key == keys[0]


def test_the_store_holds_captures_picture_truth_and_the_config():
    result = run(compose([*SMALL, "~cameras.rgbw"]))
    assert result.cameras == ["bayer", "split_pixel"]
    for camera in result.cameras:
        picture = result.open(f"picture/{camera}")
        truth = result.open(f"truth/{camera}")
        assert picture["xyz"].shape == truth["xyz"].shape and {"raw", "saturated"} <= set(
            result.open(f"captures/{camera}")
        )
        # a uniform field of 100 cd/m2: the truth is exact up to float32 radiance
        assert truth["xyz"].values[..., 1] == pytest.approx(100.0, rel=1e-5)
    assert (
        result.attributes["config"]["lens"]["name"] == "ideal"
        and result.attributes["versions"]["numpy"]
    )


def test_cameras_look_at_the_same_light_and_draw_their_own_noise():
    both = run(compose([*SMALL, "~cameras.split_pixel"]))
    alone = run(compose([*SMALL, "~cameras.split_pixel", "~cameras.rgbw"]))
    a = both.open("captures/bayer")["raw"]
    b = alone.open("captures/bayer")["raw"]
    assert np.array_equal(a, b), "a further camera must not change this one's noise"


@pytest.mark.slow
def test_the_order_of_two_flares_does_not_matter():
    two = ["lens=diffraction_limited", "+flare@flare.a=aperture", "+flare@flare.b=ideal"]
    swapped = ["lens=diffraction_limited", "+flare@flare.b=ideal", "+flare@flare.a=aperture"]
    base = [*(o for o in SMALL if o != "lens=ideal"), "sensor=ideal"]
    first, second = (
        run(compose([*base, *more])).open("picture/ideal")["xyz"].values for more in (two, swapped)
    )
    # rounding of float32 products in another order
    assert np.allclose(first, second, rtol=1e-5)


def test_a_failed_run_leaves_no_store_and_says_why(isethdr_home, monkeypatch):
    config = compose([*SMALL, "sensor=ideal"])
    with monkeypatch.context() as patch:
        patch.setattr(components()["sensor", "ideal"].cls, "__call__", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            run(config)
    assert not list((isethdr_home / "runs").glob("*"))
    [failed] = (isethdr_home / "failed").glob("*.txt")
    assert "ZeroDivisionError" in failed.read_text() and "Traceback" in failed.read_text()
    result = run(config)
    assert result.computed and failed.name == f"{result.key}.txt"
    assert not failed.exists(), "the note is taken away once the run succeeds"


def test_mistakes_are_found_before_any_work(monkeypatch):
    def work(*_):
        raise AssertionError("work has begun")

    monkeypatch.setattr(components()["scene", "uniform"].cls, "__call__", work)
    for wrong in (
        ["sensor=ideal", "sensor.curves=guess"],
        ["sensor=ideal", "seed=x"],
        ["sensor=ideal", "sensor.pitch_um=-1"],
        ["sensor=ideal", "scene.luminance_cd_m2=-1"],
    ):
        with pytest.raises(ConfigError):
            run(compose([*SMALL, *wrong]))


def test_geometry_needs_a_renderer(monkeypatch):
    monkeypatch.setattr(components()["scene", "night_drive"].cls, "__call__", lambda _: world())
    with pytest.raises(ConfigError, match="needs a renderer.*renderer=mitsuba"):
        run(compose(["scene=night_drive", "~renderer", "sensor=ideal"]))


def test_a_scene_must_state_its_field_in_the_form_of_the_protocol(monkeypatch):
    scene = components()["scene", "uniform"].cls
    monkeypatch.setattr(scene, "camera_field", lambda self: (0.4, 0.2))
    with pytest.raises(PluginError, match=r"Uniform.*camera_field\(\) returned \(0.4, 0.2\)"):
        run(compose([*SMALL, "sensor=ideal"]))


def test_a_metric_must_return_scores(monkeypatch):
    metric = components()["metric", "ideal"].cls
    monkeypatch.setattr(metric, "__call__", lambda *_: 0.5)
    with pytest.raises(PluginError, match="metric 'mean' returned 0.5.*Score"):
        run(compose([*SMALL, "sensor=ideal"]))
    monkeypatch.setattr(metric, "__call__", lambda *_: [Score("m", 1.0, "")])
    assert run(compose([*SMALL, "sensor=ideal"])).scores[0]["value"] == 1.0


def test_a_metric_that_changes_its_picture_ends_the_run(monkeypatch):
    def spoil(self, picture, truth, labels):
        picture["xyz"].values[...] = 0.0
        return [Score("m", 1.0, "")]

    monkeypatch.setattr(components()["metric", "ideal"].cls, "__call__", spoil)
    with pytest.raises(ValueError, match="read-only") as found:
        run(compose([*SMALL, "sensor=ideal"]))
    assert "in stage metric mean ideal" in found.value.__notes__


def test_what_a_metric_replaces_in_its_picture_is_not_stored(monkeypatch):
    def spoil(self, picture, truth, labels):
        for data in (picture, truth):
            data["xyz"] = 0.0 * data["xyz"]
            data.attrs["focal_length_mm"] = -1.0
        return [Score("m", 1.0, "")]

    monkeypatch.setattr(components()["metric", "ideal"].cls, "__call__", spoil)
    result = run(compose([*SMALL, "sensor=ideal"]))
    for data in (result.open("picture/ideal"), result.open("truth/ideal")):
        assert float(data["xyz"].min()) > 0
        assert data.attrs["focal_length_mm"] > 0


def test_a_metric_that_changes_a_further_picture_ends_the_run(offer):
    # a class of its own: Python remembers which abilities a class has
    @dataclass(frozen=True)
    class Spoiling(components()["metric", "ideal"].cls):
        """A metric that writes into the pictures that it scores."""

        def further(self, picture, first, truth, labels):
            picture["xyz"].values[...] = 0.0
            return self(picture, truth, labels)

    offer("metric", "spoiling", Spoiling)
    small = [word for word in SMALL if word not in ("draws=1", "+metric@metric.mean=ideal")]
    with pytest.raises(ValueError, match="read-only") as found:
        run(compose([*small, "+metric@metric.spoiling=spoiling", "sensor=bayer", "draws=2"]))
    assert "in further of metric 'spoiling'" in found.value.__notes__


def test_python_and_config_build_the_same_chain():
    parts = chain(compose([*SMALL, "sensor=ideal", "sensor.exposure_s=0.02"]))
    assert parts.cameras["ideal"] == build("sensor", "ideal", exposure_s=0.02)
