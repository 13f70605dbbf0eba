"""Windows of the image plane: sensors state theirs, and those of several cameras are joined. A lens
that keeps light in place gets no tile beyond the window.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from isethdr_optics import IdealLens
from isethdr_optics.plan.region import UNSEEN, region

from isethdr_core import build, compose, run
from isethdr_core.data.temporal_modulation import stacked
from isethdr_core.demand import Demand
from isethdr_core.ledger import Ledger
from isethdr_core.physics.detector.temporal_modulation import Modulation
from isethdr_core.pipeline import window
from isethdr_core.pipeline.chain import Chain, chain, on_sensor, plan, union
from isethdr_core.pipeline.imaging_plan import LightBudget
from isethdr_core.quantities import RADIANCE, centres, plane
from isethdr_core.testing import check
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.render_noise import on_light

SMALL = [
    "scene=macbeth",
    "~renderer",
    "lighting=ideal",
    "~versions",
    "~flare.dirt",
    "lens=ideal",
    "scene.width=24",
    "scene.height=16",
    "scene.horizontal_field_deg=4",
    "report=false",
    "draws=1",
    "isp=linear",
    *(
        f"~metric.{name}"
        for name in (
            "shares",
            "dynamic_range",
            "snr",
            "ssim",
            "log_luminance",
            "contrast",
            "detection",
        )
    ),
]


def mixed(width=12, height=8):
    """Return a field of square tiles. A side is 0.01 as the tangent of the field angle, or 40 um on
    the sensor at a focal length of 4 mm.
    """
    values = np.random.default_rng(1).random((3, height, width)).astype(np.float32)
    return plane(
        values,
        [450.0, 550.0, 650.0],
        centres(width, 0.01 * width),
        centres(height, 0.01 * height),
        RADIANCE,
        weights={},
    )


def parts(lens, flares=()):
    return Chain(
        None,
        None,
        None,
        {},
        lens,
        dict(enumerate(flares)),
        {"one": build("sensor", "ideal")},
        None,
        {},
    )


def light_of(lens, window_m, field=None, flares=()):
    rows = Ledger()
    with ledger.stage(rows, "lens"):
        light = on_sensor(
            parts(lens, flares), mixed() if field is None else field, Demand(window_m=window_m)
        )
    return light, [o for o in rows[0].left_out if o.why == UNSEEN]


@pytest.mark.parametrize(
    ("width", "seen"),
    [
        (4.0, (4, 8)),
        (4.0 + 1e-6, (3, 9)),
        (4.0 - 1e-6, (4, 8)),
        (2.1, (4, 8)),
        (1e-9, (5, 7)),
        (np.inf, (0, 12)),
    ],
)
def test_a_tile_is_seen_as_soon_as_any_of_it_is(width, seen):
    """The borders of 12 tiles of width 1 are whole numbers from the axis. A window holds at least
    two tiles, so that the size of a tile is known.
    """
    assert window.within(centres(12, 12.0), width) == slice(*seen)
    assert (
        window.within(centres(11, 11.0), 1e-9).stop - window.within(centres(11, 11.0), 1e-9).start
        == 2
    )


def test_sensors_state_what_they_see_and_nothing_where_they_fill_the_field():
    for name in ("ideal", "bayer", "split_pixel"):
        sensor = build("sensor", name, pitch_um=3.0)
        assert sensor.narrow(Demand()).window_m is None
        assert replace(sensor, rows=20, columns=30).narrow(Demand()).window_m == pytest.approx(
            (90e-6, 60e-6)
        )
        assert replace(sensor, rows=20).narrow(Demand()).window_m == (np.inf, pytest.approx(60e-6))
    asked = build("sensor", "bayer", pitch_um=3.0, rows=20, columns=30).narrow(Demand())
    assert asked.response.window_m == asked.window_m


def test_cameras_see_what_either_sees_and_one_that_says_nothing_sees_all():
    wide = Demand(window_m=(3.0, 1.0))
    high = Demand(window_m=(2.0, np.inf))
    assert union([wide, high]).window_m == (3.0, np.inf)
    assert union([wide, Demand(), high]).window_m is None
    first, second = (
        build("sensor", "bayer", columns=n).narrow(Demand()).response for n in (10, 20)
    )
    assert (first + second).window_m == second.window_m and (
        first + replace(second, window_m=None)
    ).window_m is None


def test_a_lens_that_keeps_light_in_place_makes_the_same_bits_of_fewer_tiles():
    lens = build("lens", "ideal")
    every, none = light_of(lens, None)
    few, [left] = light_of(lens, (150e-6, 90e-6))
    assert (
        left.what == "80 of 96 tiles of the field, beyond the middle 4 x 4"
        and left.bound == 0.0
        and not none
    )
    assert few.shape == (3, 4, 4) and few.attrs == every.attrs, (
        "falloff and field are those of the camera"
    )
    np.testing.assert_array_equal(few.values, every.sel(x=few.x, y=few.y).values)


@pytest.mark.parametrize("window_m", [(480e-6, 320e-6), (1.0, 1.0), (np.inf, np.inf)])
def test_a_window_as_large_as_the_field_changes_nothing(window_m):
    found = region(build("lens", "ideal"), (), field := mixed(), LightBudget(0.0, window_m))
    assert found.region.tiles is None and found.mixed is field and not found.left_out


def test_a_lens_that_spreads_light_is_given_all():
    tiny = (90e-6, 90e-6)
    for lens, flares in (
        (build("lens", "diffraction_limited"), ()),
        (build("lens", "ideal"), (build("flare", "haze"),)),
        (build("lens", "ideal", distortion={"model": "brown_conrady", "k1": -0.1}), ()),
    ):
        assert region(lens, flares, field := mixed(), LightBudget(0.0, tiny)).mixed is field


def test_light_that_varies_in_time_is_cut_like_any_other():
    pulsed = stacked(["a", "b"], [Modulation(), Modulation(90.0, 0.1)], [mixed(), mixed()])
    few, [left] = light_of(build("lens", "ideal"), (90e-6, 90e-6), pulsed)
    assert few.shape == (2, 3, 4, 4) and left.what.startswith("80 of 96")


def test_noise_of_the_scene_is_taken_from_the_tiles_that_light_has():
    field = mixed()
    light = light_of(build("lens", "ideal"), (90e-6, 90e-6))[0]
    np.testing.assert_array_equal(on_light(field.values, field, light), field.values[:, 2:6, 4:8])


@pytest.mark.slow
def test_runs_of_cropped_cameras_keep_readings_pictures_truths_and_labels():
    """The windows of two crops are joined; noise and truth keep their places. 1e-6: readings
    without noise are float32, and the borders of pixels are rounded.
    """
    cameras = [
        "~cameras.split_pixel",
        "~cameras.rgbw",
        "~cameras.bayer",
        "+sensor@cameras.wide=bayer",
        "cameras.wide.columns=20",
        "cameras.wide.rows=10",
        "+sensor@cameras.high=ideal",
        "cameras.high.columns=8",
        "cameras.high.rows=30",
    ]
    few, every = (run(compose([*SMALL, *cameras, f"leave_out={way}"])) for way in ("true", "false"))
    [row] = [o for r in few.ledger for o in r.left_out if o.why == UNSEEN]
    assert row.what.startswith("3") and not [
        o for r in every.ledger for o in r.left_out if o.why == UNSEEN
    ]
    for camera in ("wide", "high"):
        first, second = (one.open(f"captures/{camera}") for one in (few, every))
        np.testing.assert_allclose(first["raw"].values, second["raw"].values, rtol=1e-6)
        assert first.attrs == second.attrs
        assert few.open(f"truth/{camera}").load().identical(every.open(f"truth/{camera}").load())
    assert [(s["metric"], s["unit"]) for s in few.scores] == [
        (s["metric"], s["unit"]) for s in every.scores
    ]


def test_a_run_through_a_lens_that_spreads_light_states_its_bound_among_the_errors_of_its_picture():
    """The chart is so dim that kernels are truncated. Their errors must refer to the tiles that are
    left; otherwise no error of the picture could be stated.
    """
    job = [
        *SMALL,
        "lens=diffraction_limited",
        "scene.luminance_cd_m2=1",
        "scene.step_nm=50",
        "sensor=bayer",
        "sensor.columns=20",
        "sensor.rows=10",
    ]
    few = run(compose(job))
    [lens] = [r for r in few.ledger if r.stage.startswith("lens")]
    [row] = [o for o in lens.left_out if o.why.startswith(UNSEEN)]
    [picture] = [r for r in few.ledger if r.stage.startswith("picture")]
    stated = {e.label: e.value for e in picture.errors if e.how == "bound"}
    assert 0 < row.bound <= stated["electrons of single: all after the renderer"] < 0.1


def test_the_plan_says_which_share_of_the_field_nobody_looks_at():
    rows = Ledger()
    demand = plan(
        chain(
            compose(
                [*SMALL, "sensor=ideal", "sensor.columns=20", "sensor.rows=10", "sensor.pitch_um=3"]
            )
        ),
        rows,
    )
    assert demand.window_m == pytest.approx((60e-6, 30e-6))
    [row] = [o for o in rows[0].left_out if "through the lens" in o.what]
    width = 2 * 4e-3 * np.tan(np.radians(2.0))
    assert (
        row.what
        == f"{100 * (1 - 60e-6 * 30e-6 / (width * width * 16 / 24)):.3g} % of the camera's field"
        " through the lens"
        and row.bound == 0.0
    )
    rows = Ledger()
    plan(
        chain(
            compose(
                [
                    *SMALL,
                    "lens=diffraction_limited",
                    "sensor=ideal",
                    "sensor.columns=20",
                    "sensor.rows=10",
                ]
            )
        ),
        rows,
    )
    assert not [o for o in rows[0].left_out if "of the camera's field" in o.what], (
        "the lens needs the light to tell"
    )


@dataclass(frozen=True)
class Blinkered:
    """Sensor that states half of the window that it sees."""

    rows: int = 24
    columns: int = 30

    def narrow(self, demand):
        """Return the demand for half of what it sees."""
        wide, high = (
            build("sensor", "ideal", rows=self.rows, columns=self.columns).narrow(demand).window_m
        )
        return replace(demand, window_m=(wide / 2, high / 2))

    def expected(self, light):
        """Return mean electrons."""
        return build("sensor", "ideal", rows=self.rows, columns=self.columns).expected(light)

    def __call__(self, light, generator):
        """Return a shot."""
        return build("sensor", "ideal", rows=self.rows, columns=self.columns)(light, generator)


@dataclass(frozen=True)
class Shortsighted(IdealLens):
    """Lens that spreads light to neighbouring tiles, but takes none from beyond the requested
    window.
    """

    def __call__(self, mixed, flares=(), error_allowed=0.0):
        """Return irradiance, an eighth of every tile's light spread over the rows above and
        below.
        """
        light = IdealLens.__call__(self, mixed, flares)
        y = light.dims.index("y")
        wide = np.pad(light.values, [(1, 1) if d == y else (0, 0) for d in range(light.ndim)])
        above, below = (
            np.take(wide, range(start, start + light.sizes["y"]), y) for start in (0, 2)
        )
        return light.copy(data=0.875 * light.values + np.float32(0.0625) * (above + below))

    def keeps_light(self, flares):
        """Return False, because the lens spreads light."""
        return False

    def photocurrent(self, mixed, flares, response):
        """Return irradiance in the window, from the tiles in the window only."""
        if response.window_m:
            mixed = window.cut(
                mixed,
                window.tiles(
                    mixed, [1e3 * side / self.focal_length_mm for side in response.window_m]
                ),
            )
        return self(mixed, flares)


@pytest.mark.parametrize(
    ("kind", "cls", "promise"),
    [
        ("sensor", Blinkered, "sees no light beyond the window"),
        ("lens", Shortsighted, "a window in the response does not change the light"),
    ],
)
def test_the_kit_catches_who_narrows_too_much(kind, cls, promise, offer):
    offer(kind, "narrow_minded", cls)
    with pytest.raises(AssertionError, match=promise):
        check(kind, "narrow_minded")


def test_the_kit_accepts_a_sensor_that_states_what_it_sees():
    check("sensor", "bayer", rows=24, columns=30)
