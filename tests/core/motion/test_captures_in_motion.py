"""A bar and a lamp that move at constant speed, as a sensor captures them."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.errors import ConfigError
from isethdr_core.motion.settings import MotionSettings
from isethdr_core.motion.sub_frames import Still, in_motion
from isethdr_core.pipeline.chain import Chain, check_motion
from isethdr_core.uncertainty.ledger import Ledger

TILES = (30, 8)
SPEED = 1000.0  # tiles per second; a pixel is a tile
EXPOSURE_S = 8e-3
CONFIG = SimpleNamespace(scene=SimpleNamespace(name="moving_target"))
PITCH_UM = 2 * np.tan(np.radians(20)) * 4e3 / TILES[0]


def chain_of(motion=None, line_time_s=0.0, **scene) -> Chain:
    lens = hdr.build("lens", "ideal", focal_length_mm=4.0)
    fields = {
        "speed_tiles_per_s": SPEED,
        "bar_width_deg": 2.7,
        "lamp_luminance_cd_m2": 0.0,
        "lamp_diameter_deg": 1e-4,  # too small to hide the bar
        "background_cd_m2": 0.1,
    }
    return Chain(
        scene=hdr.build(
            "scene",
            "moving_target",
            width=TILES[0],
            height=TILES[1],
            first_nm=550.0,
            last_nm=550.0,
            spectrum="E",
            **(fields | scene),
        ),
        renderer=None,
        lighting=hdr.build("lighting", "ideal"),
        versions={},
        lens=lens,
        flares={},
        cameras={
            "one": hdr.build(
                "sensor",
                "staggered",
                exposure_s=EXPOSURE_S,
                exposure_ratios=(1.0, 0.125),
                pitch_um=PITCH_UM * (1 - 1e-9),
                line_time_s=line_time_s,
                noise=False,
                cfa="W",
                optical_crosstalk_percent=0.0,
            )
        },
        isp=None,
        metrics={},
        motion=motion or MotionSettings(step_px=0.5),
    )


@cache
def flat_field() -> np.ndarray:
    """Return the electrons (capture, y, x) of a uniform scene over their maximum: the falloff."""
    uniform = {"background_cd_m2": 100.0, "speed_tiles_per_s": 0.0}
    electrons = light_electrons(chain_of(**uniform))
    return electrons / electrons.max((1, 2), keepdims=True)


def corrected(chain: Chain) -> np.ndarray:
    """Return the electrons of the bar (capture, y, x), without falloff and background."""
    even = light_electrons(chain) / flat_field()
    return even - even[..., -1:]  # the bar never reaches the last column


@cache
def moving_bar() -> np.ndarray:
    """Return the electrons of the moving bar, `corrected`."""
    return corrected(chain_of())


def light_electrons(chain: Chain, rows: Ledger | None = None) -> np.ndarray:
    """Return the electrons (capture, y, x) of the moving scene, without dark charge."""
    scene = chain.scene()
    still = Still(scene, chain.lighting(scene))
    moving = in_motion(chain, hdr.Demand(), Ledger() if rows is None else rows, CONFIG, still)
    mixed = still.mixed if moving is None else moving.mixed
    sensor = chain.cameras["one"]
    light = chain.lens(mixed)
    dark = sensor.expected(light * 0)
    return (sensor.expected(light) - dark).values


def centre_px(bar: np.ndarray) -> np.ndarray:
    """Return the centroid of the bar's light in each row, pixels."""
    return (bar * np.arange(bar.shape[-1])).sum(-1) / bar.sum(-1)


def width_px(bar: np.ndarray) -> np.ndarray:
    """Return the width of a streak from the variance of a box, w^2 / 12, pixels."""
    at = np.arange(bar.shape[-1]) - centre_px(bar)[..., None]
    return np.sqrt(12 * (bar * at**2).sum(-1) / bar.sum(-1))


def test_a_moving_bar_makes_a_streak_of_speed_times_exposure_and_loses_no_light():
    long, short = moving_bar()
    still_long, still_short = corrected(chain_of(speed_tiles_per_s=0.0))
    # light adds up over time. 2e-6: light and sub-frames are rounded to float32, 6e-8 each, in a
    # sum over more than ten sub-frames
    np.testing.assert_allclose(long.sum(-1), still_long.sum(-1), rtol=2e-6)
    np.testing.assert_allclose(short.sum(-1), still_short.sum(-1), rtol=2e-6)
    # the variances of the bar and of the streak, both boxes, add up. Sub-frames half a pixel apart
    # blur by half a pixel
    streak = np.sqrt(width_px(long) ** 2 - width_px(still_long) ** 2)
    np.testing.assert_allclose(streak, SPEED * EXPOSURE_S, rtol=0.01)
    assert (width_px(short) < width_px(long) / 2).all()


