"""Closed ground of every kind of road: vertical rays hit one continuous surface, without steps."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
import shapely
from isethdr_scenes.roads import kinds
from isethdr_scenes.roads.surface import surface

PAINTED = ("line", "crosswalk", "stop_line", "parking_line", "arrow")
ALONG_M = 7.0  # distance between two rows of rays
ACROSS_M = 0.1  # distance between two rays of a row
BESIDE_M = 8.0  # distance beyond a road's edges that the rays cover: ditch and verge
KERB_M = 0.16  # largest step that counts as a kerb; the highest kerb of a kind is 0.15 m
SLOPE = 1.0  # largest slope of the land; an embankment has 1 / 1.7, the wall of a ditch more
SAME_M = 2e-3  # largest height of a deck's chords off the road: HEIGHT_M of two stations


class Rays(NamedTuple):
    """Vertical rays in rows across roads."""

    points: np.ndarray  # (n, 2)
    row: np.ndarray  # (n,) number of the row
    where: list[str]  # position of each row, as text
    deck_m: np.ndarray  # (n,) height of the bridge over the ray, or NaN


def rays(network) -> Rays:
    points = []
    row = []
    where = []
    deck = []
    for road in network.roads:
        # numbers that fit no station and no chord of the mesh
        for s in np.arange(0.37, road.length_m, ALONG_M):
            right, left = (float(t) for t in road.edges(s))
            t = np.arange(right - BESIDE_M + 0.013, left + BESIDE_M, ACROSS_M)
            at = np.full(len(t), s)
            points.append(road.line.points(at, t))
            row.append(np.full(len(t), len(where)))
            where.append(f"road {road.name}, s = {s:.2f} m")
            over = bool(road.on_structure("bridge", s)) & (t > right) & (t < left)
            deck.append(np.where(over, road.height(at, t), np.nan))
    return Rays(*(np.concatenate(x) for x in (points, row)), where, np.concatenate(deck))


def hits(parts, points):
    """Return the lowest and the highest hit of each ray; infinite where there is none."""
    low = np.full(len(points), np.inf)
    high = np.full(len(points), -np.inf)
    if not parts:
        return low, high
    corners = np.concatenate([p.vertices[p.faces] for p in parts])
    flat = shapely.polygons(np.concatenate([corners, corners[:, :1]], 1)[..., :2])
    keep = shapely.area(flat) > 1e-9  # upright faces are lines in plan
    corners = corners[keep]
    ray, triangle = shapely.STRtree(flat[keep]).query(shapely.points(points), "intersects")
    a, b, c = (corners[triangle, k] for k in range(3))
    u = b - a
    v = c - a
    w = points[ray] - a[:, :2]
    twice = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    share_b = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / twice
    share_c = (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]) / twice
    z = a[:, 2] + share_b * u[:, 2] + share_c * v[:, 2]
    np.minimum.at(low, ray, z)
    np.maximum.at(high, ray, z)
    return low, high


def faults(network, found) -> list[str]:
    """Return where rays fall through, and where the ground has a step."""
    parts = [p for a in (found.roads, found.land) for p in a.parts if p.name not in PAINTED]
    named = {
        name: [p for p in found.structures.parts if p.name == name] for name in ("roof", "deck")
    }
    across = rays(network)
    low, high = hits(parts, across.points)
    ground = np.isfinite(low)
    # next to the road of a tunnel there is only its roof; ground and roof meet only above its
    # portals
    roofed = np.isfinite(hits(named["roof"], across.points)[0])
    told = []

    def tell(which, what):
        for k in np.flatnonzero(which)[:3]:
            told.append(f"{across.where[across.row[k]]}: {what} at {across.points[k]}")

    tell(~ground & ~roofed, "a ray falls through")
    # a ray on the line of a kerb hits both of its edges
    tell(high - low > KERB_M, "two surfaces above each other")
    same = (across.row[1:] == across.row[:-1]) & ground[1:] & ground[:-1]
    step = np.where(same, np.maximum(high[1:] - low[:-1], high[:-1] - low[1:]), 0.0)
    tell(step > KERB_M + SLOPE * ACROSS_M, "a step higher than a kerb")
    _, deck = hits(named["deck"], across.points)
    tell(np.abs(deck - across.deck_m) > SAME_M, "the deck is not at the road's height")
    return told


@pytest.mark.slow
@pytest.mark.parametrize("name", kinds.names())
def test_no_ray_falls_through_the_ground_and_no_step_is_higher_than_a_kerb(name):
    for seed in (1, 2, 3):
        network = kinds.kind(name, seed).network
        assert not faults(network, surface(network)), seed


def test_the_rays_find_a_hole_and_a_step():
    network = kinds.kind("yard", 1).network
    found = surface(network)
    assert not faults(network, found)
    land = next(p for p in found.land.parts if p.name == "verge")
    rest = [p for p in found.land.parts if p is not land]
    holed = replace(land, faces=land.faces[50:])
    raised = replace(land, vertices=land.vertices + [0.0, 0.0, 0.4])
    for piece, words in ((holed, "falls through"), (raised, "a step higher than a kerb")):
        changed = found._replace(land=replace(found.land, parts=[*rest, piece]))
        assert any(words in fault for fault in faults(network, changed))


@pytest.mark.parametrize("name", ("bridge", "tunnel"))
def test_the_land_falls_from_an_abutment_and_rises_to_a_roof(name):
    network = kinds.kind(name, 1).network
    road = network.roads[-1]
    (span,) = road.structures
    middle = span.start_m + span.length_m / 2
    if name == "bridge":
        z = network.height(*road.line.points(span.start_m + np.linspace(0.1, 3.0, 9), 0.0).T)
        before = float(road.height(span.start_m, 0.0))
        assert z[0] == pytest.approx(before, abs=0.1)  # without a fill, metres lower
    else:
        left = float(road.edges(middle)[1])
        z = network.height(*road.line.points(middle, left + 1.2 + np.linspace(0.05, 3.0, 9)).T)
        assert z[0] == pytest.approx(float(road.elevation.at(middle)) + 7.5, abs=0.1)
    assert (np.diff(z) < 1e-9).all() and z[-1] < z[0] - 1.0  # after a level berm
    fall = -np.diff(z) / (2.9 if name == "bridge" else 2.95) * 8
    assert fall.max() < 1.0  # a slope, no wall
