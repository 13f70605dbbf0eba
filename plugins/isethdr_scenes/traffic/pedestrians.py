"""Pedestrians: people in a walking pose move straight on, and wait if something is in the way."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..placing.boxes import Solid, corners, rows
from ..placing.site import MAY_STAND, Foot
from ..roads.network import Network
from ..things.people.gait import largest_size_m, walking_speed_m_s

ROLES = ("walking", "crossing")
STEPS_AT_ONCE = 20


@dataclass(eq=False)
class Pedestrian:
    """A person who walks."""

    foot: Foot
    solid: Solid  # solid that contains the person at all phases of the gait
    speed_m_s: float
    steps: int = 0  # number of time steps that the person has walked

    @property
    def name(self) -> str:
        """Name of the object."""
        return self.foot.name

    def after(self, seconds: float) -> tuple[float, float]:
        """Return the plan point, m, that the person reaches after some seconds of walking."""
        way = self.speed_m_s * seconds
        heading = self.foot.heading_rad
        return self.foot.x_m + way * np.cos(heading), self.foot.y_m + way * np.sin(heading)

    def boxes(self, x_m: float, y_m: float) -> np.ndarray:
        """Return the boxes (n, FIELDS) that the pedestrian occupies at a plan point."""
        at = (x_m, y_m, self.foot.heading_rad)
        return rows((self.solid,), at, self.foot.scale, self.foot.level)


def pedestrians(feet: Iterable[Foot]) -> list[Pedestrian]:
    """Return the pedestrians among all things: people with a walking role and a gait."""
    found = []
    for foot in feet:
        if foot.role not in ROLES or foot.thing.group != "person":
            continue
        speed = walking_speed_m_s(foot.thing)
        if speed > 0:
            size = largest_size_m(foot.thing)
            solid = Solid(0.0, 0.0, size[0], size[1], 0.0, size[2])
            found.append(Pedestrian(foot, solid, speed))
    return found


class Footways:
    """Look-up of whether a pedestrian may stand where a number of steps leads.

    Pedestrians walk straight on, so many steps are looked up at once.
    """

    def __init__(self, network: Network, people: list[Pedestrian], step_s: float) -> None:
        self._network = network
        self._people = people
        self._step_s = step_s
        self._allowed = np.empty((len(people), 0), bool)

    def may_stand(self, person: int, steps: int) -> bool:
        """Return whether a person (index) may stand at the place reached after `steps` steps."""
        while steps > self._allowed.shape[1]:
            self._look_ahead()
        return bool(self._allowed[person, steps - 1])

    def _look_ahead(self) -> None:
        """Look up the next steps of all pedestrians."""
        done = self._allowed.shape[1]
        boxes = []
        for person in self._people:
            for k in range(done + 1, done + STEPS_AT_ONCE + 1):
                boxes.append(person.boxes(*person.after(k * self._step_s)))
        points = corners(np.concatenate(boxes)).reshape(-1, 2)
        ranks = self._network.ground.lane_ranks(points)
        ranks = ranks.reshape(len(self._people), STEPS_AT_ONCE, -1)
        roles = [person.foot.role for person in self._people]
        allowed = [MAY_STAND[role][row].all(1) for role, row in zip(roles, ranks, strict=True)]
        self._allowed = np.concatenate([self._allowed, np.array(allowed, bool)], 1)
