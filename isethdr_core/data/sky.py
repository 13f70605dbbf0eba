"""Sky of a scene: radiance by direction, and the discs of sun and moon.

World axes are x forward, y left, z up. Azimuth counts from x clockwise as seen from above, as on a
compass whose north lies ahead: 90 degrees is to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from .scene_description import Spectrum


@dataclass(frozen=True, eq=False)
class SkyPart:
    """One spectrum, and its strength in each direction.

    Rows of `pattern` lie at the elevations `sky_elevations_deg(rows)`, columns at azimuths of
    multiples of 360 / columns degrees. Between them it is linear in azimuth and in the variable of
    the rows.
    """

    spectrum: Spectrum  # radiance in a direction where `pattern` is 1, W m-2 sr-1 nm-1
    pattern: np.ndarray  # (rows, columns), 0 or more


@dataclass(frozen=True)
class SkyDisc:
    """The sun or the moon: a disc of even radiance, infinitely far away."""

    name: str
    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    radiance: Spectrum  # W m-2 sr-1 nm-1

    def direction(self) -> np.ndarray:
        """Return the unit vector (3,) towards its middle."""
        return sky_direction(self.elevation_deg, self.azimuth_deg)

    def solid_angle_sr(self) -> float:
        """Return its solid angle, sr."""
        return float(2 * np.pi * (1 - np.cos(np.radians(self.diameter_deg / 2))))


@dataclass(frozen=True, eq=False)
class SkyDome:
    """A sky with a gradient: the sum of `parts`, whose patterns have one shape, and `discs`.

    `at` returns the spectrum of the equivalent uniform sky, for code without directions.
    """

    parts: tuple[SkyPart, ...]
    discs: tuple[SkyDisc, ...] = ()

    @property
    def wavelength_nm(self) -> tuple[float, ...]:
        """Wavelengths of the first part's spectrum, nm: its ends are those of the data."""
        return self.parts[0].spectrum.wavelength_nm

    def at(self, wavelength_nm: npt.ArrayLike) -> np.ndarray:
        """Return the radiance, W m-2 sr-1 nm-1, of the uniform sky that gives level ground the same
        irradiance as this sky with its discs.
        """
        return self.irradiance(wavelength_nm) / np.pi

    def irradiance(self, wavelength_nm: npt.ArrayLike) -> np.ndarray:
        """Return the irradiance on horizontal ground, W m-2 nm-1, of all parts and discs."""
        total = np.zeros(np.shape(wavelength_nm))
        for part in self.parts:
            total += part.spectrum.at(wavelength_nm) * cosine_integral(part.pattern)
        for disc in self.discs:
            level = disc.solid_angle_sr() * max(float(disc.direction()[2]), 0.0)
            total += disc.radiance.at(wavelength_nm) * level
        return total

    def radiance(self, directions: npt.ArrayLike, wavelength_nm: npt.ArrayLike) -> np.ndarray:
        """Return the radiance without the discs, (..., wavelength), W m-2 sr-1 nm-1, seen from the
        ground in the directions of unit vectors (..., 3).
        """
        return sum(
            (
                pattern_at(part.pattern, directions)[..., None] * part.spectrum.at(wavelength_nm)
                for part in self.parts
            ),
            np.zeros(1),
        )


def sky_direction(elevation_deg: npt.ArrayLike, azimuth_deg: npt.ArrayLike) -> np.ndarray:
    """Return unit vectors (..., 3) in world axes."""
    up, around = np.broadcast_arrays(
        np.radians(np.asarray(elevation_deg, float)), np.radians(np.asarray(azimuth_deg, float))
    )
    level = np.cos(up)
    return np.stack([level * np.cos(around), -level * np.sin(around), np.sin(up)], -1)


def sky_elevations_deg(rows: int) -> np.ndarray:
    """Return the elevations of the rows of a pattern, -90 to 90 degrees: 90 s |s| for evenly spaced
    s from -1 to 1, so that they are densest at the horizon.
    """
    s = np.linspace(-1, 1, rows)
    return 90 * s * np.abs(s)


def pattern_at(pattern: np.ndarray, directions: npt.ArrayLike) -> np.ndarray:
    """Return the pattern of a `SkyPart` towards unit vectors (..., 3)."""
    d = np.asarray(directions, float)
    rows, columns = pattern.shape
    up = np.degrees(np.arcsin(np.clip(d[..., 2], -1, 1))) / 90
    row = (np.sign(up) * np.sqrt(np.abs(up)) + 1) / 2 * (rows - 1)
    column = np.mod(np.arctan2(-d[..., 1], d[..., 0]) / (2 * np.pi), 1) * columns
    low = np.minimum(row.astype(int), rows - 2)
    left = column.astype(int) % columns
    right = (left + 1) % columns
    above = row - low
    aside = column - np.floor(column)
    lower = pattern[low, left] * (1 - aside) + pattern[low, right] * aside
    upper = pattern[low + 1, left] * (1 - aside) + pattern[low + 1, right] * aside
    return lower * (1 - above) + upper * above


def cosine_integral(pattern: np.ndarray, step_deg: float = 0.5) -> float:
    """Return the integral, sr, of a pattern times the sine of the elevation over the upper
    hemisphere, by the midpoint rule.
    """
    up = np.arange(step_deg / 2, 90, step_deg)
    rows = len(pattern)
    mean = pattern.mean(1)  # linear in azimuth: the mean over columns is that over the circle
    nodes = np.linspace(-1, 1, rows)
    level = np.interp(np.sqrt(up / 90), nodes, mean)
    weight = np.sin(np.radians(up)) * np.cos(np.radians(up)) * np.radians(step_deg)
    return float(2 * np.pi * (level @ weight))
