"""Street lamps at even spacing, and traffic lights at stop lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..roads.road import Road
from ..things.furniture.street_lamps import POLE_RADIUS_M
from ..things.furniture.traffic_lights import STATES
from .site import Foot, Site

PAVEMENT_M = 2.4  # least width of a pavement that has its lamps at the kerb
KERB_M = 0.4  # distance from the kerb to a pole at the kerb
BEHIND_M = 0.4  # distance from the outer edge of a pavement to a pole behind it
BOTH_SIDES_M = 15.0  # least width of a road with lamps on both sides
LAMPS = {
    "residential": ("post_top", 22.0),
    "cycle_street": ("post_top", 22.0),
    "car_park": ("post_top", 20.0),
    "yard": ("high_mast", 45.0),
}
USUAL = ("mast_arm", 31.0)
STREET_KIND = {
    "mast_arm": "street_road",
    "post_top": "street_post_top",
    "high_mast": "street_high_mast",
}
SIGNAL_BESIDE_M = 0.9  # distance from the outer border of the lanes to the post of a signal


class Signals(NamedTuple):
    """States of the signals at time 0, by the name of the road with the traffic they control."""

    state: dict[str, str]
    seed: int = 0  # seed of the times at which the signals change

    @property
    def red(self) -> frozenset[str]:
        """Return the names of the roads with a red signal."""
        return frozenset(road for road, state in self.state.items() if state.startswith("red"))


def place_street_lamps(site: Site) -> int:
    """Place the lamps of a lit road; return the number of lamps placed."""
    if not site.base.lit:
        return 0
    rng = site.rng("street lamps")
    family, spacing = LAMPS.get(site.base.name, USUAL)
    lamp = site.stock.draw("street lamp", rng, family)
    feet = []
    for road in site.open_roads:
        first = float(rng.uniform(2, 0.5 * spacing))
        right, left = road.edges(road.length_m / 2)
        sides = (-1, 1) if left - right > BOTH_SIDES_M else (int(rng.choice([-1, 1])),)
        for side in sides:
            shift = spacing / 2 if len(sides) == 2 and side > 0 else 0.0
            at = np.arange(first + shift, road.length_m - 1, spacing)
            at = at[~road.on_structure("tunnel", at) & ~road.on_structure("bridge", at)]
            for k, s in enumerate(at):
                beyond = _pole_beyond(road, side, float(s))
                reach = lamp.size_m[0] / 2 - POLE_RADIUS_M if family == "mast_arm" else 0.0
                place = site.beside(road, side, float(s), beyond - reach)
                facing = float(road.line.at(s).heading_rad) - side * np.pi / 2
                feet.append(
                    Foot(
                        f"street lamp {road.name} {side} {k}",
                        lamp,
                        place.x_m,
                        place.y_m,
                        facing,
                        lamps=(STREET_KIND[family],),
                    )
                )
    return site.put_all(feet, 0.0)


def _pole_beyond(road: Road, side: int, s_m: float) -> float:
    """Return the distance of a pole outside the road's edge, m (negative: on the pavement)."""
    section = road.section_at(s_m)
    lanes = road.sections[section].left if side > 0 else road.sections[section].right
    if not lanes or lanes[-1].type != "sidewalk":
        return BEHIND_M + 0.4
    inner, outer = road.borders(section, s_m)[lanes[-1].number]
    width = abs(float(outer) - float(inner))
    return KERB_M - width if width >= PAVEMENT_M else BEHIND_M


def signals(site: Site) -> Signals:
    """Return the states of the signals. Opposite roads have the same state."""
    rng = site.rng("signals")
    if site.base.name != "city_crossing":
        return Signals({})
    main, other = ("green", "red") if rng.random() < 0.5 else ("red", "green")
    if rng.random() < 0.15:
        main = "amber"
        other = "red"
    own = site.base.lane.road
    across = float(own.line.at(0.0).heading_rad)
    states = {}
    for road in site.open_roads:
        turn = abs(np.sin(float(road.line.at(0.0).heading_rad) - across))
        states[road.name] = main if turn < 0.7 else other
    return Signals(states, int(site.rng("signal plan").integers(2**32)))


def place_signals(site: Site, told: Signals) -> int:
    """Place a traffic light at each stop line of a road with signals; return the number placed."""
    rng = site.rng("traffic lights")
    feet = []
    for road in site.open_roads:
        if road.name not in told.state:
            continue
        for mark in (m for m in road.objects if m.kind == "stop_line"):
            # the traffic that stops at the line drives towards the nearer end of the road
            against = mark.s_m < road.length_m / 2
            heading = float(road.line.at(mark.s_m).heading_rad) + (np.pi if against else 0.0)
            outer = mark.t_m + (1 if against else -1) * (mark.width_m / 2 + SIGNAL_BESIDE_M)
            x, y = road.line.points(mark.s_m, outer)
            feet.append(
                Foot(
                    f"signal {road.name}",
                    site.stock.draw("traffic light", rng, "signal_post"),
                    float(x),
                    float(y),
                    heading + np.pi,
                    lamps=STATES[told.state[road.name]],
                    stops=road.name,
                )
            )
    return site.put_all(feet, 0.0)
