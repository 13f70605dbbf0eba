"""A plan states its omissions in its ledger row: unread labels, views without a report, and unused
light.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from isethdr_core import build, compose
from isethdr_core.demand import Demand
from isethdr_core.ledger import Ledger
from isethdr_core.motion.settings import MotionSettings
from isethdr_core.pipeline.bands import of_demand
from isethdr_core.pipeline.chain import Chain, chain, plan
from isethdr_core.quantities import LABELS
from isethdr_core.uncertainty import ledger


def planned(**parts):
    nothing = SimpleNamespace()
    rows = Ledger()
    known = {
        "scene": nothing,
        "renderer": SimpleNamespace(),
        "lighting": nothing,
        "versions": {},
        "lens": nothing,
        "flares": {},
        "cameras": {"a": nothing},
        "isp": nothing,
        "metrics": {},
    }
    return plan(Chain(**known | parts), rows), {o.what: (o.why, o.bound) for o in rows[0].left_out}


def test_labels_that_nothing_reads():
    def reads(*labels):
        return SimpleNamespace(narrow=lambda demand: demand.with_labels(*labels))

    demand, left = planned(metrics={"a": reads("instance"), "b": reads("depth")})
    assert demand.labels == {"instance", "depth"}
    why = "neither a metric nor the lens nor motion reads them"
    assert left["labels distance, category, normal"] == (why, 0.0)
    assert not any("labels" in what for what in planned(metrics={"a": reads(*LABELS)})[1])
    assert not any("labels" in what for what in planned(renderer=None)[1]), (
        "a scene that knows its light makes its labels anyway"
    )
    assert not any("labels" in what for what in planned(leave_out=False)[1])


def test_labels_of_motion_are_not_left_out_of_a_scene_that_moves():
    moving = SimpleNamespace(time_s=0.0, frames_per_s=30.0)
    demand, left = planned(scene=moving, motion=MotionSettings())
    assert demand.labels == {"distance", "instance"}
    assert "labels depth, category, normal" in left


def test_the_display_view_that_nobody_looks_at():
    assert planned(reported=False)[1]["display view of the scene"] == (
        "no report is asked for, and only it shows it",
        0.0,
    )
    assert "display view of the scene" not in planned()[1]
    assert chain(compose(["sensor=bayer", "report=false"])).reported is False


def test_chunks_of_bands_that_nobody_asks_for_are_not_read():
    scene = build("scene", "uniform", width=4, height=3)()
    rows = Ledger()
    with ledger.stage(rows, "radiance"):
        part = of_demand(scene, Demand(wavelength_nm=(500.0, 510.0, 520.0)))
        assert of_demand(scene, Demand()) is scene
    [left] = rows[0].left_out
    assert left.what == "chunks of 28 of 31 bands of the scene's light" and left.bound == 0.0
    np.testing.assert_array_equal(
        part["radiance"].values, scene["radiance"].sel(wavelength=[500.0, 510.0, 520.0]).values
    )
