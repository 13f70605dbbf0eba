"""Check a network without meshes: gaps of lines, steps between lanes, widths, curvature."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .lane_path import LanePath
from .network import Network
from .road import Road

GAP_M = 0.01  # largest gap between records and between lanes that follow each other
TURN_RAD = 2e-3  # largest kink between them
STEP_M = 1.0  # spacing of the places at which widths are checked
WIDE_ENOUGH_M = 0.3  # a narrower lane begins or ends as a taper; its steps are not checked


class Problem(NamedTuple):
    """What is wrong, where, and by how much."""

    road: str
    what: str
    s_m: float
    amount: float

    def __str__(self) -> str:
        return f"road {self.road}, s = {self.s_m:.2f} m: {self.what} ({self.amount:.4g})"


def problems(
    network: Network,
    curvature_limit_per_m: float = np.inf,
    widths_m: Mapping[str, tuple[float, float]] | None = None,
) -> list[Problem]:
    """Return everything that is wrong with a network; an empty list if nothing is.

    Parameters
    ----------
    network : roads and junctions.
    curvature_limit_per_m : largest allowed curvature of a reference line, 1/m.
    widths_m : least and greatest width by type of lane, m; other types are not checked.
    """
    found: list[Problem] = []
    for road in network.roads:
        found += _gaps(road) + _bends(road, curvature_limit_per_m)
        found += _widths(road, widths_m or {})
    for path in network.lanes():
        for key in network.successors(path.key):
            found += _steps(path, network.lane(key))
    return found


def _gaps(road: Road) -> list[Problem]:
    return [
        Problem(road.name, "the reference line has a gap or a kink, m", gap.s_m, gap.gap_m)
        for gap in road.line.gaps(GAP_M, TURN_RAD)
    ]


def _bends(road: Road, limit: float) -> list[Problem]:
    records = road.line.records
    worst = max(records, key=lambda r: r.largest_per_m)
    curvature = worst.largest_per_m
    if curvature <= limit:
        return []
    return [Problem(road.name, "the curvature is too large, 1/m", worst.start_m, curvature)]


def _widths(road: Road, allowed: Mapping[str, tuple[float, float]]) -> list[Problem]:
    found = []
    for k, section in enumerate(road.sections):
        first, last = road.span(k)
        ds = np.linspace(0, last - first, max(2, int((last - first) / STEP_M) + 1))
        for lane in section.lanes:
            width = lane.width.at(ds)
            low, high = allowed.get(lane.type, (0.0, np.inf))
            off = np.maximum(np.maximum(low - width, width - high), 0)
            worst = int(np.argmax(off))
            if off[worst] > 1e-6:
                what = f"lane {lane.number} ({lane.type}) is too narrow or too wide, m"
                found.append(Problem(road.name, what, first + ds[worst], float(width[worst])))
    return found


def _steps(before: LanePath, after: LanePath) -> list[Problem]:
    """Return the steps and kinks between a lane and its successor."""
    if min(before.width_m(before.length_m), after.width_m(0.0)) < WIDE_ENOUGH_M:
        return []
    end = before.at(before.length_m)
    start = after.at(0.0)
    s = float(before.along_road(before.length_m))
    apart = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    turn = float(np.arccos(np.clip(end[:3, 0] @ start[:3, 0], -1, 1)))
    onto = f"to road {after.road.name}, lane {after.lane.number}"
    found = []
    if apart > GAP_M:
        found.append(Problem(before.road.name, f"the lane steps aside {onto}, m", s, apart))
    if turn > TURN_RAD:
        found.append(Problem(before.road.name, f"the lane has a kink {onto}, rad", s, turn))
    return found
