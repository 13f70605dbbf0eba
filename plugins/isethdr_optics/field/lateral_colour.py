"""Lateral colour: an image with a size that depends on wavelength. Each band is moved on the sensor
plane so that its light is conserved.

The magnification at a wavelength, divided by that at the reference, is a number. Where chief rays
are traced, it is a `Course`, a function of the radius.
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

# largest share of a border tile that the smallest image may leave uncovered without making the
# field smaller
UNCOVERED = 1e-3
ROUNDING = 1e-9  # rounding error of a position, tiles
TRACED = 33  # number of field angles at which chief rays are traced
CLOSE = 1e-6  # change of a position at which the iteration ends, tiles
READ = 1025  # number of radii of a course; between them it is interpolated linearly


@dataclass(frozen=True, eq=False)
class Course:
    """Magnification as a function of the radius on the reference's sensor plane."""

    radius: np.ndarray  # (n,) rising from 0, focal lengths
    ratio: np.ndarray  # (n,) magnification over that of the reference
    pitch: tuple[float, float]  # (x, y) pitch of the tiles, focal lengths

    def at(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the magnification at positions `x` and `y`, tiles from the middle; both are
        broadcast.
        """
        return np.interp(np.hypot(x * self.pitch[0], y * self.pitch[1]), self.radius, self.ratio)


def magnifications(
    lens: LensOptics,
    wavelength_nm: np.ndarray,
    bent: BrownConrady | Identity | KannalaBrandt,
    widest_rad: float,
    projection: str,
    pitch: Sequence[float],
) -> list:
    """Return the magnification of every band over that of the reference: numbers, or courses if the
    lens traces its chief rays.

    Parameters
    ----------
    lens : lens of the field.
    wavelength_nm : (band,) band centres, nm.
    bent : distortion of the reference: map from the field to the sensor.
    widest_rad : largest angle of the field, radians.
    projection : "tangent" or "equidistant".
    pitch : (x, y) pitch of the sensor's tiles, focal lengths.
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
    # the magnification is an even function of the radius: the spline is one of its square
    return [Course(fine, CubicSpline(radius**2, r)(fine**2), tuple(pitch)) for r in ratios]


def scales(lens: LensOptics, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the magnification at every wavelength over that at the reference.

    It is 1 + percent / 100, interpolated linearly between the entries of the lens's table.

    Raises
    ------
    ConfigError : a wavelength lies beyond the table.
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
    """Return the sensor plane with the magnification of every band.

    The plane is enlarged to hold the largest image, so that no light is cut. The camera's field
    shrinks to the part that the images of all bands cover. Errors and omissions of this step are
    added to the plane's notes. If all magnifications are 1, the plane gets only a note.

    Parameters
    ----------
    lens : a lens of this package.
    mixed : mixed radiance (wavelength, y, x).
    plane : `SensorPlane` of the reference, of the same field.
    bent : distortion of the reference: map from the field to the sensor.
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
    """Return tile centres, extended at either end as an image larger by `scale` needs. A rounding
    error adds no tile.
    """
    more = int(np.ceil(len(centres) / 2 * (scale - 1) - ROUNDING))
    if more <= 0:
        return centres
    steps = pitch * np.arange(1, more + 1)
    return np.concatenate([centres[0] - steps[::-1], centres, centres[-1] + steps])


def moved(light: np.ndarray, magnification: float, shape: tuple[int, int]) -> np.ndarray:
    """Return the light of uniform tiles, moved by a band's magnification onto tiles of the same
    pitch.

    Parameters
    ----------
    light : (y, x) light of one band.
    magnification : a number, or a `Course` over the field.
    shape : (y, x) number of tiles of the result.
    """
    if isinstance(magnification, Course):
        return displaced(light, magnification, shape)
    return magnified(light, magnification, shape)


def displaced(light: np.ndarray, course: Course, shape: tuple[int, int]) -> np.ndarray:
    """Return the light of uniform tiles moved along the radius: first along x in every row, then
    along y.

    The light of a tile is spread evenly between the images of its borders. The sum is conserved
    except for light that leaves the frame. Uniform light is divided by the exact area ratio.

    Parameters
    ----------
    light : (y, x) light of one band.
    course : magnification over the field.
    shape : (y, x) number of tiles of the result.
    """
    height, width = np.shape(light)
    rows = (np.arange(height) - (height - 1) / 2)[:, None]
    x = np.arange(width + 1) - width / 2
    wide = _along(np.asarray(light, float), x * course.at(x, rows), shape[1])
    columns = np.arange(shape[1]) - (shape[1] - 1) / 2
    edge = (np.arange(height + 1) - height / 2)[:, None]
    source = columns / course.at(columns, edge)
    before = columns
    # the error shrinks at each step by the course's slope, a percent or less
    while np.abs(source - before).max() > CLOSE:
        source, before = columns / course.at(source, edge), source
    return _along(wide.T, (edge * course.at(source, edge)).T, shape[0]).T


def _along(light: np.ndarray, borders: np.ndarray, count: int) -> np.ndarray:
    """Return the light on (row, count) tiles about the middle.

    Parameters
    ----------
    light : (row, n) light of tiles.
    borders : (row, n + 1) borders of these tiles, in tiles from the middle.
    count : number of tiles of each row of the result.
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
        # tiles whose images may cover the tile with an index larger by `shift`
        use = slice(max(0, -shift), min(size, count - shift))
        at = np.arange(use.start, use.stop) + shift
        part = np.minimum(right_border[:, use], at + 1) - np.maximum(left_border[:, use], at)
        out[:, use.start + shift : use.stop + shift] += density[:, use] * np.maximum(part, 0.0)
    return out


def magnified(light: np.ndarray, scale: float, shape: tuple[int, int]) -> np.ndarray:
    """Return the light of uniform tiles magnified about the middle of the frame, on tiles of the
    same pitch.

    The light of a tile is spread evenly over its image, and shared among the tiles there by area.
    The sum is conserved except for light that leaves the frame.

    Parameters
    ----------
    light : (y, x) light of one band.
    scale : magnification.
    shape : (y, x) number of tiles of the result.
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
    """Return the index (tile,) of the first source tile of each of `count` tiles, and the shares
    (tap, tile) of the source tiles from there on; 0 beyond the `size` source tiles.
    """
    low = np.arange(count) - count / 2
    first = np.floor(low / scale + size / 2).astype(np.intp)
    number = first + np.arange(3)[:, None]
    left_border = np.maximum((number - size / 2) * scale, low)
    right = np.minimum((number + 1 - size / 2) * scale, low + 1)
    return first, np.where(
        (number >= 0) & (number < size), np.maximum(right - left_border, 0.0) / scale, 0.0
    )
