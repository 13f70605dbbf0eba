"""Speed of the processor, relative to that on which the constants of estimates were measured."""

from __future__ import annotations

import pytest

from isethdr_core.pipeline.runtime_estimate import machine_speed, relative_speed


def test_tasks_that_take_half_as_long_mean_twice_the_speed(monkeypatch):
    taken = iter([machine_speed.TRANSFORM_S, machine_speed.GATHER_S, machine_speed.SUMS_S])
    monkeypatch.setattr(machine_speed, "_shortest_s", lambda task: next(taken) / 2)
    assert relative_speed.__wrapped__() == pytest.approx(2.0)


def test_the_speed_is_repeatable():
    """Measure the speed several times.

    A quarter: repeats on machines with and without other work differed by at most 8 %.
    """
    speeds = [relative_speed.__wrapped__() for _ in range(3)]
    assert max(speeds) < 1.25 * min(speeds)
