"""Guard rails, barriers of medians, noise barriers, marker posts, and boards of road works."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..roads.road import Road
from .buildings import Panels, panels
from .site import Foot, Site

if TYPE_CHECKING:
    from ..roads.road import Mark


RAIL_BESIDE_M = 0.7  # distance of guard rails from the road's edge
NOISE_BESIDE_M = 3.2  # distance of noise barriers from the road's edge
POST_BESIDE_M = 0.5  # distance of marker posts from the road's edge
CURVE_PER_M = 1 / 220  # least curvature of a curve with closer posts and perhaps a guard rail
POST_STEP_M = 50.0
CURVE_POST_STEP_M = 25.0


def place_barriers(site: Site) -> int:
    """Place boards of road works, barriers and marker posts; return the number of things placed.

    Towns get only the boards.
    """
    rng = site.rng("barriers")
    feet: list[Foot] = []
    posts: list[Foot] = []
    noise = rng.random() < 0.35
    for road in site.open_roads:
        works = [m for m in road.objects if m.kind == "barrier"]
        feet += [_board(site, road, mark, k, rng) for k, mark in enumerate(works)]
        if site.base.urban:
            continue
        ends = (2.0, road.length_m - 2.0)
        if road.type == "motorway":
            feet += _median(site, road, rng)
            for side in (1, -1):
                if not road.on_structure("bridge", np.arange(0, road.length_m, 5.0)).any():
                    rail = Panels("guard_rail", side, RAIL_BESIDE_M, ends)
                    feet += panels(site, road, rail, rng)
                if noise and side < 0:
                    wall = Panels("noise_barrier", side, NOISE_BESIDE_M, ends)
                    feet += panels(site, road, wall, rng)
        else:
            feet += _curves(site, road, rng)
        posts += _posts(site, road, rng)
    placed = site.put_all(feet, 0.0)
    return placed + site.put_all(posts, 0.05)


def _board(site: Site, road: Road, mark: Mark, number: int, rng: np.random.Generator) -> Foot:
    """Return a board of road works where the road has a beacon."""
    x, y = road.line.points(mark.s_m, mark.t_m)
    heading = float(road.line.at(mark.s_m).heading_rad) + np.pi
    thing = site.stock.draw("furniture", rng, "warning_board")
    return Foot(
        f"board {road.name} {number}", thing, float(x), float(y), heading, "works", lean="surface"
    )


def _median(site: Site, road: Road, rng: np.random.Generator) -> list[Foot]:
    """Return a concrete barrier along the reference line, if a median lies on both sides of it."""
    numbers = {lane.number: lane.type for lane in road.sections[0].lanes}
    if numbers.get(1) != "median" or numbers.get(-1) != "median":
        return []
    thing = site.stock.draw("barrier", rng, "concrete_barrier")
    step = thing.size_m[1]
    feet = []
    for k, s in enumerate(np.arange(step, road.length_m - step, step)):
        if road.on_structure("bridge", s):
            continue
        x, y = road.line.points(s, float(road.lane_offset.at(s)))
        facing = float(road.line.at(s).heading_rad) + np.pi / 2
        feet.append(Foot(f"median {road.name} {k}", thing, float(x), float(y), facing, lean="line"))
    return feet


def _curves(site: Site, road: Road, rng: np.random.Generator) -> list[Foot]:
    """Return guard rails on the outer side of sharp curves."""
    s = np.arange(0.0, road.length_m, 4.0)
    curvature = road.line.at(s).curvature_per_m
    feet = []
    for side in (1, -1):
        outer = np.flatnonzero(-side * curvature > CURVE_PER_M)
        if len(outer) > 4 and rng.random() < 0.7:
            span = (float(s[outer[0]]), float(s[outer[-1]]))
            rail = Panels("guard_rail", side, RAIL_BESIDE_M, span)
            feet += panels(site, road, rail, rng)
    return feet


def _posts(site: Site, road: Road, rng: np.random.Generator) -> list[Foot]:
    thing = site.stock.draw("furniture", rng, "marker_post")
    s = float(rng.uniform(5, 30))
    feet = []
    while s < road.length_m:
        for side in (1, -1):
            place = site.beside(road, side, s, POST_BESIDE_M)
            feet.append(Foot(f"post {road.name} {side} {s:.0f}", thing, *place))
        bend = abs(float(road.line.at(s).curvature_per_m)) > CURVE_PER_M
        s += CURVE_POST_STEP_M if bend else POST_STEP_M
    return feet
