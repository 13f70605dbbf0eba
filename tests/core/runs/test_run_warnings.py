"""Run warnings: saturation outside lamps, objects below the noise, and their display."""

import math

import numpy as np
import pytest
import xarray as xr

import isethdr_core as hdr
from isethdr_core.cli.summary_tables import print_result
from isethdr_core.data.scores import objects_remark, shares_remark, unlike_shares
from isethdr_core.quantities import centres
from isethdr_core.runs.run_warnings import (
    LOW_OBJECT_SNR,
    SATURATED_FRAME,
    lamp_pixels,
    median_object_snr_db,
    saturated_share_outside_lamps,
    sentence,
    warnings_of,
)
from isethdr_core.truth import make_picture

SHAPE = (40, 50)


def picture(y, variance=0.01, saturated=False, **attrs):
    xyz = np.asarray(y, float)[..., None] * np.ones(3)
    lost = np.broadcast_to(saturated, SHAPE)
    grid = centres(SHAPE[1], 1e-4), centres(SHAPE[0], 1e-4)
    made = make_picture(
        xyz,
        np.full((*SHAPE, 3), variance),
        ~lost,
        *grid,
        focal_length_mm=4.0,
        pitch_um=2.0,
        **attrs,
    )
    return made.assign(saturated=(("y", "x"), lost))


def labels(lamps=()):
    """Return a car (1) with its headlight, and a person (2)."""
    instance = np.zeros(SHAPE, np.uint32)
    instance[10:20, 5:25] = 1
    instance[10:30, 35:40] = 2
    return xr.Dataset({"instance": (("y", "x"), instance)}, attrs={"lamps": list(lamps)})


def scene():
    y = np.full(SHAPE, 2.0)
    y[12:14, 6:9] = 150.0  # the headlight: bright, yet not 100 times its surroundings
    return y


def test_saturated_lamps_are_no_reason_to_warn():
    y = scene()
    lost = scene() > 100
    table = labels([{"instance": 1, "object": "car"}])
    np.testing.assert_array_equal(lamp_pixels(picture(y), table), lost)
    assert saturated_share_outside_lamps(picture(y, saturated=lost), picture(y), table) == 0
    assert warnings_of("front", picture(y, saturated=lost), picture(y), table) == []


def test_a_chart_calls_the_instance_of_a_lamp_object():
    assert lamp_pixels(picture(scene()), labels([{"object": 1}])).sum() == 6
    assert lamp_pixels(picture(scene()), labels()).sum() == 0
    glaring = np.where(scene() > 100, 1e6, scene())
    assert lamp_pixels(picture(glaring), labels()).sum() == 6  # so bright that it needs no table


@pytest.mark.parametrize("rows, warned", [(2, False), (3, True)])
def test_more_than_a_twentieth_of_the_frame_saturated_is_a_warning(rows, warned):
    lost = np.zeros(SHAPE, bool)
    lost[-rows:] = True  # two of 40 rows are exactly the limit
    found = warnings_of("front", picture(scene(), saturated=lost), picture(scene()), labels())
    assert [w.key for w in found] == [SATURATED_FRAME] * warned
    if warned:
        assert (found[0].camera, found[0].value, found[0].limit) == ("front", 3 / 40, 0.05)


def test_objects_below_the_noise_are_a_warning():
    y = np.full(SHAPE, 2.0)
    assert median_object_snr_db(picture(y, 0.04), labels()) == pytest.approx(20.0)
    found = warnings_of("front", picture(y, 16.0), picture(y), labels())
    assert [(w.key, w.unit) for w in found] == [(LOW_OBJECT_SNR, "dB")]
    assert found[0].value == pytest.approx(20 * math.log10(0.5))
    assert warnings_of("front", picture(-y, 1.0), picture(y), labels())[0].value == -math.inf


def test_what_is_not_known_is_no_warning():
    y = np.full(SHAPE, 2.0)
    unknown = picture(y, 16.0, variance_known=False)
    assert math.isnan(median_object_snr_db(unknown, labels()))
    assert math.isnan(median_object_snr_db(picture(y, 16.0), xr.Dataset()))
    assert math.isnan(median_object_snr_db(picture(y, 16.0, saturated=True), labels()))
    assert math.isnan(median_object_snr_db(picture(0 * y, 0.0), labels()))
    assert median_object_snr_db(picture(y, 0.0), labels()) == math.inf
    assert warnings_of("front", unknown, picture(y), labels()) == []


def share(camera, value, name=""):
    return {"metric": "valid_share", "camera": camera, "object": name, "value": value}


def test_unlike_shares_are_those_more_than_a_twentieth_apart():
    near = [share("a", 0.97), share("b", 1.0)]
    assert unlike_shares(near) == {} and unlike_shares(near[:1]) == {}
    apart = [*near, share("c", 0.5), share("a", 0.2, "car"), share("c", 0.9, "car")]
    found = unlike_shares(apart)
    assert found == {"": {"a": 0.97, "b": 1.0, "c": 0.5}, "car": {"a": 0.2, "c": 0.9}}
    assert "a 0.97, b 1.00, c 0.50" in shares_remark(found[""])
    assert objects_remark(found).endswith(": car.") and objects_remark({"": {}}) == ""


def test_a_key_of_another_version_is_shown_with_its_numbers():
    record = {"key": "newer", "camera": "front", "value": 2.0, "limit": 1.0, "unit": "m"}
    assert sentence(record) == "front: newer is 2 m (limit 1 m)"


def test_a_user_sees_an_overexposed_and_a_dark_camera(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "300")
    chart = [
        "experiment=five_lights",
        "scene=macbeth",
        "scene.width=24",
        "scene.height=16",
        "scene.horizontal_field_deg=4",  # makes the sensor small
        "~flare.dirt",
    ]
    cameras = ["~cameras.rgbw", "~cameras.split_pixel", "+sensor@cameras.dark=bayer"]
    cameras.append("sensor@cameras.bayer=bayer")
    exposures = ["cameras.bayer.exposure_s=4", "cameras.dark.exposure_s=1e-6"]
    result = hdr.run(
        hdr.compose(
            [
                *chart,
                *cameras,
                *exposures,
                "lens=ideal",
                "draws=1",
                "~metric.detection",
                "~metric.contrast",
            ]
        )
    )
    found = {(w["key"], w["camera"]): w for w in result.warnings}
    assert set(found) == {(SATURATED_FRAME, "bayer"), (LOW_OBJECT_SNR, "dark")}
    assert (
        found[SATURATED_FRAME, "bayer"]["value"] > 0.8
        and found[LOW_OBJECT_SNR, "dark"]["value"] < 0
    )
    print_result(result)
    printed = " ".join(capsys.readouterr().out.split())  # lines are broken between words
    for record in result.warnings:
        assert f"warning: {sentence(record)}" in printed
    assert "Shares of valid pixels differ by more than 0.05 (bayer 0.0" in printed
    assert " nan " not in printed
    # no score of any camera is undefined, and every one is accompanied by its share
    assert all(math.isfinite(s["value"]) for s in result.scores)
    assert {s["camera"] for s in result.scores if s["metric"] == "valid_share"} == {"bayer", "dark"}