def test_captures_of_one_shot_see_the_bar_where_it_is_then():
    long, short = moving_bar()
    middle_s = EXPOSURE_S / 2, EXPOSURE_S * (1 + 0.125 / 2)
    moved = centre_px(short) - centre_px(long)
    # the light of a sub-frame's window shows the middle of the window. This is exact for windows
    # within an exposure. A window that the exposure cuts is off by half a step of half a pixel; the
    # short exposure cuts two windows
    np.testing.assert_allclose(moved, SPEED * (middle_s[1] - middle_s[0]), atol=0.1)


def test_a_rolling_shutter_skews_the_bar_by_speed_times_row_time():
    line_time_s = 4e-4
    long, _ = corrected(chain_of(line_time_s=line_time_s))
    rows = np.arange(TILES[1])
    slope = np.polyfit(rows, centre_px(long), 1)[0]
    # 2 %: sub-frames step by half a pixel, while the bar moves by 2.8 pixels over the 8 rows
    assert slope == pytest.approx(SPEED * line_time_s, rel=0.02)


@pytest.mark.slow
def test_more_sub_frames_come_nearer_to_the_motion():
    def sampled(count: int) -> np.ndarray:
        return light_electrons(chain_of(MotionSettings(sub_frames=count)))

    exact = sampled(41)
    errors = [np.abs(sampled(count) - exact).max() for count in (3, 6, 11)]
    # at the kinks of a bar, the error of the trapezoidal rule falls at least with the step
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < 0.6 * errors[1]


def test_a_scene_that_stands_still_has_the_light_of_a_still_scene():
    rows = Ledger()
    still = light_electrons(chain_of(speed_tiles_per_s=0.0), rows)
    chain = chain_of(speed_tiles_per_s=0.0)
    scene = chain.scene()
    light = chain.lens(chain.lighting(scene))
    sensor = chain.cameras["one"]
    expected = sensor.expected(light).values - sensor.expected(light * 0).values
    np.testing.assert_array_equal(still, expected)
    [row] = rows
    assert [(o.bound, o.needless) for o in row.left_out] == [(0.0, True)]


def test_the_ledger_states_the_motion_between_sub_frames():
    rows = Ledger()
    light_electrons(chain_of(MotionSettings(step_px=2.0)), rows)
    [row] = rows
    motion_px = SPEED * EXPOSURE_S * 1.125
    assert row.error_unit == "px"
    # 9 pixels in steps of at most 2 are five steps. 1e-6: pixels are 1e-9 finer than tiles
    assert row.error == pytest.approx(motion_px / 5, rel=1e-6)


def test_lamps_that_pulse_keep_their_phase_while_they_move():
    pulsed = {"headlights": {"frequency_hz": 250.0, "duty": 0.25, "phase": 0.0}}
    dark = {
        "luminance_cd_m2": 1e-3,
        "background_cd_m2": 0.0,
        "bar_start_deg": 18.0,
        "lamp_start_deg": -12.0,
    }
    chain = chain_of(
        MotionSettings(sub_frames=19),  # 18 pixels in steps of one
        speed_tiles_per_s=2000.0,
        lamp_luminance_cd_m2=1e3,
        lamp_diameter_deg=2.0,
        **dark,
    )
    lighting = hdr.build("lighting", "weights", others=1.0, modulation=pulsed)
    long, _ = light_electrons(replace(chain, lighting=lighting))
    lit = np.flatnonzero(long[TILES[1] // 2] > long.max() / 10)
    # two pulses of a millisecond, 4 ms apart, make two streaks 8 pixels apart. Each is as long as 2
    # pixels of motion plus the lamp's width of 2 pixels; it is dark between them
    gap = int(np.argmax(np.diff(lit)))
    assert np.diff(lit)[gap] >= 3
    apart = lit[gap + 1 :].mean() - lit[: gap + 1].mean()
    assert apart == pytest.approx(8.0, abs=1.0)  # rounding to whole pixels


def test_a_moment_at_which_the_scene_does_not_exist_is_refused_before_any_work():
    with pytest.raises(ConfigError, match="time_s"):
        check_motion(chain_of(time_s=999.999))


def test_a_shot_too_short_for_the_motion_of_a_scene_is_refused_before_any_work():
    sensor = SimpleNamespace(pitch_um=3.0, shot_time_s=lambda width_m, height_m: 1e-7)
    with pytest.raises(ConfigError, match="a shot takes 1e-07 s, .* type motion.within_exposure="):
        check_motion(replace(chain_of(), motion=MotionSettings(), cameras={"one": sensor}))


def test_a_sensor_without_shot_time_is_refused():
    chain = replace(chain_of(), cameras={"one": SimpleNamespace(pitch_um=3.0)})
    with pytest.raises(ConfigError, match="how long its shot takes"):
        check_motion(chain)
