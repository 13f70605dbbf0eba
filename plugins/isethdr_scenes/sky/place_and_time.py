"""Positions of sun and moon at a place and a time.

The library ephem computes them (VSOP87 and ELP2000, as in XEphem).
"""

from __future__ import annotations

import math
from datetime import UTC, datetime
from importlib import import_module

from isethdr_core.errors import ConfigError
from isethdr_core.extras import needed


def positions(latitude_deg: float, longitude_deg: float, time_utc: str) -> dict[str, float]:
    """Return the positions of sun and moon, degrees, by the names of the fields of `SkyState`.

    Altitudes are without refraction. Azimuths count from north clockwise. The phase angle of the
    full moon is 0.

    Parameters
    ----------
    latitude_deg : geographic latitude, degrees north.
    longitude_deg : geographic longitude, degrees east.
    time_utc : date and time in UTC, ISO 8601.

    Raises
    ------
    ConfigError : the time cannot be read, or ephem is not installed.
    """
    with needed("a sky of a place and a time", extra="sky"):
        ephem = import_module("ephem")
    try:
        when = datetime.fromisoformat(time_utc)
    except ValueError:
        raise ConfigError(
            f"scene.hour.time_utc is {time_utc!r}; expected a date and a time in UTC; type for"
            " example +scene.hour.time_utc=2026-06-21T11:15"
        ) from None
    if when.tzinfo is not None:
        when = when.astimezone(UTC).replace(tzinfo=None)
    observer = ephem.Observer()
    observer.lat = math.radians(latitude_deg)
    observer.lon = math.radians(longitude_deg)
    observer.pressure = 0.0  # hPa: no refraction
    observer.date = when
    sun = ephem.Sun(observer)
    moon = ephem.Moon(observer)
    # The elongation of the moon from the sun is negative in the morning. The phase angle is about
    # 180 degrees less the elongation, because the sun is far away.
    phase = 180 - abs(math.degrees(moon.elong))
    return {
        "sun_elevation_deg": math.degrees(sun.alt),
        "sun_azimuth_deg": math.degrees(sun.az),
        "moon_elevation_deg": math.degrees(moon.alt),
        "moon_azimuth_deg": math.degrees(moon.az),
        "moon_phase_deg": phase,
    }
