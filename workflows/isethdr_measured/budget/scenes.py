"""Three small scenes that were not used to derive any table of costs: a tunnel exit, a street with
one lamp, and paint patches at noon.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import quantities
from isethdr_core.physics.photometry import xyz_weights

if TYPE_CHECKING:
    import xarray as xr

BANDS_NM = np.arange(400.0, 701.0, 20.0)
# width of a tile on the sensor plane, um; most of the frame lies beyond the exact core of a kernel
TILE_UM = 10.0
MARGIN = 1.2  # width rendered / width of the camera's field
CAMERAS = {"tunnel": "split_pixel", "street": "rgbw", "noon": "bayer"}


def scene(name: str, width: int, focal_length_mm: float) -> xr.Dataset:
    """Return scene radiance of two light groups.

    Parameters
    ----------
    name : `tunnel`, `street` or `noon`.
    width : tiles along x in the camera's field; along y there are width * 9 / 16.
    focal_length_mm : focal length, which sets the angular width of a tile, mm.
    """
    field = [n * TILE_UM * 1e-3 / focal_length_mm for n in (width, width * 9 // 16)]
    nx, ny = (2 * round(n * MARGIN / 2) for n in (width, width * 9 // 16))
    pitch = field[0] / width
    # x goes from -1 to 1, and y has the same scale
    y, x = np.meshgrid(
        quantities.centres(ny, 2 * ny / nx), quantities.centres(nx, 2.0), indexing="ij"
    )
    radiance = {"tunnel": _tunnel, "street": _street, "noon": _noon}[name](
        x, y, np.random.default_rng(len(name) + 40)
    )
    return quantities.scene_radiance(
        radiance,
        ["ambient", "lamps"],
        BANDS_NM,
        quantities.centres(nx, nx * pitch),
        quantities.centres(ny, ny * pitch),
        tuple(field),
    )


def _light(luminance_cd_m2: float | np.ndarray, spectrum: np.ndarray) -> np.ndarray:
    """Return radiance (band, y, x) of a spectrum (band, 1, 1), scaled to luminance (y, x)."""
    weights = xyz_weights(BANDS_NM)[1]
    return luminance_cd_m2 * spectrum / (weights @ spectrum.ravel())


def _band(centre_nm: int, width_nm: int) -> np.ndarray:
    return np.exp(-0.5 * ((BANDS_NM - centre_nm) / width_nm) ** 2)[:, None, None]


def _paint(shape: tuple[int, int], rng: np.random.Generator, patch: int) -> np.ndarray:
    """Return reflectances (band, y, x) of patches, each of one paint, with a grain of 10 %."""
    rows, columns = (-(-n // patch) for n in shape)
    centre = (
        rng.uniform(420, 680, (rows, columns))
        .repeat(patch, 0)
        .repeat(patch, 1)[: shape[0], : shape[1]]
    )
    grey = (
        rng.uniform(0.05, 0.5, (rows, columns))
        .repeat(patch, 0)
        .repeat(patch, 1)[: shape[0], : shape[1]]
    )
    colour = np.exp(-0.5 * ((BANDS_NM[:, None, None] - centre) / 60) ** 2)
    return grey * (0.4 + colour) * rng.normal(1, 0.1, shape).clip(0.5, 1.5)


DAYLIGHT = 1.4 - BANDS_NM[:, None, None] / 1000 + 0 * BANDS_NM[:, None, None]
WHITE_LED = _band(450, 10) + 0.7 * _band(560, 55)
SODIUM = _band(589, 8) + 0.02


def _tunnel(x: np.ndarray, y: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return radiance (group, band, y, x) of a tunnel: walls at 3 cd/m2 that brighten towards the
    exit, an exit of 8000 cd/m2, and two tail lamps.
    """
    walls = _paint(x.shape, rng, 6)
    radius = np.hypot(x - 0.2, y + 0.05)
    ambient = _light(np.where(radius < 0.17, 8e3, 3 / (0.3 + radius)), DAYLIGHT) * np.where(
        radius < 0.17, 1.0, walls
    )
    lamps = _light(3.0 * (np.hypot(x, y) < 9), SODIUM) * walls
    for at in (-0.35, -0.2):
        lamps += _light(5e3 * (np.hypot(x - at, y - 0.25) < 0.02), _band(630, 12))
    return np.stack([ambient, lamps])


def _street(x: np.ndarray, y: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return radiance (group, band, y, x) of a street: a road at 0.02 to 2 cd/m2, lit by one lamp
    of 2e6 cd/m2 that is in the picture, and a window of 50 cd/m2.
    """
    road = _paint(x.shape, rng, 4)
    ambient = _light(np.where(y < -0.1, 2e-3, 0.02) * np.ones(x.shape), DAYLIGHT) * road
    ambient += _light(50.0 * ((abs(x - 0.6) < 0.06) & (abs(y + 0.2) < 0.05)), SODIUM)
    distance = np.hypot(x + 0.3, y - 0.1)
    lamps = _light(2.0 / (0.2 + 4 * distance**2) * (y > -0.1), WHITE_LED) * road
    lamps += _light(2e6 * (np.hypot(x + 0.3, y + 0.3) < 0.025), WHITE_LED)
    return np.stack([ambient, lamps])


def _noon(x: np.ndarray, y: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return radiance (group, band, y, x) of paint patches in daylight, where white has 4000 cd/m2,
    and of a glint of the sun at 3e6 cd/m2.
    """
    ambient = _light(4e3 * np.ones(x.shape), DAYLIGHT) * _paint(x.shape, rng, 5)
    return np.stack([ambient, _light(3e6 * (np.hypot(x - 0.5, y - 0.2) < 0.02), DAYLIGHT)])
