"""Gaps: places where geometries of a road, or the lanes of linked roads, do not meet."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..lane_path import LanePath
from ..network import Network
from ..road import Road
from .elements import Node

# largest distances between ends that should meet, in plan and in height
GAP_M = 0.1
STEP_M = 0.1
KINK_RAD = 0.02  # larger turns between two geometries are noted
NARROW_M = 0.5  # a lane narrower than this at its end is a taper and is not checked


def check_line(road: Road, node: Node) -> None:
    """Raise CatalogError at the first gap between two geometries; note kinks."""
    records = road.line.records
    for number, (before, after) in enumerate(zip(records, records[1:]), 2):
        end = before.end
        start = after.at(0.0)
        apart = float(np.hypot(start.x_m - end.x_m, start.y_m - end.y_m))
        along = abs(after.start_m - before.start_m - before.length_m)
        if max(apart, along) > GAP_M:
            what = "starts" if apart >= along else "states an s"
            raise node.error(
                f"geometry {number} at s = {after.start_m:.2f} m {what} {max(apart, along):.3f} m"
                f" from the end of the one before; expected at most {GAP_M:g} m"
            )
        turn = float(start.heading_rad - end.heading_rad + np.pi) % (2 * np.pi) - np.pi
        if abs(turn) > KINK_RAD:
            node.note(f"the reference line has kinks of more than {KINK_RAD:g} rad")


def check_lanes(network: Network, nodes: Mapping[str, Node]) -> None:
    """Raise CatalogError where a driving lane does not meet the lane that follows it."""
    for path in network.lanes():
        for key in network.successors(path.key):
            _check_step(path, network.lane(key), nodes[path.road.name])


def _check_step(before: LanePath, after: LanePath, node: Node) -> None:
    widths = before.width_m(before.length_m), after.width_m(0.0)
    if min(widths) < NARROW_M:
        return
    end = before.points(before.length_m)
    start = after.points(0.0)
    # lanes of different widths share a border, so their middles may differ by half the difference
    slack = abs(float(widths[0] - widths[1])) / 2
    apart = float(np.hypot(*(start - end)[:2])) - slack
    step = abs(float(start[2] - end[2]))
    if apart <= GAP_M and step <= STEP_M:
        return
    s = float(before.along_road(before.length_m))
    amount, limit = (apart, GAP_M) if apart > GAP_M else (step, STEP_M)
    what = "beside" if apart > GAP_M else "above or below"
    raise node.error(
        f"lane {before.lane.number} ends at s = {s:.2f} m {amount:.3f} m {what} lane"
        f" {after.lane.number} of road {after.road.name}, which follows it; expected at most"
        f" {limit:g} m"
    )
