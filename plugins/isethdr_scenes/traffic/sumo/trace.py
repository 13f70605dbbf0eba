"""SUMO's report of each vehicle: place, heading, speed, acceleration and signals over time."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from enum import IntFlag
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...roads.profile import Floats

STEP_S = 0.2  # step of the simulation
SECONDS = (1, 60, 3600, 86_400)  # length of a second, a minute, an hour and a day, s


class Signal(IntFlag):
    """Bits of a vehicle's signals (SUMO's documentation, TraCI/Vehicle_Signalling)."""

    RIGHT = 1
    LEFT = 2
    HAZARD = 4
    BRAKE = 8


class State(NamedTuple):
    """A vehicle at one time."""

    front_m: Floats  # (2,) plan point of the middle of its front bumper
    heading_rad: float
    speed_m_s: float
    acceleration_m_s2: float
    signals: Signal


@dataclass(frozen=True, eq=False)
class Journey:
    """One vehicle over time."""

    name: str
    type: str  # name of its type in SUMO
    time_s: Floats  # (n,) seconds of the simulation, rising
    front_m: Floats  # (n, 2)
    heading_rad: Floats  # (n,) without jumps
    speed_m_s: Floats
    acceleration_m_s2: Floats
    signals: np.ndarray  # (n,) int

    def present(self, time_s: float) -> bool:
        """Return whether the vehicle is on the road at a second of the simulation."""
        return bool(self.time_s[0] - 1e-6 <= time_s <= self.time_s[-1] + 1e-6)

    def moved(self, by_m: Floats) -> Journey:
        """Return the journey shifted in plan by (2,) metres."""
        return replace(self, front_m=self.front_m + by_m)

    def between(self, step_s: float) -> Journey:
        """Return the journey at least every `step_s` seconds, linear between SUMO's steps."""
        if len(self.time_s) < 2 or np.diff(self.time_s).max() < 1.5 * step_s:
            return self
        count = int(np.ceil((self.time_s[-1] - self.time_s[0]) / step_s)) + 1
        time_s = np.linspace(self.time_s[0], self.time_s[-1], count)
        mix = lambda values: np.interp(time_s, self.time_s, values)
        nearest = np.searchsorted(self.time_s, time_s - 1e-6).clip(0, len(self.time_s) - 1)
        return replace(
            self,
            time_s=time_s,
            front_m=np.column_stack([mix(self.front_m[:, 0]), mix(self.front_m[:, 1])]),
            heading_rad=mix(self.heading_rad),
            speed_m_s=mix(self.speed_m_s),
            acceleration_m_s2=self.acceleration_m_s2[nearest],
            signals=self.signals[nearest],
        )

    def at(self, time_s: float) -> State:
        """Return the state of the vehicle at a second; places are linear between SUMO's steps.

        Before it enters and after it leaves, that is the first and the last state.
        """
        after = int(np.searchsorted(self.time_s, time_s - 1e-6).clip(0, len(self.time_s) - 1))
        mix = lambda values: float(np.interp(time_s, self.time_s, values))
        return State(
            np.array([mix(self.front_m[:, 0]), mix(self.front_m[:, 1])]),
            mix(self.heading_rad),
            mix(self.speed_m_s),
            float(self.acceleration_m_s2[after]),
            Signal(int(self.signals[after]) & 15),
        )


def seconds(text: str) -> float:
    """Return a time of SUMO in seconds: a number, or hours, minutes and seconds such as 1:30:00,
    with days before them.

    Raises
    ------
    ValueError : it is neither.
    """
    parts = text.strip().split(":")
    if len(parts) == 1:
        return float(parts[0])
    if not 3 <= len(parts) <= len(SECONDS):
        raise ValueError(text)
    sign = -1.0 if parts[0].startswith("-") else 1.0
    values = (abs(float(part)) for part in reversed(parts))
    return sign * sum(length * value for length, value in zip(SECONDS, values))


def read(path: Path, offset_m: Floats) -> dict[str, Journey]:
    """Return the journeys of a file that SUMO's option `fcd-output` wrote, in order of arrival.

    Parameters
    ----------
    path : file that SUMO wrote.
    offset_m : (2,) offset from the coordinates of the roads to those of SUMO, m.
    """
    rows: dict[str, list[tuple[float, ...]]] = {}
    types: dict[str, str] = {}
    names = ("x", "y", "angle", "speed", "acceleration", "signals")
    time_s = 0.0
    for event, node in ET.iterparse(path, events=("start", "end")):
        if event == "start" and node.tag == "timestep":
            time_s = seconds(node.get("time", "0"))
        elif event == "end" and node.tag == "vehicle":
            name = node.get("id", "")
            types.setdefault(name, node.get("type", ""))
            values = (float(node.get(key, "0")) for key in names)
            rows.setdefault(name, []).append((time_s, *values))
        elif event == "end" and node.tag == "timestep":
            node.clear()
    return {name: _journey(name, types[name], np.array(r), offset_m) for name, r in rows.items()}


def _journey(name: str, kind: str, rows: Floats, offset_m: Floats) -> Journey:
    # angles are degrees clockwise from north
    heading = np.unwrap(np.radians(90.0 - rows[:, 3]))
    return Journey(
        name,
        kind,
        rows[:, 0],
        rows[:, 1:3] - offset_m,
        heading,
        rows[:, 4],
        rows[:, 5],
        rows[:, 6].astype(int),
    )
