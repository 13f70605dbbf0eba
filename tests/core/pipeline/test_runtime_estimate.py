"""The run time estimate follows from stored runs, scaled by size. Without stored runs there is no
estimate.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from isethdr_core import compose, run
from isethdr_core.cli.summary_tables import ledger_table, runtime_estimate_table, together
from isethdr_core.demand import Demand
from isethdr_core.motion.run_time import sub_frame_work
from isethdr_core.motion.shot_time import shot_time
from isethdr_core.pipeline.chain import chain
from isethdr_core.pipeline.memory import Frame
from isethdr_core.pipeline.memory_estimate import PROGRAM_BYTES, STATED
from isethdr_core.pipeline.runtime_estimate import (
    IMAGING,
    LOADING_S,
    elapsed_s,
    expected_s,
    expected_times,
    size,
    stages,
)
from isethdr_core.pipeline.runtime_estimate.rendering import ratio_by_samples
from isethdr_core.runs.provenance import described
from isethdr_core.runs.run import plain

from .test_chain import SMALL

FAST = [*SMALL, "sensor=ideal", "report=false", "draws=2"]


def estimate(overrides):
    config = compose(overrides)
    return expected_s(chain(config), plain(config), None)


def test_nothing_is_expected_where_nothing_is_stored():
    assert estimate(FAST) == {}


def test_seconds_of_stored_runs_grow_with_tiles_or_pixels():
    result = run(compose(FAST))
    busy = {row.stage: min(row.seconds, row.cpu_s) for row in result.ledger}
    loading = {row.stage: min(busy[row.stage], LOADING_S * row.modules) for row in result.ledger}
    assert result.attributes["expected_s"] == {}
    assert result.attributes[STATED] > PROGRAM_BYTES
    same = estimate([*FAST, "seed=1"])
    four = estimate([*FAST, "scene.width=48", "scene.height=32"])
    assert same == pytest.approx({stage: busy[stage] for stage in same})
    of_light = {"scene uniform", "lighting ideal", "lens ideal"}
    of_camera = {"sensor ideal", "isp ideal", "draws ideal", "metric mean ideal", "picture ideal"}
    assert of_light | of_camera | {"plan"} <= same.keys()
    for stage in of_light:
        growing = busy[stage] - loading[stage]
        assert four[stage] == pytest.approx(loading[stage] + 4 * growing)
    # as many pixels as before fill the same field, and a plan does not grow
    assert all(four[stage] == pytest.approx(same[stage]) for stage in of_camera | {"plan"})
    again = run(compose([*FAST, "seed=1"]))
    assert again.attributes["expected_s"] == pytest.approx(same)


def stored_run(config, rows, **more):
    return {"config": config, "ledger": rows, **more}


def test_waiting_for_other_programs_is_not_estimated(monkeypatch):
    config = plain(compose(FAST))
    rows = [
        {"stage": "isp ideal", "seconds": 9.0, "cpu_s": 2.0},
        {"stage": "lens ideal", "seconds": 3.0, "cpu_s": 5.0},  # two threads
        {"stage": "plan", "seconds": 1.0},  # written by an earlier version
    ]
    monkeypatch.setattr(expected_times, "newest", lambda kind: [stored_run(config, rows)])
    assert estimate(FAST) == {"isp ideal": 2.0, "lens ideal": 3.0, "plan": 1.0}


def test_a_run_that_states_no_size_is_no_measure_of_one_that_does(monkeypatch):
    """The config does not state the number of tiles of a file; they would count as one tile."""
    config = plain(compose(FAST))
    of_file = {**config, "scene": {"name": "file", "path": "street.exr"}}
    rows = [{"stage": s, "seconds": 2.0} for s in ("lens ideal", "isp ideal", "plan")]
    for more, found in (({}, {"plan": 2.0}), ({"pixel_bytes": {"ideal": 1e3}}, {"isp ideal": 4.0})):
        stored = stored_run(of_file, rows, **more)
        monkeypatch.setattr(expected_times, "newest", lambda kind, stored=stored: [stored])
        monkeypatch.setattr(expected_times, "pixel_bytes", lambda chain: {"ideal": 2e3})
        assert estimate(FAST) == {"plan": 2.0} | found


@pytest.mark.parametrize("modules", [0, 500])
def test_the_loading_of_libraries_does_not_grow_with_the_picture(monkeypatch, modules):
    """A tiny run of n tiles takes a + b n seconds, and a run of N tiles a + b N: a for loading
    libraries, b for the work per tile.
    """
    loading_s = LOADING_S * modules
    tiny = plain(compose([*FAST, "scene.width=96", "scene.height=54"]))
    each_s = 1e-5  # per tile
    row = {"stage": "scene uniform", "cpu_s": loading_s + 96 * 54 * each_s, "modules": modules}
    rows = [row | {"seconds": 60.0}, {"stage": "plan", "seconds": 0.1, "cpu_s": 0.1}]
    monkeypatch.setattr(expected_times, "newest", lambda kind: [stored_run(tiny, rows)])
    expected = estimate([*FAST, "scene.width=640", "scene.height=360"])
    scene_s = loading_s + 640 * 360 * each_s
    assert expected == pytest.approx({"scene uniform": scene_s, "plan": 0.1})


def test_a_stored_stage_with_the_same_settings_is_preferred(monkeypatch):
    same = plain(compose(FAST))
    other = {**same, "isp": {"name": "merge", "demosaic": "menon"}}
    runs = [
        stored_run(other, [{"stage": "isp ideal", "seconds": 50.0}]),
        stored_run(same, [{"stage": "isp ideal", "seconds": 2.0}], pixel_bytes={"ideal": 1e3}),
    ]
    monkeypatch.setattr(expected_times, "newest", lambda kind: runs)
    monkeypatch.setattr(expected_times, "pixel_bytes", lambda chain: {"ideal": 2e3})
    # the stage of half the size counts, because its settings are the same
    assert estimate(FAST) == {"isp ideal": 4.0}


def test_records_without_cpu_time_are_used_for_stages_that_have_no_other(monkeypatch):
    same = plain(compose(FAST))
    other = {**same, "isp": {"name": "merge"}, "scene": {**same["scene"], "width": 240}}
    with_cpu = [{"stage": stage, "seconds": 9.0, "cpu_s": 2.0} for stage in ("isp ideal", "plan")]
    without = [{"stage": s, "seconds": 100.0} for s in ("isp ideal", "plan", "lighting ideal")]
    for runs in ([(other, with_cpu), (same, without)], [(same, without), (other, with_cpu)]):
        stored = [stored_run(config, rows) for config, rows in runs]
        monkeypatch.setattr(expected_times, "newest", lambda kind, stored=stored: stored)
        # the record with CPU time has ten times as many tiles; the record without is nearer in size
        # and settings
        assert estimate(FAST) == pytest.approx(
            {"isp ideal": 0.2, "plan": 2.0, "lighting ideal": 100.0}
        )


def test_draws_take_as_long_as_there_are_more_of_them(monkeypatch):
    config = plain(compose(FAST))  # 2 draws: one beyond the picture itself
    rows = [{"stage": "draws ideal", "seconds": 2.0}, {"stage": "isp ideal", "seconds": 1.0}]
    monkeypatch.setattr(expected_times, "newest", lambda kind: [stored_run(config, rows)])
    assert estimate([*FAST, "draws=8"]) == {"draws ideal": 14.0, "isp ideal": 1.0}


class Tells:
    """A lens that expects one second for each row of its frame, or that cannot tell."""

    def __init__(self, tells=True):
        self.tells = tells

    def plan(self, flares, field, response, budget):
        """No light is made here."""

    def expected_s(self, frame, flares):
        return float(frame.rows) if self.tells else None


def test_a_lens_that_can_tell_is_believed_and_corrected_by_what_runs_took(monkeypatch):
    parts = chain(compose(FAST))
    config = plain(compose(FAST))
    frame = Frame(100, 200, (1e-3, 1e-3), (500.0, 600.0), True)

    def lens_s(lens, *rows):
        stored = [{"config": config, "ledger": [row], IMAGING: then} for row, then in rows]
        monkeypatch.setattr(expected_times, "newest", lambda kind: stored)
        known = expected_s(replace(parts, lens=lens), config, None, frame)
        return known.get("lens ideal")

    def took(seconds, **more):
        return {"stage": "lens ideal", "seconds": seconds, **more}

    assert lens_s(Tells()) == 100.0
    # the run whose estimate was nearest took twice its estimate
    assert lens_s(Tells(), (took(5.0), 10.0), (took(160.0), 80.0)) == pytest.approx(200.0)
    assert lens_s(Tells(), (took(0.1, reused=True), 90.0), (took(5.0), 10.0)) == pytest.approx(50.0)
    # a lens that cannot tell, or does not plan its light, takes what stored runs took
    assert lens_s(Tells(False), (took(5.0), None)) == 5.0
    assert expected_s(replace(parts, lens=Tells()), config, None) == {"lens ideal": 5.0}


MOVING = [
    "scene=moving_target",
    "~renderer",
    "lighting=ideal",
    "lens=ideal",
    "~flare.dirt",
    "sensor=bayer",
    "sensor.pitch_um=30",
    "isp=merge",
    "report=false",
    "motion.within_exposure=true",
]


def test_sub_frames_are_made_imaged_and_sensed_one_by_one(monkeypatch):
    config = plain(compose([*MOVING, "motion.sub_frames=5"]))
    parts = chain(compose([*MOVING, "motion.sub_frames=5"]))
    took = {"scene moving_target": 2.0, "motion": 50.0, "lens ideal": 3.0, "isp bayer": 1.0}
    rows = [{"stage": stage, "seconds": seconds} for stage, seconds in took.items()]
    record = {"moments_s": [0.0, 0.1, 0.2], "motion_px": 2.0, "shot_s": 0.2}
    stored = {"config": config, "ledger": rows, "scene": described(parts.scene), "motion": record}
    monkeypatch.setattr(expected_times, "newest", lambda kind: [stored])
    moving = sub_frame_work(parts, Demand(), [stored])
    known = expected_s(parts, config, None, None, moving)
    assert moving.count == 5 and not moving.to_render
    assert known["motion"] == 4 * 2.0  # all sub-frames but the first
    assert known["lens ideal"] == pytest.approx(3.0 * 5 / 3)
    assert known["isp bayer"] == 1.0
    assert "motion" in stages(parts, config, None)


def test_the_number_of_sub_frames_follows_from_a_stored_run_or_is_not_known():
    parts = chain(compose([*MOVING, "motion.step_px=0.5"]))
    shot_s = shot_time(parts.scene, parts.lens, parts.cameras).seconds
    record = {"moments_s": [0.0, 0.1], "motion_px": 2.0, "shot_s": shot_s / 3}
    stored = {"scene": described(parts.scene), "motion": record}
    # three times the stored time gives 6 pixels: 12 steps of half a pixel
    assert sub_frame_work(parts, Demand(), [{"scene": {}}, stored]).count == 13
    assert sub_frame_work(parts, Demand(), []).count is None
    still = chain(compose([*MOVING, "motion.within_exposure=false"]))
    assert sub_frame_work(still, Demand(), [stored]) is None


def test_all_stages_of_a_run_are_estimated_and_in_its_order():
    config = compose(FAST)
    planned = stages(chain(config), plain(config), None)
    happened = [row.stage for row in run(config).ledger]
    assert [stage for stage in happened if stage in planned] == planned


def test_light_goes_band_by_band_and_pictures_do_not():
    config = plain(compose([*SMALL, "sensor=ideal"]))
    assert size(config, "lens") == pytest.approx(31 * size(config, "isp"))


@pytest.mark.parametrize(
    "fields",
    [
        {"first_nm": 400.0, "step_nm": 10.0},
        {"first_nm": 700.0, "last_nm": 400.0, "step_nm": 10.0},
        {"first_nm": "violet", "last_nm": "red", "step_nm": 10.0},
        {"step_nm": 10.0},
        {"width": 0, "height": 16},
        {"width": "wide", "height": "high"},
        {"width": None},
    ],
)
def test_fields_of_other_plugins_that_tell_no_size_count_once(fields):
    config = {"scene": {"name": "theirs", **fields}}
    assert size(config, "lens") == size(config, "isp") == 1.0


def test_a_sum_with_an_unknown_part_is_unknown():
    assert together({"metric a x": 1.0, "metric b x": None, "lens l": 2.0}) == {
        "metrics x": None,
        "lens l": 2.0,
    }
    from rich.console import Console

    console = Console(width=120, record=True, file=open("/dev/null", "w"))
    console.print(runtime_estimate_table({"lens l": 2.0, "isp x": None}))
    console.print(ledger_table([], expected={}))
    text = console.export_text()
    assert "2.0 s + 1 stage without a stored example" in text and "?" in text


def test_the_cameras_share_their_threads_and_what_comes_before_them_does_not():
    expected = {"lens l": 2.0, "sensor a": 3.0, "isp a": 1.0, "sensor b": 4.0, "draws b": None}
    assert elapsed_s(expected, 1) == 10.0
    assert elapsed_s(expected, 2) == 2.0 + 8.0 / 2


def test_a_renderer_is_expected_to_take_longer_for_more_paths_groups_and_tiles():
    stored = {
        "renderer": {"width": 10, "height": 4},
        "wavelength_nm": [500.0, 600.0],
        "groups": ["sky", "lamps"],
        "all_groups": ["sky", "lamps"],
        "path_span": {"sky": [0, 20], "lamps": [0, 60]},
        "noise": {"sky": 0.1, "lamps": 0.2},
    }
    now = {"width": 20, "height": 4, "first_nm": 500.0, "last_nm": 600.0, "step_nm": 100.0}
    both = Demand()

    class GoesOn:
        def expected_paths(self, paths, noise):
            return paths * (noise / 0.1) ** 2

    assert ratio_by_samples(object(), now, both, stored) == pytest.approx(2.0)  # twice the tiles
    assert ratio_by_samples(GoesOn(), now, both, stored) == pytest.approx(2.0 * (20 + 240) / 80)
    assert ratio_by_samples(GoesOn(), now, Demand(groups=("sky",)), stored) == pytest.approx(
        2.0 * 20 / 80
    )
    # a group without a record counts as the mean of the known groups
    assert ratio_by_samples(
        GoesOn(), now, Demand(groups=("sky", "other")), stored
    ) == pytest.approx(2.0 * (20 + 130) / 80)
    assert ratio_by_samples(object(), now, both, {**stored, "path_span": {}}) == pytest.approx(2.0)


@pytest.mark.parametrize(
    "changed",
    [
        {"groups": [], "all_groups": []},
        {"groups_from": {"sky": "abc", "lamps": "abc"}},
        {"path_span": {"sky": [8, 8], "lamps": [8, 8]}},
    ],
    ids=["no groups", "all groups taken over", "no paths"],
)
def test_a_store_without_a_group_of_its_own_is_no_measure(changed, monkeypatch):
    parts = replace(chain(compose(FAST)), renderer=object())
    config = plain(compose(FAST))
    config["renderer"] = {"name": "acme", "width": 10, "height": 4}
    stored = {
        "scene": {"component": "scene/other"},
        "renderer": {"width": 10, "height": 4},
        "wavelength_nm": [500.0, 600.0],
        "groups": ["sky", "lamps"],
        "all_groups": ["sky", "lamps"],
        "ledger": [{"stage": "renderer acme", "seconds": 9.0, "cpu_s": 6.0}],
    }
    monkeypatch.setattr(expected_times, "same_class", lambda stored, scene: True)

    def expected(**changes):
        scenes = [{**stored, **changes}]
        monkeypatch.setattr(expected_times, "newest", lambda k: scenes if k == "scenes" else [])
        return expected_s(parts, config, Demand())

    assert "renderer acme" in expected()
    assert "renderer acme" not in expected(**changed)


class Guesses:
    """A renderer that expects one second per row and light group, and limits noise by cameras."""

    def __call__(self, description, demand=None):
        """No light is made here."""

    def rendering_s(self, frame, groups):
        return float(frame.rows) * (groups or 4)

    def limit_share(self):
        return 0.5


def test_a_renderer_guesses_where_nothing_is_stored_of_the_scene(monkeypatch):
    parts = chain(compose(FAST))
    config = plain(compose(FAST))
    parts = replace(parts, renderer=Guesses())
    config["renderer"] = {"name": "guesses"}
    frame = Frame(100, 200, (1e-3, 1e-3), (500.0, 600.0), True)
    monkeypatch.setattr(expected_times, "newest", lambda kind: [])
    seconds = lambda demand: expected_s(parts, config, demand, frame).get("renderer guesses")
    assert seconds(Demand()) == 400.0 and seconds(Demand(groups=("sky",))) == 100.0
    assert seconds(None) is None  # all is stored


def test_radiance_that_a_program_of_a_user_has_stored_is_no_measure(monkeypatch):
    parts = replace(chain(compose(FAST)), renderer=Guesses())
    config = plain(compose(FAST)) | {"renderer": {"name": "guesses"}}
    stored = {"scenes": [{"kind": "scene"}], "runs": []}
    monkeypatch.setattr(expected_times, "newest", lambda kind: stored[kind])
    assert "renderer guesses" not in expected_s(parts, config, Demand())


def test_a_guess_is_corrected_by_a_stored_rendering_of_any_scene(monkeypatch):
    """The stored rendering took three times its guess of 200 s (50 rows, 4 groups), so this one is
    expected to take three times its own, 400 s.
    """
    config = plain(compose(FAST))
    parts = replace(chain(compose(FAST)), renderer=Guesses())
    config["renderer"] = {"name": "guesses", "width": 200, "height": 100}
    stored = {
        "scene": {"component": "scene/other"},
        "renderer": {"width": 200, "height": 50},
        "wavelength_nm": [500.0, 600.0],
        "groups": ["lamps"],
        "all_groups": ["lamps"],
        "path_span": {"lamps": [0, 60]},
        "limit_share": 0.5,
        "ledger": [{"stage": "renderer guesses", "seconds": 900.0, "cpu_s": 600.0}],
    }
    frame = Frame(100, 200, (1e-3, 1e-3), (500.0, 600.0), True)

    def seconds(**changed):
        scenes = [{**stored, **changed}]
        monkeypatch.setattr(expected_times, "newest", lambda k: scenes if k == "scenes" else [])
        return expected_s(parts, config, Demand(), frame)["renderer guesses"]

    assert seconds() == pytest.approx(1200.0)
    # these renderings are no measure: a coarser one, a continued one, and one with light groups
    # taken from another rendering
    for changed in (
        {"limit_share": 1.0},
        {"path_span": {"lamps": [60, 90]}},
        {"groups_from": {"lamps": "abc"}},
    ):
        assert seconds(**changed) == 400.0


def test_a_smaller_share_of_the_noise_is_expected_to_take_more_samples():
    stored = {
        "renderer": {"width": 20, "height": 4},
        "wavelength_nm": [500.0, 600.0],
        "groups": ["lamps"],
        "all_groups": ["lamps"],
        "path_span": {"lamps": [0, 60]},
        "limit_share": 1.0,
    }
    now = {"width": 20, "height": 4, "first_nm": 500.0, "last_nm": 600.0, "step_nm": 100.0}
    assert ratio_by_samples(Guesses(), now, Demand(), stored) == pytest.approx(4.0)
    assert ratio_by_samples(Guesses(), now, Demand(), {**stored, "limit_share": None}) == 1.0
