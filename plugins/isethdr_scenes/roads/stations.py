"""Stations: places along a road, dense where it bends and far apart where it is straight."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .profile import Floats
from .road import Road

# largest distances between a chord and the surface
PLAN_M = 4e-3
HEIGHT_M = 1e-3
# least and greatest distance between two stations
LEAST_M = 0.4
MOST_M = 10.0
LOOK_M = 1.0  # spacing of the places at which bends are sampled


@lru_cache(maxsize=256)
def _cached(road: Road) -> Floats:
    ends = sorted(_breaks(road))
    parts = [np.array([ends[0]])]
    for first, last in zip(ends, ends[1:]):
        if last - first < 1e-6:
            continue
        s = np.linspace(first, last, max(3, int((last - first) / LOOK_M) + 1))
        share = np.concatenate([[0.0], np.cumsum(np.diff(s) / _step(road, (s[1:] + s[:-1]) / 2))])
        count = max(1, int(np.ceil(share[-1] - 1e-9)))
        parts.append(np.interp(np.linspace(0, share[-1], count + 1)[1:], share, s))
    return np.concatenate(parts)


def stations(road: Road, first_m: float = 0.0, last_m: float | None = None) -> Floats:
    """Return the stations of a road between two places, both included.

    Straight chords between them deviate by less than `PLAN_M` in plan and `HEIGHT_M` in height.

    Parameters
    ----------
    road : any road.
    first_m : the first station, m along the reference line.
    last_m : the last one, m; None: the end of the road.
    """
    last = road.length_m if last_m is None else last_m
    s = _cached(road)
    inside = s[(s > first_m + 1e-3) & (s < last - 1e-3)]
    return np.concatenate([[first_m], inside, [last]])


def _breaks(road: Road) -> set[float]:
    """Return the places at which line, heights, lanes or structures change abruptly."""
    length = road.length_m
    found = {0.0, length, *(r.start_m for r in road.line.records)}
    found |= {section.start_m for section in road.sections}
    for structure in road.structures:
        found |= {structure.start_m, structure.end_m}
    profiles = [road.elevation, road.superelevation, *road.crossfall, road.lane_offset]
    found |= {piece.start_m for profile in profiles for piece in profile.pieces}
    if road.shape is not None:
        found |= {row.s_m for row in road.shape.rows}
    for section in road.sections:
        for lane in section.lanes:
            found |= {section.start_m + piece.start_m for piece in lane.width.pieces}
    return {s for s in found if 0 <= s <= length}


def _step(road: Road, s: Floats) -> Floats:
    """Return the distance between stations that the bends at `s` allow."""
    h = 0.5
    near = np.clip(s[:, None] + np.array([-h, 0, h]), 0, road.length_m)
    edges = road.edges(near)
    bend = np.abs(road.line.at(s).curvature_per_m)
    bend = bend + np.max([np.abs(np.diff(t, 2, axis=1))[:, 0] for t in edges], 0) / h**2
    rise = np.zeros(len(s))
    for t in (*edges, np.zeros_like(near)):
        z = road.height(near, t[:, 1:2])
        rise = np.maximum(rise, np.abs(np.diff(z, 2, axis=1))[:, 0] / h**2)
    step = np.minimum(
        np.sqrt(8 * PLAN_M / np.maximum(bend, 1e-9)), np.sqrt(8 * HEIGHT_M / np.maximum(rise, 1e-9))
    )
    return np.asarray(np.clip(step, LEAST_M, MOST_M))
