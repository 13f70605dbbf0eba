"""Overpasses: bridges that a file does not state, where one road runs high over another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..network import Network
from ..profile import Floats
from ..road import Flags, Road, Structure

OVER_M = 3.0  # a road that runs higher than this above another one is on a bridge
STEP_M = 2.0  # spacing of the places that are checked
EMBANKMENT = 1.7  # horizontal run of an embankment per metre of height
BESIDE_M = 1.5  # distance from the lower road's edge to the embankment's foot


def with_overpasses(network: Network) -> tuple[Network, tuple[str, ...]]:
    """Return the network with bridges where roads cross at two heights, and their roads' names.

    No bridge is added where the file states one for the upper road or a tunnel for the lower one.
    """
    boxes = [_box(road) for road in network.roads]
    roads = []
    changed = []
    for k, road in enumerate(network.roads):
        s = np.linspace(0.0, road.length_m, max(2, int(road.length_m / STEP_M) + 1))
        reach = np.zeros(len(s))  # distance by which the bridge extends to both sides
        for j, other in enumerate(network.roads):
            if j != k and _meet(boxes[k], boxes[j]):
                reach = np.maximum(reach, _reach(road, other, s))
        spans = _spans(s, reach, road)
        if spans:
            changed.append(road.name)
            road = replace(road, structures=(*road.structures, *spans))
        roads.append(road)
    return replace(network, roads=tuple(roads)), tuple(changed)


def _box(road: Road) -> Floats:
    s = np.linspace(0.0, road.length_m, max(2, int(road.length_m / STEP_M) + 1))
    corners = np.concatenate([road.line.points(s, t) for t in road.edges(s)])
    return np.stack([corners.min(0) - STEP_M, corners.max(0) + STEP_M])


def _meet(one: Floats, two: Floats) -> bool:
    return bool((one[0] <= two[1]).all() and (two[0] <= one[1]).all())


def _reach(road: Road, other: Road, s: Floats) -> Floats:
    """Return the distance by which a bridge over another road extends to both sides of each s.

    It is 0 where the road does not run above the other one.
    """
    right, left = road.edges(s)
    t = right + np.linspace(0.0, 1.0, 5)[:, None] * (left - right)
    points = road.line.points(np.broadcast_to(s, t.shape), t)
    seen = other.line.beside(points.reshape(-1, 2))
    low, high = other.edges(seen.s_m)
    inside = (seen.t_m > low) & (seen.t_m < high) & (seen.beyond_m < 1e-3)
    inside &= ~other.on_structure("tunnel", seen.s_m)
    above = road.height(np.broadcast_to(s, t.shape), t).ravel()
    above = above - other.height(seen.s_m, np.clip(seen.t_m, low, high))
    above = np.where(inside & (above > OVER_M), above, 0.0).reshape(t.shape).max(0)
    above[road.on_structure("bridge", s)] = 0.0
    return np.where(above > 0, EMBANKMENT * above + BESIDE_M, 0.0)


def _spans(s: Floats, reach: Floats, road: Road) -> list[Structure]:
    covered: Flags = np.zeros(len(s), bool)
    for at, far in zip(s[reach > 0], reach[reach > 0]):
        covered |= np.abs(s - at) <= far
    covered &= ~road.on_structure("bridge", s)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], covered.astype(int), [0]])))
    return [
        Structure("bridge", float(s[a]), float(s[b - 1] - s[a]))
        for a, b in zip(edges[::2], edges[1::2])
        if b - a > 2
    ]
