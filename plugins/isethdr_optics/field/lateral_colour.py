"""Lateral colour: an image whose size depends on wavelength, moved band by band on the sensor plane
so that light is kept.

The magnification of a wavelength over that of the reference is a number, or a `Course` along the
radius where chief rays are traced.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import quantities
from isethdr_core.data import camera_geometry
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import LeftOut
from isethdr_core.physics.optics import projection as projections
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.uncertainty.error_terms import Quantity

from ..abilities import TracesChiefRays
from ..psf.error_parts import term
from . import omissions

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.data.camera_geometry import Identity
    from isethdr_core.physics.optics.distortion import BrownConrady, KannalaBrandt

    from ..abilities import LensOptics
    from ..imaging.sensor_plane import SensorPlane

# of a border tile that the smallest image does not reach: less than that does not make the field
# smaller
UNCOVERED = 1e-3
ROUNDING = 1e-9  # of a tile
TRACED = 33  # field angles at which chief rays are traced
CLOSE = 1e-6  # tiles
READ = 1025  # radii of a course, between which it goes straight


@dataclass(frozen=True, eq=False)
class Course:
    """Magnification along the radius on the reference's sensor plane."""

    radius: np.ndarray  # rising from 0, focal lengths
    ratio: np.ndarray
    pitch: tuple[float, float]  # (x, y) of the tiles, focal lengths

    def at(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the magnification at places in tiles from the middle (broadcast)."""
        return np.interp(np.hypot(x * self.pitch[0], y * self.pitch[1]), self.radius, self.ratio)


def magnifications(
    lens: LensOptics,
    wavelength_nm: np.ndarray,
    bent: BrownConrady | Identity | KannalaBrandt,
    widest_rad: float,
    projection: str,
    pitch: Sequence[float],
) -> list:
    """Return the magnification of every band over that of the reference: numbers, or courses where
    a lens traces its chief rays.

    Parameters
    ----------
    lens : lens of the field.
    wavelength_nm : (band,) band centres, nm.
    bent : map of the reference from the field to the sensor.
    widest_rad : largest angle of the field, radians.
    projection : "tangent" or "equidistant".
    pitch : (x, y) of the sensor's tiles, focal lengths.
    """
    wave = np.asarray(wavelength_nm, float)
    if lens.lateral_colour_percent or not isinstance(lens, TracesChiefRays):
        return list(scales(lens, wave))
    angle = np.linspace(0.0, widest_rad, TRACED)
    ratios = [np.asarray(lens.magnification_at(np.tan(angle), w)) for w in wave]
    if all((r == 1).all() for r in ratios):
        return [1.0] * len(wave)
    from scipy.interpolate import CubicSpline

    radius = np.hypot(
        *bent.forward(np.tan(angle) if projection == "tangent" else angle, 0.0 * angle)
    )
    fine = np.linspace(0.0, radius[-1], READ)
    # of an even function of the radius
    return [Course(fine, CubicSpline(radius**2, r)(fine**2), tuple(pitch)) for r in ratios]


def scales(lens: LensOptics, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the magnification of every wavelength over that of the reference: 1 + percent / 100,
    lines between table entries.

    Raises
    ------
    ConfigError : a wavelength beyond the table.
    """
    table = {float(w): p for w, p in lens.lateral_colour_percent.items()}
    wavelengths_nm = sorted(table)
    wave = np.asarray(wavelength_nm, float)
    if wavelengths_nm and not wavelengths_nm[0] <= wave.min() <= wave.max() <= wavelengths_nm[-1]:
        raise ConfigError(
            f"lens.lateral_colour_percent is known from {wavelengths_nm[0]:g} to"
            f" {wavelengths_nm[-1]:g} nm; expected"
            f" {wave.min():g} to {wave.max():g} nm within it; add those wavelengths to the table"
        )
    return (
        1 + np.interp(wave, wavelengths_nm, [table[w] for w in wavelengths_nm]) / 100
        if wavelengths_nm
        else np.ones(len(wave))
    )


def coloured(
    lens: LensOptics,
    mixed: xr.DataArray,
    plane: SensorPlane,
    bent: BrownConrady | Identity | KannalaBrandt,
) -> SensorPlane:
    """Return the sensor plane with the magnification of every band, as many tiles larger as the
    largest image needs: no light is cut.

    The camera's field shrinks to what images of all bands cover. What this changes beside the
    light's place is added to the plane's notes. Nothing else changes where all magnifications
    are 1.

    Parameters
    ----------
    lens : a lens of this package.
    mixed : mixed radiance (wavelength, y, x).
    plane : `SensorPlane` of the reference, of the same field.
    bent : map of the reference from the field to the sensor.
    """
    wave = mixed.wavelength.values.astype(float)
    projection = camera_geometry.projection_of(mixed)
    pitch = [quantities.tile_pitch(mixed, d) for d in ("x", "y")]
    half = [np.abs(mixed[d].values).max() + p / 2 for d, p in zip(("x", "y"), pitch)]
    scales_of_bands = magnifications(
        lens, wave, bent, float(projections.angle_rad(*half, projection)), projection, pitch
    )
    low, high = (
        np.array([f(m.ratio) if isinstance(m, Course) else m for m in scales_of_bands])
        for f in (np.min, np.max)
    )
    if (low == 1).all() and (high == 1).all():
        return replace(plane, notes=(*plane.notes, omissions.NO_LATERAL_COLOUR))
    shape = len(plane.y), len(plane.x)
    y, x = (_wider(a, p, high.max()) for a, p in zip((plane.y, plane.x), pitch[::-1]))
    field = tuple(
        min(w, n * p * low.min()) if n / 2 * (1 - low.min()) > UNCOVERED else w
        for w, n, p in zip(plane.field, shape[::-1], pitch)
    )
    thinner = max(np.abs(s**-2.0 - 1).max() for s in (low, high))
    label = (
        "uniform light of a band, spread over a larger or smaller image, from what the"
        " attributes say"
    )
    magnified_light = term(
        thinner, "relative", "measured", label, key="magnified light", acts_on=Quantity.ATTRIBUTES
    )
    larger = max(np.abs(s - 1).max() for s in (low, high))
    lacking = [
        n / 2 * (1 - low.min())
        for n, w, p in zip(shape[::-1], field, pitch)
        if w > n * p * low.min() * (1 + CLOSE * UNCOVERED)
    ]
    radius = np.hypot(*(n / 2 for n in shape))
    within = (
        np.max([np.abs(np.gradient(s, wave)) for s in (low, high)], axis=0) * band_widths_nm(wave)
        if len(wave) > 1
        else np.zeros(1)
    )
    one_each = LeftOut(
        "change of magnification within a band",
        "each band has one",
        float(radius * within.max()),
        "tiles at the corner",
    )
    stretched = (1 + plane.stretched) * (1 + larger) - 1
    return replace(
        plane,
        x=x,
        y=y,
        field=field,
        scales=scales_of_bands,
        unmagnified_shape=shape,
        stretched=stretched,
        dark_corner_share=sum(lacking),
        notes=(*plane.notes, magnified_light, one_each),
    )


def _wider(centres: np.ndarray, pitch: float, scale: float) -> np.ndarray:
    """Return tile centres with as many more at either end as an image larger by `scale` needs, none
    for the last digits.
    """
    more = int(np.ceil(len(centres) / 2 * (scale - 1) - ROUNDING))
    if more <= 0:
        return centres
    steps = pitch * np.arange(1, more + 1)
    return np.concatenate([centres[0] - steps[::-1], centres, centres[-1] + steps])


def moved(light: np.ndarray, magnification: float, shape: tuple[int, int]) -> np.ndarray:
    """Return constant tiles (y, x) on (y, x) tiles of `shape` and the same pitch, where a band's
    magnification sends them.

    Parameters
    ----------
    light : (y, x) light of one band.
    magnification : a number, or a `Course` over the field.
    shape : (y, x) of the result, tiles.
    """
    if isinstance(magnification, Course):
        return displaced(light, magnification, shape)
    return magnified(light, magnification, shape)


def displaced(light: np.ndarray, course: Course, shape: tuple[int, int]) -> np.ndarray:
    """Return constant tiles moved along the radius: first along x in every row, then along y.

    The light of a tile is spread evenly between the images of its borders. The sum is conserved
    except for light that leaves the frame. Uniform light is divided by the exact area ratio.

    Parameters
    ----------
    light : (y, x) tiles. `course` : magnification over the field. `shape` : (y, x) of the result.
    """
    height, width = np.shape(light)
    rows = (np.arange(height) - (height - 1) / 2)[:, None]
    x = np.arange(width + 1) - width / 2
    wide = _along(np.asarray(light, float), x * course.at(x, rows), shape[1])
    columns = np.arange(shape[1]) - (shape[1] - 1) / 2
    edge = (np.arange(height + 1) - height / 2)[:, None]
    source = columns / course.at(columns, edge)
    before = columns
    # shrinks by the course's slope, a percent or less, from step to step
    while np.abs(source - before).max() > CLOSE:
        source, before = columns / course.at(source, edge), source
    return _along(wide.T, (edge * course.at(source, edge)).T, shape[0]).T


def _along(light: np.ndarray, borders: np.ndarray, count: int) -> np.ndarray:
    """Return (row, count) tiles about the middle from (row, n) tiles whose borders lie at `borders`
    (row, n + 1) from the middle.
    """
    size = light.shape[1]
    out = np.zeros((len(light), count))
    left_border = borders[:, :-1] + count / 2
    right_border = borders[:, 1:] + count / 2
    density = light / (right_border - left_border)
    first = np.floor(left_border.min(axis=0)).astype(int)
    last = np.ceil(right_border.max(axis=0)).astype(int)
    offset = first - np.arange(size)
    for shift in range(offset.min(), int((last - np.arange(size)).max())):
        # tiles that may reach the tile `shift` beyond their own number
        use = slice(max(0, -shift), min(size, count - shift))
        at = np.arange(use.start, use.stop) + shift
        part = np.minimum(right_border[:, use], at + 1) - np.maximum(left_border[:, use], at)
        out[:, use.start + shift : use.stop + shift] += density[:, use] * np.maximum(part, 0.0)
    return out


def magnified(light: np.ndarray, scale: float, shape: tuple[int, int]) -> np.ndarray:
    """Return constant tiles magnified about the middle of the frame, on tiles of the same pitch.

    The light of a tile is spread evenly over its image and divided by area. The sum is conserved
    except for light that leaves the frame.

    Parameters
    ----------
    light : (y, x) tiles. `scale` : magnification. `shape` : (y, x) of the result.
    """
    out = np.asarray(light, float)
    for axis, count in enumerate(shape):
        first, weights = _shares(out.shape[axis], count, scale)
        last = out.shape[axis] - 1
        wide = (slice(None), None) if axis == 0 else (None, slice(None))
        out = sum(
            out.take(np.clip(first + t, 0, last), axis) * w[wide] for t, w in enumerate(weights)
        )
    return out


def _shares(size: int, count: int, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the first tile that each of `count` tiles takes light from, and the shares (tap,
    tile), 0 beyond the last of `size`.
    """
    low = np.arange(count) - count / 2
    first = np.floor(low / scale + size / 2).astype(np.intp)
    number = first + np.arange(3)[:, None]
    left_border = np.maximum((number - size / 2) * scale, low)
    right = np.minimum((number + 1 - size / 2) * scale, low + 1)
    return first, np.where(
        (number >= 0) & (number < size), np.maximum(right - left_border, 0.0) / scale, 0.0
    )
