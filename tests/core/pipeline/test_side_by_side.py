"""Parts that run side by side have the same results, errors and CPU seconds as in one thread."""

from __future__ import annotations

import threading
import time
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.data.derived_once import once, shared
from isethdr_core.hookspecs import hookimpl
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline.chain import camera_stages, chain, imaging, plan, through_cameras
from isethdr_core.pipeline.chain.side_by_side import (
    end_if_unwanted,
    sharing,
    side_by_side,
    threads_for,
)
from isethdr_core.pipeline.shot import Shot
from isethdr_core.plugins.registry import plugin_manager
from isethdr_core.uncertainty import ledger

WAIT_S = 20.0  # a test that waits this long has failed
_of_part = ContextVar("of_part", default=0)


def test_results_come_in_order_and_no_more_threads_work_than_may():
    working = []
    most = []

    def leaf(k):
        working.append(k)
        most.append(len(working))
        time.sleep(0.002)
        working.remove(k)
        return k

    def branch(k):
        return side_by_side([lambda n=n: leaf((k, n)) for n in range(5)])

    with sharing(3):
        results = side_by_side([lambda k=k: branch(k) for k in range(4)])
    assert results == [[(k, n) for n in range(5)] for k in range(4)]
    assert 1 < max(most) <= 3


def test_a_free_thread_helps_with_a_nested_call():
    both = threading.Barrier(2)

    def last():
        # the thread that has done the first part is free before the second of these parts begins
        return side_by_side([lambda: time.sleep(0.01), *[lambda: both.wait(WAIT_S)] * 2])

    with sharing(2):
        _, (_, *met) = side_by_side([lambda: None, last])
    assert sorted(met) == [0, 1]


def test_parts_do_not_change_each_others_context():
    def part(k):
        before = _of_part.get()
        _of_part.set(k)
        return before

    _of_part.set(7)
    with sharing(2):
        assert side_by_side([lambda k=k: part(k) for k in range(4)]) == [7] * 4
    assert _of_part.get() == 7


@pytest.mark.parametrize("threads", [1, 2])
def test_the_first_error_in_order_is_raised_though_a_later_one_comes_first(threads):
    later = threading.Event()

    def early():
        if threads > 1:
            assert later.wait(WAIT_S)
        raise ValueError("early")

    def late():
        later.set()
        raise KeyError("late")

    with sharing(threads), pytest.raises(ValueError, match="early"):
        side_by_side([early, late])


def test_later_parts_end_at_their_next_stage_and_earlier_ones_are_finished():
    going = threading.Event()
    ended = threading.Event()
    finished = []

    def waits_for_the_end_of_the_last():
        assert ended.wait(WAIT_S)
        end_if_unwanted()
        finished.append("first")

    def fails():
        assert going.wait(WAIT_S)
        raise ValueError("second")

    def endless():
        going.set()
        try:
            while True:
                time.sleep(0.001)
                end_if_unwanted()
        finally:
            ended.set()

    parts = [waits_for_the_end_of_the_last, fails, endless, lambda: finished.append("last")]
    with sharing(3), pytest.raises(ValueError, match="second"):
        side_by_side(parts)
    assert finished == ["first"]


def test_an_interrupt_ends_the_other_parts():
    going = threading.Event()

    def interrupted():
        assert going.wait(WAIT_S)
        raise KeyboardInterrupt

    def endless():
        going.set()
        while True:
            time.sleep(0.001)
            end_if_unwanted()

    before = threading.active_count()
    with sharing(2), pytest.raises(KeyboardInterrupt):
        side_by_side([endless, interrupted])
    assert threading.active_count() == before


def test_a_stage_counts_the_seconds_of_its_helpers_and_of_nobody_else():
    ready = threading.Barrier(2)

    def busy(seconds):
        ready.wait(WAIT_S)
        end = time.thread_time() + seconds
        while time.thread_time() < end:
            pass

    def with_help():
        rows = Ledger()
        with ledger.stage(rows, "draws"):
            side_by_side([lambda: busy(0.02)] * 2)
        return rows[0].cpu_s

    with sharing(3):  # of two threads, the helper might still be busy
        (both_s,) = side_by_side([lambda: None, with_help])[1:]
    # the parts add up; what else the threads do takes less than half a part
    assert 0.04 <= both_s < 0.05

    def alone():
        rows = Ledger()
        with ledger.stage(rows, "isp"):
            busy(0.02)
        return rows[0].cpu_s

    with sharing(2):
        assert all(0.02 <= own_s < 0.03 for own_s in side_by_side([alone] * 2))


