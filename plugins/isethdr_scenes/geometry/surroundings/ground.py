"""The ground: the course of the road and the height of the land next to it.

A place is (s, y): s is the distance along the centre line, m, and y the distance to its left, m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.piece import pose

LANE_M = 3.5
SHOULDER_M = 0.9
EDGE_M = LANE_M + SHOULDER_M
CROWN = 0.025  # fall of the carriageway from its middle to its edges, m per m
# cross section of road, shoulder, ditch, field and hills: |y| and height above the middle of the
# road, m
PROFILE = (
    (0, 0),
    (EDGE_M, -CROWN * EDGE_M),
    (EDGE_M + 0.6, -0.17),
    (7.2, -0.62),
    (8.6, -0.68),
    (11, -0.15),
    (60, 0.5),
    (400, 7.0),
)
# waves of the land: mean spatial frequency in radians per m, and amplitude in m
WAVES = (
    (0.05, 0.25),
    (0.16, 0.10),
    (0.5, 0.035),
    (1.7, 0.012),
)


@dataclass(frozen=True)
class Ground:
    """A road of constant curvature that starts at the origin along +x, in uneven land."""

    curvature_per_m: float = 0.0016
    seed: int = 0
    # first and last s of a paved stretch on the right, for a parked vehicle; None: no such stretch
    lay_by_m: tuple[float, float] | None = None

    def points(
        self, s: float | np.ndarray, y: float | np.ndarray = 0.0, z: float | np.ndarray = 0.0
    ) -> np.ndarray:
        """Return world points (..., 3), m. The three parameters are broadcast.

        Parameters
        ----------
        s : distance along the road, m.
        y : distance to the left of the centre line, m.
        z : height over the datum, m.
        """
        s, y, z = np.broadcast_arrays(np.asarray(s, float), y, z)
        k = self.curvature_per_m if abs(self.curvature_per_m) > 1e-9 else 1e-9
        r = 1 / k - y
        return np.stack([r * np.sin(k * s), 1 / k - r * np.cos(k * s), z], -1)

    def height(self, s: float, y: float) -> np.ndarray:
        """Return the height of the ground over the datum, m, at the place (s, y), m."""
        s = np.asarray(s, float)
        y = np.asarray(y, float)
        z = np.interp(np.abs(y), *np.transpose(PROFILE)) + self._waves(s, y)
        if self.lay_by_m is None:
            return z
        ramp = np.clip((s - self.lay_by_m[0]) / 5, 0, 1) * np.clip((self.lay_by_m[1] - s) / 5, 0, 1)
        paved = ramp * (y < -EDGE_M + 0.1) * np.clip((9.5 + y) / 1.5, 0, 1)
        return z + paved * (-0.13 - z)

    def on(self, s: float, y: float, above: float = 0.0) -> np.ndarray:
        """Return world points (..., 3), m, on the ground.

        Parameters
        ----------
        s : distance along the road, m.
        y : distance to the left of the centre line, m.
        above : height over the ground, m.
        """
        return self.points(s, y, self.height(s, y) + above)

    def place(
        self, s: float, y: float, turn_deg: float = 0.0, z: float | None = None
    ) -> np.ndarray:
        """Return the (4, 4) pose of a model that stands at (s, y), turned from the road's
        direction.

        Parameters
        ----------
        s : distance along the road, m.
        y : distance to the left of the centre line, m.
        turn_deg : turn to the left from the road's direction, degrees.
        z : height over the datum, m; None: on the ground.
        """
        z = float(self.height(s, y)) if z is None else z
        return pose(*self.points(s, y, z), yaw=np.degrees(self.curvature_per_m * s) + turn_deg)

    def _waves(self, s: np.ndarray, y: np.ndarray) -> float | np.ndarray:
        rng = np.random.default_rng(self.seed)
        out = 0.0
        for f, amplitude in WAVES:
            a, b = rng.uniform(0.6, 1.4, 2)
            p, q = rng.uniform(0, 2 * np.pi, 2)
            out = out + amplitude * np.sin(f * a * s + p) * np.sin(f * b * y + q + 0.3 * s * f)
        return out * np.clip((np.abs(y) - 5.2) / 3, 0, 1)  # the road itself is even
