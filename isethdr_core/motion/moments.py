"""Moments: the windows of time of the sub-frames of a shot, as modulations of their light.

Sub-frame k of K shows the scene at the moment k T / (K - 1) of a shot of T seconds, and its light
lasts half a step before and after it (the trapezoidal rule). The light of a window is described as
light that pulses once per shot: its frequency is 1 / T and its duty the length of the window / T.
The mean over time of all sub-frames is therefore their sum, as for lamps that pulse.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np

from ..physics.detector.temporal_modulation import Modulation, constant, light_s

PIECES_PER_PERIOD = 8  # pieces of a ripple per period, so that each piece is nearly straight


class Window(NamedTuple):
    """A piece of a shot, in seconds after its start."""

    start_s: float
    end_s: float


class SubFrame(NamedTuple):
    """A moment of a shot, and the window that shows it."""

    moment_s: float
    window: Window


class TimedLight(NamedTuple):
    """A modulation, and the factor by which the lamp's mean light over time is multiplied."""

    modulation: Modulation
    factor: float


def sub_frames(shot_s: float, count: int) -> list[SubFrame]:
    """Return `count` sub-frames, 2 or more, that fill a shot of `shot_s` seconds."""
    step_s = shot_s / (count - 1)
    ends = [0.0, *((k + 0.5) * step_s for k in range(count - 1)), shot_s]
    moments = [k * step_s for k in range(count)]
    windows = zip(ends[:-1], ends[1:], strict=True)
    return [SubFrame(at, Window(*w)) for at, w in zip(moments, windows, strict=True)]


def within(window: Window, shot_s: float, modulation: Modulation) -> list[TimedLight]:
    """Return the light of a modulated lamp within a window, as pulses once per shot.

    Pulses are cut exactly at the window. A ripple is cut into pieces of an eighth of its period,
    each constant at its exact mean.

    Parameters
    ----------
    window : window of the sub-frame, within the shot.
    shot_s : duration of the shot, s.
    modulation : modulation of the lamp over all time; constant light fills the whole window.
    """
    if constant(modulation):
        return [_pulse(window, shot_s, 1.0)]
    if modulation.depth:
        count = ceil(PIECES_PER_PERIOD * modulation.frequency_hz * (window.end_s - window.start_s))
        edges = np.linspace(window.start_s, window.end_s, max(count, 1) + 1)
        levels = light_s(modulation, edges[:-1], np.diff(edges)) / np.diff(edges)
        pieces = zip(edges[:-1], edges[1:], levels, strict=True)
        return [_pulse(Window(a, b), shot_s, float(level)) for a, b, level in pieces]
    return [_pulse(lit, shot_s, 1 / modulation.duty) for lit in _lit(window, modulation)]


def _lit(window: Window, modulation: Modulation) -> list[Window]:
    """Return the parts of a window in which a lamp that pulses is on."""
    period_s = 1 / modulation.frequency_hz
    first = int(np.floor(window.start_s / period_s + modulation.phase)) - 1
    last = int(np.ceil(window.end_s / period_s + modulation.phase)) + 1
    found = []
    for number in range(first, last + 1):
        on_s = (number - modulation.phase) * period_s
        start_s = max(on_s, window.start_s)
        end_s = min(on_s + modulation.duty * period_s, window.end_s)
        if end_s > start_s:
            found.append(Window(start_s, end_s))
    return found


def _pulse(window: Window, shot_s: float, level: float) -> TimedLight:
    """Return light of a relative level that lasts for a window of each shot."""
    duty = min((window.end_s - window.start_s) / shot_s, 1.0)
    phase = 1 - window.start_s / shot_s if window.start_s else 0.0
    return TimedLight(Modulation(1 / shot_s, duty, 0.0, phase), level * duty)
