"""State of the sky: sun, moon and site, from a preset, numbers, or a place and a time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.plugins.ranges import Range, converted

from .place_and_time import positions

Altitude = Annotated[float, Range(-90, 90)]
Azimuth = Annotated[float, Range(-360, 360)]
Phase = Annotated[float, Range(0, 180)]
Bortle = Annotated[int, Range(1, 9)]
Turbidity = Annotated[float, Range(1, 10)]
Latitude = Annotated[float, Range(-90, 90)]
Longitude = Annotated[float, Range(-180, 360)]


@dataclass(frozen=True)
class SkyState:
    """Sun, moon and site. Azimuths count from the x axis of the scene clockwise: 90 is to the right
    of a car that drives along it.
    """

    sun_elevation_deg: Altitude = -90.0  # altitude of its middle, without refraction
    sun_azimuth_deg: Azimuth = 0.0
    moon_elevation_deg: Altitude = -90.0
    moon_azimuth_deg: Azimuth = 0.0
    moon_phase_deg: Phase = 0.0  # 0 full, 90 half, 180 new
    bortle: Bortle = 3  # class of the site: 1 dark, 3 country, 9 middle of a city
    turbidity: Turbidity = 3.0  # turbidity of the air by day: 2 very clear, 3 clear, 6 hazy


@dataclass(frozen=True)
class PlaceAndTime:
    """A place on earth, a time, and the direction of the road."""

    latitude_deg: Latitude
    longitude_deg: Longitude  # east is positive
    time_utc: str  # such as 2026-06-21T11:15
    heading_deg: Azimuth = 0.0  # direction of the x axis of the scene, from north clockwise


PRESETS = {
    "noon": SkyState(sun_elevation_deg=60.0, sun_azimuth_deg=110.0),
    "dusk": SkyState(sun_elevation_deg=-4.5, sun_azimuth_deg=20.0),
    "night_rural": SkyState(),
    "night_moon": SkyState(moon_elevation_deg=40.0, moon_azimuth_deg=110.0),
    "night_city": SkyState(bortle=9),
}
STATE_KEYS = tuple(SkyState.__dataclass_fields__)
PLACE_KEYS = tuple(PlaceAndTime.__dataclass_fields__)
FROM_PLACE = tuple(k for k in STATE_KEYS if k.startswith(("sun_", "moon_")))


def sky_state(preset: str, hour: Mapping[str, Any]) -> SkyState:
    """Return the state of a sky: a preset, changed by the entries of `hour`.

    Raises
    ------
    ConfigError : `hour` has an unknown key, an impossible value, an incomplete place, or a place
        together with positions.
    """
    for key in hour:
        if key not in (*STATE_KEYS, *PLACE_KEYS):
            allowed_keys = (*STATE_KEYS, *PLACE_KEYS)
            raise ConfigError(f"scene.hour has no key {key!r}{did_you_mean(key, allowed_keys)}")
    own = {k: v for k, v in hour.items() if k in STATE_KEYS}
    place = {k: v for k, v in hour.items() if k in PLACE_KEYS}
    state = replace(PRESETS[preset], **converted("scene.hour", SkyState, own, "+scene.hour."))
    if not place:
        return state
    both = [k for k in own if k in FROM_PLACE]
    missing = [k for k in PLACE_KEYS[:3] if k not in place]
    if both or missing:
        problem = f"{both[0]} beside a place" if both else f"no {missing[0]}"
        raise ConfigError(
            f"scene.hour has {problem}; expected either positions of sun and moon, or latitude_deg,"
            " longitude_deg, time_utc and heading_deg; type for example"
            " '+scene.hour={latitude_deg: 48.1, longitude_deg: 11.6, time_utc: 2026-06-21T11:15}'"
        )
    place_and_time = PlaceAndTime(
        **converted("scene.hour", PlaceAndTime, {**place, "time_utc": str(place["time_utc"])}, "+")
    )
    sun_and_moon = positions(
        place_and_time.latitude_deg, place_and_time.longitude_deg, place_and_time.time_utc
    )
    turned = {
        k: v - place_and_time.heading_deg * k.endswith("azimuth_deg")
        for k, v in sun_and_moon.items()
    }
    turned = {
        k: math.remainder(v, 360) if k.endswith("azimuth_deg") else v for k, v in turned.items()
    }
    return replace(state, **turned)
