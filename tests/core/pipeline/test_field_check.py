"""A sensor that does not fit into the camera's field is refused before anything is computed."""

from __future__ import annotations

import math

import pytest

from isethdr_core import build, compose, run
from isethdr_core.config.sweeps import prepared
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.field_check import camera_field, check_fields
from isethdr_core.plugins.registry import components

CHART = [
    "scene=uniform",
    "scene.width=24",
    "scene.height=16",
    "scene.horizontal_field_deg=2",
    "~renderer",
    "lighting=ideal",
    "~versions",
    "lens=ideal",
    "lens.focal_length_mm=4",
    "~flare.dirt",
]
WIDTH_M = 4e-3 * 2 * math.tan(math.radians(1))  # 139.6 um: 46 pixels of 3 um, 30 rows


@pytest.fixture
def no_work(monkeypatch):
    """Make every scene and renderer fail when it is called."""

    def work(*_):
        raise AssertionError("work has begun")

    for (kind, _), component in components().items():
        if kind in ("scene", "renderer"):
            monkeypatch.setattr(component.cls, "__call__", work)


@pytest.mark.parametrize(
    "scene",
    [
        CHART,
        ["lens.focal_length_mm=0.16", "scene=night_drive"],
        ["lens.focal_length_mm=0.16", "scene=tunnel"],
    ],
)
def test_too_many_pixels_are_refused_before_the_scene_is_made(no_work, scene):
    with pytest.raises(
        ConfigError, match=r"sensor\.columns=60 at 3 um is 0\.18 mm wide; .*type sensor\.columns="
    ):
        run(
            compose(
                [*scene, "sensor=bayer", "sensor.pitch_um=3", "sensor.columns=60", "sensor.rows=10"]
            )
        )


@pytest.mark.parametrize("name", sorted(name for kind, name in components() if kind == "sensor"))
def test_every_sensor_says_whether_it_fits(name):
    # the image is 0.73 mm x 0.41 mm large
    scene = build("scene", "uniform")
    lens = build("lens", "ideal", focal_length_mm=1.0)
    for rows, columns, wrong in ((10, 10, ""), (200, 10, "rows=200"), (10, 300, "columns=300")):
        sensor = build("sensor", name, pitch_um=3.0, rows=rows, columns=columns)
        if not wrong:
            check_fields(scene, lens, [sensor])
            continue
        with pytest.raises(ConfigError, match=wrong):
            check_fields(scene, lens, [sensor])


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] * (name == "prescription"))
        for kind, name in sorted(components())
        if kind == "lens"
    ],
)
def test_every_lens_tells_the_size_of_its_image(name):
    with pytest.raises(ConfigError, match="0.9 mm wide"):
        check_fields(
            build("scene", "uniform"),
            build("lens", name, focal_length_mm=1.0),
            [build("sensor", "bayer", pitch_um=3.0, columns=300)],
        )


def test_the_early_and_the_late_check_draw_the_same_line():
    fits = math.floor(WIDTH_M / 3e-6)
    scene = build("scene", "uniform", width=24, height=16, horizontal_field_deg=2.0)
    lens = build("lens", "ideal", focal_length_mm=4.0)
    light = lens(build("lighting", "ideal")(scene()))
    largest, larger = (
        build("sensor", "ideal", pitch_um=3.0, columns=columns, rows=8)
        for columns in (fits, fits + 1)
    )
    check_fields(scene, lens, [largest])
    assert largest.expected(light).sizes["x"] == fits
    with pytest.raises(ConfigError) as early:
        check_fields(scene, lens, [larger])
    with pytest.raises(ConfigError) as late:
        larger.expected(light)
    assert str(early.value) == str(late.value)


def test_barrel_distortion_shrinks_the_image():
    straight = build("lens", "ideal").image_size_m(0.8, 0.5)
    assert straight == pytest.approx((3.2e-3, 2e-3), rel=1e-12)
    bent = build("lens", "ideal", distortion={"model": "brown_conrady", "k1": -0.1}).image_size_m(
        0.8, 0.5
    )
    # barrel distortion shifts the corners most: the corner (0.4, 0.25) is imaged at (1 - 0.1 r^2)
    # of its distance. 2e-6: the result may be 1e-6 too large
    assert bent == pytest.approx(
        [(1 - 0.1 * (0.4**2 + 0.25**2)) * side for side in straight], rel=2e-6
    )


def test_a_sweep_finds_it_before_its_first_job(no_work):
    with pytest.raises(ConfigError, match="sensor.columns=200"):
        prepared(["-m", *CHART, "sensor=bayer", "sensor.columns=10,200"])


def test_what_is_not_known_beforehand_is_left_to_the_sensor():
    class Unknown:
        """A part without any of the methods."""

    scene = build("scene", "uniform")
    lens = build("lens", "ideal")
    sensor = build("sensor", "bayer", columns=60_000)
    check_fields(Unknown(), lens, [sensor])
    check_fields(scene, Unknown(), [sensor])
    check_fields(scene, lens, [Unknown()])
    with pytest.raises(ConfigError, match="columns=60000"):
        check_fields(scene, lens, [Unknown(), sensor])


def test_a_field_in_tangents_and_in_radians():
    assert camera_field(90, 2)[:2] == pytest.approx((2, 1)) and camera_field(90, 2, "equidistant")[
        :2
    ] == pytest.approx((math.pi / 2, math.pi / 4))
