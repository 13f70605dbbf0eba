"""Sky and sun by day: Mitsuba's `sunsky`, sampled once and kept as tables.

The model is that of Hosek and Wilkie (2012, 2013), in absolute radiance, 320 to 720 nm. It is black
at and below the horizon. There this module uses its values at an elevation of half a degree. A sun
below half a degree gets the sky of a sun at half a degree. With a low sun the model is brighter
than measured illuminance; `dome` scales it.
"""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.data.sky import sky_direction, sky_elevations_deg
from isethdr_core.extras import needed

from .grid import COLUMNS, ROWS

if TYPE_CHECKING:
    from mitsuba import Emitter

# wavelengths of Mitsuba's tables; the model is linear between them
WAVELENGTH_NM = np.arange(320.0, 721.0, 40.0)
LOWEST_DEG = 0.5  # least elevation at which the model is used, of directions and of the sun
SUN_DIAMETER_DEG = 0.5358
ALBEDO = 0.2  # albedo of the ground all around


class Daylight(NamedTuple):
    """Radiance, W m-2 sr-1 nm-1, of the sky (row, column, wavelength), for a sun at azimuth 0, and
    of the sun's disc (wavelength,).
    """

    sky: np.ndarray
    sun: np.ndarray


@lru_cache(maxsize=8)
def daylight(sun_deg: float, turbidity: float) -> Daylight:
    """Return the clear sky and the sun. The call takes 0.1 s of CPU time.

    Parameters
    ----------
    sun_deg : altitude of the sun, degrees.
    turbidity : turbidity of the air, 1 to 10.
    """
    with needed("the sky of a day", extra="mitsuba"):
        import mitsuba as mi
    altitude = max(sun_deg, LOWEST_DEG)
    up = np.maximum(sky_elevations_deg(ROWS)[ROWS // 2 :], LOWEST_DEG)
    # the sky is alike on both sides of the sun
    around = np.arange(COLUMNS // 2 + 1) * (360 / COLUMNS)
    directions = sky_direction(up[:, None], around)
    chosen = mi.variant()
    mi.set_variant("scalar_spectral")
    try:
        half = _radiance(_emitter(mi, altitude, turbidity, sun=0.0, sky=1.0), mi, directions)
        sun = _radiance(
            _emitter(mi, altitude, turbidity, sun=1.0, sky=0.0),
            mi,
            sky_direction(altitude, 0.0)[None, None],
        )[0, 0]
    finally:
        if chosen:  # a renderer in this process has set this variant
            mi.set_variant(chosen)
    above = np.concatenate([half, half[:, -2:0:-1]], 1)
    full_sphere = np.concatenate([np.repeat(above[:1], ROWS // 2, 0), above])
    return Daylight(full_sphere, sun)


def _emitter(
    mi: ModuleType, altitude_deg: float, turbidity: float, sun: float, sky: float
) -> Emitter:
    return mi.load_dict(
        {
            "type": "sunsky",
            "sun_direction": sky_direction(altitude_deg, 0.0).tolist(),
            "turbidity": float(turbidity),
            "albedo": ALBEDO,
            "sun_scale": sun,
            "sky_scale": sky,
            "sun_aperture": SUN_DIAMETER_DEG,
        }
    )


def _radiance(emitter: Emitter, mi: ModuleType, directions: np.ndarray) -> np.ndarray:
    out = np.zeros((*directions.shape[:-1], len(WAVELENGTH_NM)))
    si = mi.SurfaceInteraction3f()
    for place in np.ndindex(directions.shape[:-1]):
        si.wi = mi.Vector3f(*(-directions[place]))
        for first in range(0, len(WAVELENGTH_NM), 4):
            # at exactly 720 nm Mitsuba would read beyond its table
            some = np.minimum(WAVELENGTH_NM[first : first + 4], WAVELENGTH_NM[-1] - 0.01)
            si.wavelengths = np.pad(some, (0, 4 - len(some)), mode="edge").tolist()
            out[place][first : first + 4] = np.array(emitter.eval(si))[: len(some)]
    return out
