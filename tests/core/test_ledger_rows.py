"""Every row of a run states the error of its stage: a number, its unit, and how it is known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, get_args

import numpy as np
from omegaconf import open_dict

from isethdr_core import compose, run
from isethdr_core.conformance.renderer import world
from isethdr_core.data.error_costs import STORE
from isethdr_core.data.scores import Score, half_interval, state_errors
from isethdr_core.plugins.registry import components
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.storage.encoding import KEEPBITS, rounding
from isethdr_core.uncertainty import ledger

CHART = [
    "scene=point_lights",
    "scene.width=48",
    "scene.height=27",
    "~renderer",
    "lighting=ideal",
    "~versions",
    "~flare.dirt",
    "lens=ideal",
    "isp=merge",
    "sensor=bayer",
    "sensor.rows=64",
    "sensor.columns=96",
    "draws=2",
]
USED = {
    "pixel_shares",
    "dynamic_range",
    "snr_curve",
    "ciede2000",
    "ssim",
    "log_luminance_error",
    "object_contrast",
    "contrast_detection",
}
KINDS_OF_ROW = {
    "plan",
    "scene",
    "lighting",
    "lens",
    "sensor",
    "isp",
    "truth",
    "metric",
    "draws",
    "picture",
}


def check_rows(rows):
    for row in rows:
        unknown = any(omission.bound == math.inf for omission in row.left_out)
        assert row.errors or unknown, (
            f"row {row.stage!r} states no error, and not that it is unknown"
        )
        for note in row.errors:
            assert 0 <= note.value < math.inf, (row.stage, note)
            assert note.unit and note.label and note.how in get_args(ledger.How), (row.stage, note)


def test_every_row_of_a_chart_run_states_an_error():
    more = sorted(name for kind, name in components() if kind == "metric" and name not in USED)
    result = run(compose([*CHART, *(f"+metric@metric.{name}={name}" for name in more)]))
    assert {row.stage.split()[0] for row in result.ledger} == KINDS_OF_ROW
    assert sum(row.stage.startswith("metric") for row in result.ledger) == len(USED) + len(more)
    check_rows(result.ledger)


@dataclass(frozen=True)
class World:
    """A road, a lamp and a sky."""

    def __call__(self):
        """Return the description."""
        return world()


@dataclass(frozen=True)
class Flat:
    """A renderer of one level that states 3 % noise."""

    effort_fields: ClassVar[tuple] = ()

    def __call__(self, description, demand):
        """Return 12 x 8 tiles of 1e-5 W m-2 sr-1 nm-1."""
        ledger.error(0.03, "relative", "statistical", "noise")
        groups = demand.groups or description.light_groups()
        return scene_radiance(
            np.full((len(groups), 7, 8, 12), 1e-5),
            groups,
            np.linspace(400, 700, 7),
            centres(12, 0.6),
            centres(8, 0.4),
            instance=np.zeros((8, 12), np.uint32),
        )


def test_every_row_of_a_rendered_run_states_an_error_and_a_later_run_restates_the_rendering(offer):
    offer("scene", "world", World)
    offer("renderer", "flat", Flat)
    config = compose(
        [
            "scene=uniform",
            "lens=ideal",
            "lighting=ideal",
            "~versions",
            "~flare.dirt",
            "sensor=bayer",
            "sensor.rows=16",
            "sensor.columns=24",
            "draws=1",
            "~metric.contrast",
            "~metric.detection",
        ]
    )
    with open_dict(config):
        config.scene = {"name": "world"}
        config.renderer = {"name": "flat"}
    rows = {row.stage: row for row in run(config).ledger}
    check_rows(rows.values())
    rounded = rows["radiance"].error
    assert rows["renderer flat"].error == 0.03 and rows["store scene"].error == rounded <= rounding(
        KEEPBITS
    )
    allowed = next(
        e.value for e in rows["plan"].errors if "error allowed after the radiance" in e.label
    )
    # the fewest bits that are within the store's share
    assert rounded <= STORE * allowed < 2 * rounded
    assert len(rows["radiance"].errors) == 1
    config.seed = 1
    again = {row.stage: row for row in run(config).ledger}
    check_rows(again.values())
    assert "renderer flat" not in again and [e.value for e in again["radiance"].errors] == [
        rounded,
        0.03,
    ]


def stated(scores):
    rows = ledger.Ledger()
    with ledger.stage(rows, "metric"):
        state_errors(scores)
    return [(e.value, e.unit, e.how) for e in rows[0].errors]


def test_a_metric_is_as_wrong_as_half_its_widest_interval():
    whole = [
        Score("a", 1.0, "dB", "", 0.5, 2.0),
        Score("a_10", 1.0, "dB", "", 0.9, 1.1),
        Score("b", 3.0, "", "", 2.0, float("nan")),
    ]
    assert stated([*whole, Score("a", 1.0, "dB", "car", 0.0, 9.0)]) == [
        (1.0, "dB", "statistical"),
        (1.0, "1", "statistical"),
    ]
    assert stated([Score("a", 1.0, "dB", "car", 0.0, 3.0)]) == [(2.0, "dB", "statistical")]
    assert stated([Score("a", 1.0, "dB")]) == [(math.inf, "dB", "bound")] and stated([]) == [
        (0.0, "1", "bound")
    ]
    assert math.isnan(half_interval(Score("a", 1.0, "dB")))
    rows = ledger.Ledger()
    with ledger.stage(rows, "metric"):
        state_errors([Score("a", 1.0, "dB")])
    assert "a: no score has an interval; the metric states none" in rows[0].errors[0].label


def test_a_metric_that_states_its_own_error_is_left_alone():
    rows = ledger.Ledger()
    with ledger.stage(rows, "metric"):
        ledger.error(0.0, "rows", "bound", "a count")
        state_errors([Score("rows", 3.0, "rows")])
    assert [e.unit for e in rows[0].errors] == ["rows"]
