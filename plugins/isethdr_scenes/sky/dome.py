"""The sky of a state of sun, moon and site, as a table of radiance by direction.

The sky by day is Mitsuba's (`daylight`), unchanged for a sun above 20 degrees. Between 20 and 5
degrees it is scaled gradually to the measured values of `illuminance`, which are used below 5
degrees. Between 0.5 and -5 degrees its shape changes gradually into that of twilight. Light of the
moon, of airglow and stars, and of towns is added at all hours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from isethdr_core.data.sky import (
    SkyDisc,
    SkyDome,
    SkyPart,
    cosine_integral,
    sky_direction,
    sky_elevations_deg,
)
from isethdr_core.scene import Spectrum

from . import air
from .daylight import LOWEST_DEG, SUN_DIAMETER_DEG, WAVELENGTH_NM, daylight
from .grid import COLUMNS, ROWS
from .illuminance import NIGHT_DEG, moon_illuminance_lx, sun_illuminance_lx
from .night_light import artificial_cd_m2, moonlit_cd_m2, natural_cd_m2
from .spectra import NM, luminance_of, sky_spectrum
from .state import SkyState
from .twilight import twilight_patterns

MEASURED_BELOW_DEG = 5.0  # altitude of the sun below which the measured illuminance is used
MODEL_ABOVE_DEG = 20.0  # altitude of the sun above which Mitsuba's values are used unchanged
TWILIGHT_DEG = -5.0  # altitude of the sun below which `twilight` alone gives the shape of the sky
MOON_DIAMETER_DEG = 0.518
MOST_MOONLIT = 0.5  # largest share of the moon's light from the air, unless it is at the horizon
GROUND = 0.2  # reflectance of the land below the horizon, beyond the scene's own ground
HAZE_DEG = 3.0  # angle below the horizon over which the sky fades into the land
# Wavelengths of the hat functions that model the ratio of spectra to the mean spectrum. The error
# is below 1 % for half of the radiances (2 % in deep twilight), below 7 % (13 %) for 99 % of them,
# and below 2 % for luminance.
NODES_NM = np.array([400.0, 470.0, 590.0, 690.0])


class _Light(NamedTuple):
    """Radiance (row, column, NM), W m-2 sr-1 nm-1, of the sky that a light causes, and its disc.

    Row 0 is at the horizon.
    """

    sky: np.ndarray
    disc: SkyDisc | None


def dome_of(state: SkyState) -> SkyDome:
    """Return the sky of `state`. Its spectra end at 720 nm if it has daylight, else at 830 nm."""
    sun = sun_and_sky(state)
    moon = _moonlight(state)
    up = _elevations()
    night = natural_cd_m2(up)[:, None] * np.ones(COLUMNS)
    city = artificial_cd_m2(up, state.bortle)[:, None] * np.ones(COLUMNS)
    above = sun.sky + moon.sky
    above = (
        above + night[..., None] * sky_spectrum("natural") + city[..., None] * sky_spectrum("city")
    )
    discs = tuple(light.disc for light in (sun, moon) if light.disc is not None)
    last = WAVELENGTH_NM[-1] if state.sun_elevation_deg > TWILIGHT_DEG else NM[-1]
    nm = NM[last >= NM]
    above = above[..., last >= NM]
    down = _irradiance(above, nm, discs)
    parts = _parts(_with_ground(above, down), nm)
    fitted = SkyDome(parts, discs)
    # scale the patterns, so that the fit keeps the illuminance of level ground
    of_discs = luminance_of(_irradiance(np.zeros_like(above), nm, discs), nm)
    target_luminance = luminance_of(down, nm)
    model_luminance = luminance_of(fitted.irradiance(nm), nm)
    factor = (target_luminance - of_discs) / (model_luminance - of_discs)
    parts = tuple(replace(part, pattern=part.pattern * factor) for part in parts)
    shining = tuple(_before_sky(disc, fitted) for disc in discs)
    return SkyDome(parts, shining)


def _before_sky(disc: SkyDisc, dome: SkyDome) -> SkyDisc:
    """Return a disc to which the light of the air in front of it is added."""
    nm = np.asarray(dome.wavelength_nm)
    air_light = np.interp(NM, nm, dome.radiance(disc.direction(), nm), right=0.0)
    return replace(disc, radiance=_table(disc.radiance.at(NM) + air_light))


def horizontal_lx(state: SkyState) -> float:
    """Return the illuminance of level ground by the whole sky, lx."""
    return float(luminance_of(_extended(dome_of(state))))


def sun_and_sky(state: SkyState) -> _Light:
    """Return the sun's disc and the sky that it lights."""
    altitude = state.sun_elevation_deg
    if altitude <= NIGHT_DEG:
        return _Light(np.zeros((ROWS // 2 + 1, COLUMNS, len(NM))), None)
    seen_deg = air.apparent_altitude_deg(altitude)
    sky = np.zeros((ROWS // 2 + 1, COLUMNS, len(NM)))
    radiance = np.zeros(len(NM))
    if altitude > TWILIGHT_DEG:
        day = daylight(max(seen_deg, LOWEST_DEG), state.turbidity)
        # share of the disc above the horizon
        shown = float(np.clip(seen_deg / SUN_DIAMETER_DEG + 0.5, 0, 1))
        sky = _on_grid(day.sky[ROWS // 2 :])
        radiance = _on_grid(day.sun) * shown
    disc = SkyDisc(
        "sun", state.sun_azimuth_deg, max(seen_deg, 0.0), SUN_DIAMETER_DEG, _table(radiance)
    )
    direct = float(luminance_of(radiance)) * disc.solid_angle_sr() * float(disc.direction()[2])
    scale = 1.0
    if altitude < MODEL_ABOVE_DEG:
        measured = float(sun_illuminance_lx(altitude))
        if altitude > TWILIGHT_DEG:
            modelled = direct + _horizontal(luminance_of(sky))
            part = 1 - _smooth(altitude, MEASURED_BELOW_DEG, MODEL_ABOVE_DEG)
            scale = (measured / modelled) ** part
        sky = sky * scale
        if altitude < LOWEST_DEG:
            sky = _towards_twilight(altitude, sky, measured - scale * direct)
    sky = _turned(sky, state.sun_azimuth_deg)
    if not radiance.any():
        return _Light(sky, None)
    return _Light(sky, replace(disc, radiance=_table(radiance * scale)))


def _towards_twilight(altitude: float, day: np.ndarray, lux: float) -> np.ndarray:
    """Return the sky between day and night, scaled to an illuminance.

    Its shape is that of `day` for a sun at 0.5 degrees, and that of twilight at -5 degrees.

    Parameters
    ----------
    altitude : altitude of the sun, degrees.
    day : (row, column, NM) sky by day, of any scale.
    lux : illuminance of level ground by the sky, lx.
    """
    around = _from_sun()
    blue, glow = twilight_patterns(altitude, _elevations()[:, None], around)
    late = blue[..., None] * sky_spectrum("twilight") + glow[..., None] * sky_spectrum("glow")
    late = late / _horizontal(luminance_of(late))
    share = _smooth(altitude, TWILIGHT_DEG, LOWEST_DEG)
    mixed = (1 - share) * late
    if share > 0:
        mixed = mixed + share * day / _horizontal(luminance_of(day))
    return mixed * max(lux, 0.0)


def _moonlight(state: SkyState) -> _Light:
    sky = np.zeros((ROWS // 2 + 1, COLUMNS, len(NM)))
    total = float(moon_illuminance_lx(state.moon_elevation_deg, state.moon_phase_deg))
    if total == 0:
        return _Light(sky, None)
    seen_deg = air.apparent_altitude_deg(state.moon_elevation_deg)
    height = max(seen_deg, 0.0)
    towards = sky_direction(height, 0.0)
    directions = sky_direction(_elevations()[:, None], np.arange(COLUMNS) * (360 / COLUMNS))
    angle_deg = np.degrees(np.arccos(np.clip(directions @ towards, -1, 1)))
    level = moonlit_cd_m2(_elevations()[:, None], angle_deg, height, state.moon_phase_deg)
    shown = float(np.clip(seen_deg / MOON_DIAMETER_DEG + 0.5, 0, 1))
    # the rest of the light comes from the air; all of it where the moon is below the horizon
    rise = float(np.sin(np.radians(height)))
    direct = max(1 - _horizontal(level) / total, 1 - MOST_MOONLIT) * shown
    direct *= rise / max(rise, np.radians(MOON_DIAMETER_DEG / 2))
    level = level * ((1 - direct) * total / _horizontal(level))
    sky = _turned(level, state.moon_azimuth_deg)[..., None] * sky_spectrum("moonlit_air")
    if direct == 0:
        return _Light(sky, None)
    beam = sky_spectrum("moonlight") * air.transmission(NM, air.air_mass(height))
    disc = SkyDisc("moon", state.moon_azimuth_deg, height, MOON_DIAMETER_DEG, _table(beam))
    luminance = direct * total / disc.solid_angle_sr() / rise
    return _Light(sky, replace(disc, radiance=_table(beam / luminance_of(beam) * luminance)))


def _parts(cube: np.ndarray, nm: np.ndarray) -> tuple[SkyPart, SkyPart, SkyPart, SkyPart]:
    """Return the parts of a sky from its radiance (row, column, wavelength).

    The spectrum of a part is the mean spectrum times a hat function of wavelength. Its pattern is
    the fitted ratio of each direction to the mean. All values are 0 or more.
    """
    mean = cube[ROWS // 2 :].mean((0, 1))
    hats = np.stack([np.interp(nm, NODES_NM, row) for row in np.eye(len(NODES_NM))])
    lit = mean > 1e-12 * mean.max()
    ratio = np.divide(cube, mean, out=np.zeros_like(cube), where=lit)
    # weights from the mean spectrum, so that the fit serves both luminance and energy
    weight = np.sqrt(mean / mean.max())
    solution = np.linalg.lstsq(
        (hats * weight).T, (ratio * weight).reshape(-1, len(nm)).T, rcond=None
    )
    patterns = np.maximum(solution[0], 0).reshape(len(NODES_NM), ROWS, COLUMNS)
    return tuple(
        SkyPart(_spectrum(nm, mean * hat), pattern) for hat, pattern in zip(hats, patterns)
    )


def _with_ground(above: np.ndarray, down: np.ndarray) -> np.ndarray:
    """Return the radiance of the sphere. Below the horizon it is land in the light of the sky."""
    land = down * GROUND / np.pi
    depth = -sky_elevations_deg(ROWS)[: ROWS // 2]
    share = np.clip(1 - depth / HAZE_DEG, 0, 1)[:, None, None]
    below = share * above[:1] + (1 - share) * land
    return np.concatenate([below, above])


def _irradiance(above: np.ndarray, nm: np.ndarray, discs: Sequence[Any]) -> np.ndarray:
    full_sphere = np.concatenate([np.zeros((ROWS // 2, *above.shape[1:])), above])
    out = np.array([cosine_integral(full_sphere[..., k]) for k in range(len(nm))])
    for disc in discs:
        out = out + disc.radiance.at(nm) * disc.solid_angle_sr() * max(disc.direction()[2], 0)
    return out


def _horizontal(luminance: np.ndarray) -> float:
    """Return the illuminance of level ground, lx, by luminance (row, column), cd/m2, from the
    horizon upwards.
    """
    return cosine_integral(np.concatenate([np.zeros((ROWS // 2, COLUMNS)), luminance]))


def _extended(dome: SkyDome) -> np.ndarray:
    nm = np.asarray(dome.wavelength_nm)
    return np.interp(NM, nm, dome.irradiance(nm), right=0.0)


def _turned(values: np.ndarray, azimuth_deg: float) -> np.ndarray:
    """Return values (row, column, ...) of a light at azimuth 0, turned to `azimuth_deg`."""
    step = azimuth_deg / (360 / COLUMNS)
    columns = int(np.floor(step))
    fraction = step - columns
    shifted = np.roll(values, columns, axis=1)
    return (1 - fraction) * shifted + fraction * np.roll(shifted, 1, axis=1)


def _from_sun() -> np.ndarray:
    around = np.arange(COLUMNS) * (360 / COLUMNS)
    return np.where(around > 180, around - 360, around)


def _elevations() -> np.ndarray:
    return sky_elevations_deg(ROWS)[ROWS // 2 :]


def _on_grid(values: np.ndarray) -> np.ndarray:
    """Return spectra of `daylight` at the wavelengths NM; 0 beyond their last wavelength."""
    at = np.clip((NM - WAVELENGTH_NM[0]) / (WAVELENGTH_NM[1] - WAVELENGTH_NM[0]), 0, None)
    low = np.minimum(at.astype(int), len(WAVELENGTH_NM) - 2)
    out = values[..., low] * (1 - (at - low)) + values[..., low + 1] * (at - low)
    return np.where(NM <= WAVELENGTH_NM[-1], out, 0.0)


def _smooth(value: float, low: float, high: float) -> float:
    t = float(np.clip((value - low) / (high - low), 0, 1))
    return t * t * (3 - 2 * t)


def _table(values: np.ndarray) -> Spectrum:
    return _spectrum(NM, values)


def _spectrum(nm: np.ndarray, values: np.ndarray) -> Spectrum:
    return Spectrum(tuple(nm.tolist()), tuple(np.asarray(values, float).tolist()))
