"""Distribution of the light of twilight over the sky: a blue dome and a glow above the sun.

The model is designed by hand. `illuminance` gives its levels. Shapes and ratios are assumptions
within the range of observed twilights (Rozenberg 1966, Twilight, chapter 2). The horizon above the
sun is some 6 times as bright as the zenith at sunset, 25 times at -6 degrees and 60 times at -12
degrees. The glow becomes narrower about the sun's azimuth.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .night_light import path_length

# rows: altitude of the sun, degrees; luminance of the glow at the horizon relative to the zenith;
# elevation and azimuth from the sun at which the glow has fallen to a half, degrees
GLOW = np.array(
    [
        [-18.0, 10.0, 3.0, 30.0],
        [-12.0, 60.0, 3.5, 35.0],
        [-6.0, 25.0, 5.0, 50.0],
        [0.0, 6.0, 10.0, 70.0],
    ]
)
BLUE_RISE = 0.3  # power of the path length with which the blue dome brightens to the horizon


def twilight_patterns(
    sun_deg: float, elevation_deg: npt.ArrayLike, from_sun_deg: npt.ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Return the luminances of the blue dome and of the glow, relative to the zenith.

    Parameters
    ----------
    sun_deg : altitude of the sun, 0 to -18 degrees; values beyond are limited to this range.
    elevation_deg : elevation of the direction, degrees.
    from_sun_deg : azimuth of the direction from that of the sun, -180 to 180 degrees.
    """
    level, height, width = (np.interp(sun_deg, GLOW[:, 0], GLOW[:, k]) for k in (1, 2, 3))
    up = np.maximum(np.asarray(elevation_deg, float), 0.0)
    aside = np.asarray(from_sun_deg, float)
    blue = path_length(up) ** BLUE_RISE * np.ones(np.shape(aside))
    glow = level * 2 ** (-up / height) * 2 ** (-((aside / width) ** 2))
    return blue, glow