def test_what_is_derived_once_is_computed_once_by_two_threads():
    source = object()
    calls = []

    def compute():
        calls.append(threading.get_ident())
        time.sleep(0.01)  # the other thread calls `once` meanwhile
        return object()

    with shared(source), sharing(2):
        first, second = side_by_side([lambda: once("law", (source,), compute)] * 2)
    assert first is second and len(calls) == 1


# --- cameras of a run -----------------------------------------------------------------------------

METRICS = ("shares", "dynamic_range", "log_luminance")


@dataclass(frozen=True)
class Broken:
    """A sensor that fails."""

    THREAD_SAFE: ClassVar[bool] = True
    text: str = ""

    def __call__(self, light, generator):
        """Raise an error."""
        raise ValueError(self.text)


@pytest.fixture(scope="module")
def small_shot():
    """Return the chain of two cameras, one with three noise realisations, and their light."""
    config = hdr.compose(
        [
            "experiment=five_lights",
            "scene=macbeth",
            "scene.width=24",
            "scene.height=16",
            "~flare.dirt",
            "~renderer",
            "lens=ideal",
            "isp=linear",
            "sensor=bayer",
            "sensor.rows=12",
            "sensor.columns=18",
            "lens.focal_length_mm=0.125",
            "draws=3",
            "report=false",
        ]
    )
    parts = chain(config)
    sensor = parts.cameras["bayer"]
    cameras = {"exact": replace(sensor, exposure_s=0.004, noise=False), "noisy": sensor}
    metrics = {name: parts.metrics[name] for name in METRICS}
    parts = replace(parts, cameras=cameras, metrics=metrics)
    demand = plan(parts, Ledger())
    scene = parts.scene().load()
    mixed = parts.lighting(scene)
    made = imaging(parts, mixed, demand)
    random = hdr.generator(seed=3, device="A", scene="chart")
    return parts, Shot(made.light(), mixed, scene, random, made)


def stated(rows):
    """Return the rows of a ledger without seconds and memory."""
    return [(row.stage, row.errors, row.left_out) for row in rows]


def test_cameras_have_the_same_results_with_one_thread_and_with_two(small_shot, monkeypatch):
    parts, shot = small_shot
    found = {}
    rows = {}
    for threads in (1, 2):
        monkeypatch.setattr(camera_stages, "threads_for", lambda components, n=threads: n)
        rows[threads] = Ledger()
        found[threads] = through_cameras(parts, rows[threads], shot)
    one, two = (stated(rows[threads]) for threads in (1, 2))
    # the text of a picture's error names the seconds that it took
    assert [row[0] for row in one] == [row[0] for row in two]
    assert [row for row in one if not row[0].startswith("picture")] == [
        row for row in two if not row[0].startswith("picture")
    ]
    assert list(found[1]) == list(found[2]) == ["exact", "noisy"]
    for name, camera in found[1].items():
        other = found[2][name]
        assert camera.captures.identical(other.captures)
        assert camera.picture.identical(other.picture)
        assert camera.truth.identical(other.truth)
        np.testing.assert_equal(camera.scores, other.scores)


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_of_one_camera_is_the_error_of_the_run(threads, small_shot, monkeypatch):
    parts, shot = small_shot
    cameras = {"good": parts.cameras["exact"], "first": Broken("one"), "second": Broken("two")}
    monkeypatch.setattr(camera_stages, "threads_for", lambda components: threads)
    with pytest.raises(ValueError, match="one") as caught:
        through_cameras(replace(parts, cameras=cameras, metrics={}), Ledger(), shot)
    assert caught.value.__notes__ == ["in stage sensor first"]


def test_threads_only_call_what_allows_it(monkeypatch):
    class Watching:
        @hookimpl
        def isethdr_before_stage(self, stage):
            """Look at a stage."""

    class Undeclared:
        pass

    monkeypatch.setattr("os.sched_getaffinity", lambda process: set(range(4)))
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    assert threads_for([Broken(), Broken()]) == 4
    assert threads_for([Broken(), Undeclared()]) == 1
    assert threads_for([type("Withdrawn", (Broken,), {"THREAD_SAFE": False})()]) == 1
    plugin = Watching()
    plugin_manager().register(plugin)
    try:
        assert threads_for([Broken()]) == 1
        plugin.THREAD_SAFE = True
        assert threads_for([Broken()]) == 4
    finally:
        plugin_manager().unregister(plugin)
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert threads_for([Broken()]) == 2
    monkeypatch.setenv("OMP_NUM_THREADS", "2,1")  # for nested parallel regions
    assert threads_for([Broken()]) == 2
