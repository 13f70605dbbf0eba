"""Sequences end to end: the exposure of a frame follows what the frames before it have metered."""

import csv
from itertools import pairwise

import numpy as np
import pytest
from isethdr_workflows.sequences.frames import make, planned
from isethdr_workflows.sequences.request import Request, request_of
from isethdr_workflows.sequences.table import FILE, rows_of, show

import isethdr_core as hdr
from isethdr_core.errors import ConfigError
from isethdr_core.sequence.exposure_control import ExposureControl

METRICS = (
    "shares",
    "dynamic_range",
    "snr",
    "colour",
    "ssim",
    "log_luminance",
    "contrast",
    "detection",
)
SCENE = (
    "scene=moving_target",
    "~renderer",
    "lighting=ideal",
    "lens=ideal",
    "~flare.dirt",
    *(f"~metric.{name}" for name in METRICS),
    "isp=merge",
    "draws=1",
    "report=false",
    "scene.width=24",
    "scene.height=12",
    "scene.first_nm=550",
    "scene.last_nm=550",
    "scene.bar_width_deg=12",
    "sensor=bayer",
    "sensor.exposure_rule=centre",
    "sensor.exposure_max_s=0.01",
    "sensor.pitch_um=100",
)
CONTROL = ExposureControl(share_per_frame=0.5, delay_frames=1)


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))


def exposures(made) -> np.ndarray:
    return np.array([row["exposure_s"] * row["gain"] for row in rows_of(made)])


def settled_s(frame) -> float:
    return frame.exposures["bayer"]["settled"]["exposure_s"]


def settled(made) -> np.ndarray:
    return np.array([row["settled_exposure_s"] * row["settled_gain"] for row in rows_of(made)])


@pytest.mark.slow
def test_frames_follow_the_metered_light(capsys):
    moving = (*SCENE, "scene.speed_tiles_per_s=120")
    made = make(Request(moving, 3, 20.0, CONTROL))
    goals = settled(made)
    assert np.ptp(np.log2(goals)) > 0.5  # the bar moves into the metered field
    expected = [goals[0]]
    for goal in goals[:-1]:
        expected.append(np.sqrt(expected[-1] * goal))
    np.testing.assert_allclose(exposures(made), expected, rtol=1e-12)
    captures = [
        frame.result.open("captures/bayer").exposure_s.values.max() for frame in made.frames
    ]
    np.testing.assert_allclose(captures, expected, rtol=1e-6)  # float32 in the store
    last = made.frames[-1].result.ledger
    [stated] = [row.error for row in last if row.stage == "exposure"]
    assert stated == pytest.approx(abs(expected[-1] / goals[-1] - 1), rel=1e-9)

    again = make(Request(moving, 3, 20.0, CONTROL))
    assert not any(frame.result.computed for frame in again.frames)

    show(made)
    assert "stops" in capsys.readouterr().out
    with (made.sweep.folder / FILE).open() as file:
        assert [float(row["exposure_s"]) for row in csv.DictReader(file)] == list(exposures(made))


@pytest.mark.slow
def test_a_frame_is_the_single_shot_at_its_time_and_exposure_bit_for_bit():
    moving = (*SCENE, "scene.speed_tiles_per_s=120")
    frame = make(Request(moving, 3, 20.0, CONTROL)).frames[-1]
    chosen = frame.exposures["bayer"]["exposure"]
    assert chosen["gain"] == 1.0 and chosen["exposure_s"] != settled_s(frame)
    fixed = ("sensor.exposure_rule=fixed", f"sensor.exposure_s={chosen['exposure_s']!r}")
    at = (f"scene.time_s={frame.time_s!r}", "scene.frames_per_s=20")
    single = hdr.run(hdr.compose((*moving, *fixed, *at)))
    for group, name in (("captures/bayer", "raw"), ("picture/bayer", "xyz")):
        one, other = (run.open(group)[name].values for run in (frame.result, single))
        np.testing.assert_array_equal(one, other)


@pytest.mark.slow
def test_exposures_do_not_depend_on_the_seed_of_the_noise():
    moving = (*SCENE, "scene.speed_tiles_per_s=120")
    runs = [make(Request((*moving, f"seed={seed}"), 3, 20.0, CONTROL)) for seed in (0, 5)]
    np.testing.assert_array_equal(*(exposures(made) for made in runs))
    noisy = [made.frames[0].result.open("captures/bayer").raw.values for made in runs]
    assert (noisy[0] != noisy[1]).any()


@pytest.mark.slow
def test_a_scene_that_stands_still_keeps_the_exposure_of_a_single_shot_with_other_noise():
    still = (*SCENE, "scene.speed_tiles_per_s=0")
    made = make(Request(still, 3, 20.0, CONTROL))
    single = hdr.run(hdr.compose(still))
    for frame in made.frames:
        taken = frame.result.open("captures/bayer").exposure_s.values
        np.testing.assert_array_equal(taken, single.open("captures/bayer").exposure_s.values)
    raw = [frame.result.open("captures/bayer").raw.values for frame in made.frames]
    assert all((one != other).any() for one, other in pairwise(raw))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["frames=0"], "frames is 0"),
        (["frames=1.5"], "expected a whole number"),
        (["frames_per_second=-1"], "frames_per_second is -1.0"),
        (["exposure.share_per_frame=2"], "share_per_frame is 2.0"),
        (["exposure.share=0.2"], "did you mean 'exposure.share_per_frame'"),
        (["+exposure.share_per_frame=0.5"], "no setting '.exposure.share_per_frame'; did you mean"),
        (["++frames=3"], "no setting '..frames'; did you mean 'frames'"),
        (["scene=macbeth", "~renderer"], "does not move"),
        ([*SCENE, "frames_per_second=1000"], "longer than a frame"),
        ([*SCENE, "exposures={}"], "a sequence determines it"),
        ([*SCENE, "scene.frames_per_s=7"], "type frames_per_second=7 in its place"),
    ],
)
def test_mistakes_are_named_before_any_work(settings, message):
    with pytest.raises(ConfigError, match=message):
        planned(request_of(settings))


def test_an_exposure_for_a_camera_without_a_rule_is_refused():
    fixed = [s for s in SCENE if "exposure_" not in s]
    with pytest.raises(ConfigError, match="not automatic"):
        hdr.run(hdr.compose([*fixed, "exposures={bayer: {exposure_s: 0.01}}"]))
