"""Lamps in the world: from luminous intensity to radiance, by the beam pattern and the emitting
area.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import LM_PER_W, v_lambda
from isethdr_core.scene import Lamp, Spectrum

from .intensity_grid import IntensityGrid, intensity_grid

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import IntensityTable, Part, SceneDescription

# grid on which emission spectra are tabulated and weighed, nm
SPECTRUM_NM = np.arange(360.0, 831.0)


@dataclass(frozen=True, eq=False)
class PlacedLamp:
    """One emitting part at its place, in world coordinates."""

    instance: int  # label of the object it belongs to
    object: str
    lamp: Lamp
    triangles: np.ndarray  # (n, 3, 3) m, counter-clockwise seen from outside
    axis: np.ndarray  # (3,) unit vector
    peak_cd_m2: float  # luminance on the axis; of a lamp with a table the largest in any direction
    floor: float  # radiance of the Lambertian part, relative to the largest radiance of the beam
    cos_inner: float  # cosine of the half angle of the inner cone
    cos_outer: float  # cosine of the half angle of the outer cone
    grid: IntensityGrid | None = None  # for a lamp with a table: replaces the cone

    def relative(self, directions: np.ndarray) -> np.ndarray:
        """Return the luminance, relative to the peak, towards unit vectors (..., 3) that leave the
        lamp.
        """
        if self.grid is None:
            return self.pattern(directions @ self.axis)
        highest = self.peak_cd_m2 / (1 + self.floor)
        return (self.grid.at(directions) / highest + self.floor) / (1 + self.floor)

    @property
    def area_m2(self) -> float:
        """Area of all its triangles."""
        return float(np.linalg.norm(_area_vectors(self.triangles), axis=1).sum())

    def pattern(self, cos_axis: np.ndarray) -> np.ndarray:
        """Return the radiance of a round beam relative to that on its axis, at cosines of the angle
        from the axis.
        """
        return (beam(cos_axis, self.cos_inner, self.cos_outer) + self.floor) / (1 + self.floor)


def beam(cos_axis: np.ndarray, cos_inner: float, cos_outer: float) -> np.ndarray:
    """Return the relative radiance of a round beam: 1 within the inner cone, 0 outside the outer
    cone, a smoothstep of the cosine between them. It is 1 everywhere for a Lambertian lamp.

    Parameters
    ----------
    cos_axis : cosines of angles from the axis, any shape.
    cos_inner : cosine of the half angle of the inner cone.
    cos_outer : cosine of the half angle of the outer cone.
    """
    if cos_inner <= LAMBERTIAN_COS:
        return np.ones_like(np.asarray(cos_axis, float))
    t = np.clip((cos_axis - cos_outer) / max(cos_inner - cos_outer, 1e-6), 0, 1)
    return t * t * (3 - 2 * t)


# Largest cosine of an inner angle of 90 degrees, with rounding. Such a lamp has no beam: every face
# emits the same radiance in all directions.
LAMBERTIAN_COS = 1e-9


def placed_lamps(
    description: SceneDescription, normalise: str = "intensity", groups: Sequence[str] | None = None
) -> list[PlacedLamp]:
    """Return every lamp of `description` at its place.

    Parameters
    ----------
    description : scene.
    normalise : "intensity": the lamp has `intensity_cd` on its axis, and a narrower beam has less
        flux. "flux": the lamp has the flux of a Lambertian lamp of `intensity_cd`, and a narrower
        beam is brighter.
    groups : light groups that are rendered; None: all. Lamps of other groups are dark, and the flux
        of their beams is not integrated.
    """
    out = []
    for number, placed in enumerate(description.objects, 1):
        pose = np.asarray(placed.pose, float)
        for part in description.models[placed.model].parts:
            if part.lamp:
                dark = groups is not None and part.lamp.group not in groups
                out.append(_place(part, pose, number, placed.name, normalise, dark))
    return out


def world_triangles(part: Part, pose: np.ndarray) -> np.ndarray:
    """Return the (n, 3, 3) triangles of `part` under `pose`. They face outwards also under a pose
    that mirrors.
    """
    v = np.asarray(part.vertices, float) @ pose[:3, :3].T + pose[:3, 3]
    tri = v[np.asarray(part.faces, int)]
    return tri[:, ::-1] if np.linalg.det(pose[:3, :3]) < 0 else tri


def _place(
    part: Part, pose: np.ndarray, number: int, name: str, normalise: str, dark: bool
) -> PlacedLamp:
    """Return the lamp of a part at its place.

    Parameters
    ----------
    part : part of a model with a lamp.
    pose : (4, 4) pose of the object.
    number : label of the object.
    name : name of the object.
    normalise : as in `placed_lamps`.
    dark : whether the lamp's group is not rendered.

    Raises
    ------
    ConfigError : impossible intensity, axis or angles; no face towards the axis.
    """
    lamp = part.lamp
    tri = world_triangles(part, pose)
    where = f"lamp {part.name!r} ({lamp.kind}) of object {name!r}"
    if not (np.isfinite(lamp.intensity_cd) and lamp.intensity_cd >= 0):
        raise ConfigError(
            f"{where} has intensity_cd {lamp.intensity_cd}; expected a number of candela, 0 or more"
        )
    if not (0 <= lamp.lambertian_share < 1 and lamp.inner_deg <= lamp.outer_deg):
        raise ConfigError(
            f"{where} has inner_deg {lamp.inner_deg:g}, outer_deg {lamp.outer_deg:g},"
            f" lambertian_share {lamp.lambertian_share:g}; expected inner <= outer and a share"
            " within [0, 1)"
        )
    axis = pose[:3, :3] @ np.asarray(lamp.axis, float)
    length = np.linalg.norm(axis)
    if not (np.isfinite(length) and length > 0):
        raise ConfigError(
            f"{where} has the axis {tuple(lamp.axis)}; expected a direction in the axes of its"
            " model, for example (1.0, 0.0, 0.0)"
        )
    axis /= length
    vectors = _area_vectors(tri)
    projected = float(np.maximum(vectors @ axis, 0).sum())
    if projected <= 1e-6 * np.linalg.norm(vectors, axis=1).sum():
        raise ConfigError(
            f"{where} has no face towards its axis {np.round(axis, 3)}; expected faces"
            " counter-clockwise seen from outside; turn the axis, or reverse the order of each"
            " face's vertices"
        )
    cos_inner, cos_outer = np.cos(
        np.radians([min(lamp.inner_deg, 90.0), min(lamp.outer_deg, 90.0)])
    )
    if dark:
        return PlacedLamp(
            number, name, lamp, tri, axis, 0.0, 0.0, float(cos_inner), float(cos_outer)
        )
    if lamp.table is not None:
        return _with_table(part, pose, number, name, axis)
    area = np.linalg.norm(vectors, axis=1).sum()
    in_beam = _beam_flux(vectors, axis, cos_inner, cos_outer)  # flux at beam radiance 1
    # the Lambertian part has the flux pi x area x floor, which is its share of the whole flux
    floor = 0.0
    if cos_inner > LAMBERTIAN_COS:
        floor = lamp.lambertian_share / (1 - lamp.lambertian_share) * in_beam / (np.pi * area)
    peak = lamp.intensity_cd / projected
    if normalise == "flux":
        peak *= np.pi * area * (1 + floor) / (in_beam + floor * np.pi * area)
    return PlacedLamp(
        number, name, lamp, tri, axis, peak, floor, float(cos_inner), float(cos_outer)
    )


def _with_table(
    part: Part, pose: np.ndarray, number: int, name: str, axis: np.ndarray
) -> PlacedLamp:
    """Return a lamp with the luminous intensity of its table, whatever the shape of its faces.

    Its peak is the largest luminance. The flux of its beam follows from the table alone.

    Parameters
    ----------
    part : part of a model with a lamp that has a table.
    pose : (4, 4) pose of the object.
    number : label of the object.
    name : name of the object.
    axis : (3,) unit vector along the axis of the lamp.
    """
    lamp = part.lamp
    tri = world_triangles(part, pose)
    vectors = _area_vectors(tri)
    upright = pose[:3, :3] @ np.array([0.0, 0.0, 1.0])
    left = np.cross(upright, axis)
    if np.linalg.norm(left) < 1e-6 * np.linalg.norm(upright):
        raise ConfigError(
            f"lamp {part.name!r} ({lamp.kind}) of object {name!r} has a table and looks straight up"
            " or down, where left is not known; expected an axis nearer to level"
        )
    left /= np.linalg.norm(left)
    grid = intensity_grid(lamp.table, lamp.intensity_cd, axis, left, vectors)
    peak = float(grid.value.max())
    flux = lamp.intensity_cd * _table_flux(lamp.table)
    floor = 0.0
    if peak > 0:
        area = np.linalg.norm(vectors, axis=1).sum()
        floor = lamp.lambertian_share / (1 - lamp.lambertian_share) * flux / (np.pi * area * peak)
    return PlacedLamp(number, name, lamp, tri, axis, peak * (1 + floor), floor, 1.0, 0.0, grid)


@lru_cache(maxsize=64)  # lamps of one kind share their table
def _table_flux(table: IntensityTable) -> float:
    """Return the integral of a table over directions, sr, by the midpoint rule."""
    cells = 1000
    left, up = (
        np.linspace(v[0], v[-1], cells + 1)[:-1] + (v[-1] - v[0]) / cells / 2
        for v in (table.left_deg, table.up_deg)
    )
    each = np.radians(left[1] - left[0]) * np.radians(up[1] - up[0])
    value = table.at(left, up[:, None]) * np.cos(np.radians(up))[:, None]
    return float(value.sum() * each)


def _area_vectors(tri: np.ndarray) -> np.ndarray:
    """Return the normals (n, 3) of triangles (n, 3, 3), as long as their areas."""
    return np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0]) / 2


def _beam_flux(vectors: np.ndarray, axis: np.ndarray, cos_inner: float, cos_outer: float) -> float:
    """Return the flux, m2 sr, of faces with area `vectors`. Their radiance is the beam pattern
    about `axis`, with the peak 1.
    """
    if cos_inner <= LAMBERTIAN_COS:
        return np.pi * np.linalg.norm(vectors, axis=1).sum()
    if np.allclose(vectors / np.linalg.norm(vectors, axis=1, keepdims=True), axis, atol=1e-6):
        return np.linalg.norm(vectors, axis=1).sum() * flat_beam_solid_angle(cos_inner, cos_outer)
    # Gauss-Legendre quadrature over the cosine, midpoint rule over the azimuth
    node, weight = np.polynomial.legendre.leggauss(24)
    side = np.linalg.svd(axis[None])[2][1:]
    phi = (np.arange(64) + 0.5) * 2 * np.pi / 64
    total = 0.0
    # the pattern has a kink at the inner cone
    for low, high in (
        (cos_inner, 1.0),
        (cos_outer, cos_inner),
    ):
        c = low + (high - low) * (node + 1) / 2
        s = np.sqrt(1 - c**2)
        ring = np.cos(phi)[:, None] * side[0] + np.sin(phi)[:, None] * side[1]
        directions = c[:, None, None] * axis + s[:, None, None] * ring
        facing = np.zeros(directions.shape[:2])
        for chunk in np.array_split(vectors, max(1, len(vectors) // 256)):
            facing += np.maximum(directions @ chunk.T, 0).sum(-1)
        total += (
            (weight * (high - low) / 2 * beam(c, cos_inner, cos_outer)) @ facing.mean(1) * 2 * np.pi
        )
    return float(total)


def flat_beam_solid_angle(cos_inner: float, cos_outer: float) -> float:
    """Return the integral of beam x cosine over directions, sr, of a flat lamp that faces along its
    axis.

    The integral is 2 pi ((1 - ci^2) / 2 + d (co / 2 + 0.35 d)), where ci and co are the cosines and
    d = ci - co. The first term is the inner cone, the second the smoothstep.

    Parameters
    ----------
    cos_inner : cosine of the half angle of the inner cone.
    cos_outer : cosine of the half angle of the outer cone.
    """
    d = cos_inner - cos_outer
    return 2 * np.pi * ((1 - cos_inner**2) / 2 + d * (cos_outer / 2 + 0.35 * d))


def emission_table(spectra: list[Spectrum]) -> np.ndarray:
    """Return (spectrum, SPECTRUM_NM) radiance, W m-2 sr-1 nm-1, of each relative spectrum at 1
    cd/m2.
    """
    rows = []
    for s in spectra:
        value = s.at(SPECTRUM_NM)
        luminance = LM_PER_W * float(value @ v_lambda(SPECTRUM_NM))  # 1 nm steps
        if not luminance > 0 or value.min() < 0:
            raise ConfigError(
                f"a lamp spectrum gives {luminance:g} lm/W-weighted light, least value"
                f" {value.min():g}; expected non-negative values with some light between 380 and"
                " 780 nm"
            )
        rows.append(value / luminance)
    return np.array(rows).reshape(len(rows), len(SPECTRUM_NM))
