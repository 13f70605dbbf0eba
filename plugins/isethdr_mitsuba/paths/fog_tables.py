"""Fog on the device: extinction of each band, and the phase function."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.data.fog import Fog

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

DEEPEST = 30.0  # optical depth at which rays end; e^-30 of the light is left there


class FogTables:
    """A `Fog` on the device. Numbers are data and not literals, so that one kernel serves all
    visibilities.
    """

    def __init__(self, fog: Fog, wavelength_nm: ArrayLike, camera_z_m: float) -> None:
        """Make the tables of fog.

        Parameters
        ----------
        fog : extinction, albedo, phase function and height of the fog.
        wavelength_nm : (band,) centres, nm.
        camera_z_m : height of the camera in the world, m.
        """
        packets = ceil(len(wavelength_nm) / 4)
        bands_nm = np.pad(
            np.asarray(wavelength_nm, float), (0, 4 * packets - len(wavelength_nm)), mode="edge"
        )
        number = lambda v: dr.opaque(mi.Float, float(v))
        extinction = fog.extinction_at(bands_nm)
        self.extinction = [mi.Spectrum(*map(number, part)) for part in extinction.reshape(-1, 4)]
        # places along a ray are drawn by the extinction at the reference wavelength
        self.sampled = number(fog.extinction_per_m)
        self.albedo = number(fog.albedo)
        self.top_m = number(camera_z_m + fog.above_camera_m)
        self.bottom_m = number(camera_z_m - fog.above_camera_m)
        self.reach_m = number(DEEPEST / min(extinction.min(), fog.extinction_per_m))
        self.lobes = [(number(one.share), number(one.asymmetry)) for one in fog.lobes]

    def transmission(self, distance: Any) -> list[Any]:
        """Return the packets of the share of light that is left after `distance`, m."""
        return [dr.exp(-each * distance) for each in self.extinction]

    def along(self, distance: Any) -> Any:
        """Return the share of light left after `distance`, m, at the reference wavelength."""
        return dr.exp(-self.sampled * distance)

    def to_border(self, place: Any, way: Any) -> Any:
        """Return the distance, m, from a place along a unit vector to the upper or lower end of the
        fog, limited to `reach_m`; 0 if the place lies beyond that end.
        """
        end = dr.select(way.z > 0, self.top_m - place.z, place.z - self.bottom_m)
        return dr.minimum(dr.maximum(end, 0) / dr.maximum(dr.abs(way.z), 1e-6), self.reach_m)

    def relative_to_sampled(self, distance: Any) -> list[Any]:
        """Return the packets of extinction times transmission over `distance`, m, relative to the
        same product at the reference wavelength.
        """
        return [
            each / self.sampled * dr.exp((self.sampled - each) * distance)
            for each in self.extinction
        ]

    def against_sampled(self, distance: Any) -> list[Any]:
        """Return the packets of scattering coefficient times transmission over `distance`, m,
        relative to extinction times transmission at the reference wavelength.
        """
        return [self.albedo * each for each in self.relative_to_sampled(distance)]

    def phase(self, cosine: Any) -> Any:
        """Return the phase function, 1/sr, at the cosine of the scattering angle."""
        total = mi.Float(0)
        for share, g in self.lobes:
            # 1 + g^2 - 2 g cosine, rewritten: that form loses digits near forward in float32
            root = dr.square(1 - g) + 2 * g * dr.maximum(1 - cosine, 0)
            total += share * (1 - g * g) / (4 * dr.pi * root * dr.sqrt(root))
        return total

    def scattered(self, direction: Any, rng: Any) -> Any:
        """Return a direction drawn by the phase function around the unit vector `direction`."""
        pick = rng.next_float32()
        g = self.lobes[-1][1]
        below = mi.Float(0)
        ends = []
        for share, _ in self.lobes[:-1]:
            below = below + share  # not in place, because `ends` keeps each sum
            ends.append(below)
        for end, (_, each) in zip(reversed(ends), reversed(self.lobes[:-1])):
            g = dr.select(pick < end, each, g)
        u = rng.next_float32()
        # inverse of the cumulative distribution of a Henyey-Greenstein lobe; for g near 0, the
        # direction is uniform
        ratio = (1 - g * g) / (1 - g + 2 * g * u)
        bent = (1 + g * g - ratio * ratio) / dr.select(dr.abs(g) > 1e-3, 2 * g, 1)
        cosine = dr.clip(dr.select(dr.abs(g) > 1e-3, bent, 2 * u - 1), -1, 1)
        sine = dr.sqrt(dr.maximum(1 - cosine * cosine, 0))
        turn = 2 * dr.pi * rng.next_float32()
        return mi.Frame3f(direction).to_world(
            mi.Vector3f(sine * dr.cos(turn), sine * dr.sin(turn), cosine)
        )
