"""Exposure limits: the shortest and longest exposure that motion and flickering lamps allow.

Motion: while the camera drives forward, the image of an object 5 m to the side and 20 m ahead may
move by two pixels at most. Flicker: an exposure over whole periods of a lamp measures its mean,
independent of phase and row.
"""

from __future__ import annotations

from math import ceil, floor, inf
from typing import TYPE_CHECKING, NamedTuple

from isethdr_core.errors import ConfigError

if TYPE_CHECKING:
    from ..imaging_sensor import ImagingSensor

ASIDE_M = 5.0  # distance of the object from the camera's axis
AHEAD_M = 20.0  # distance of the object ahead of the camera at the start of the exposure
PIXELS = 2.0  # largest displacement of its image, pixels
ROUNDING = 1e-9  # relative tolerance for whole periods, because products are rounded


class Limits(NamedTuple):
    """The shortest and the longest exposure, seconds, and the fields that set them."""

    shortest_s: float
    longest_s: float
    shortest_by: str
    longest_by: str


def motion_limit_s(speed_m_s: float, focal_length_m: float, pitch_m: float) -> float:
    """Return the exposure, s, in which the image of the object moves by `PIXELS`; inf without
    motion.

    A pinhole camera images a point at (X, Z) at f X / Z. After the distance d = v t, the image is
    at f X / (Z - d). It has moved by s when d = Z - 1 / (1 / Z + s / (f X)).

    Parameters
    ----------
    speed_m_s : speed of the camera along its axis, m/s.
    focal_length_m : focal length, m.
    pitch_m : distance between pixel centres, m.
    """
    if not speed_m_s:
        return inf
    path_m = AHEAD_M - 1 / (1 / AHEAD_M + PIXELS * pitch_m / (focal_length_m * ASIDE_M))
    return path_m / speed_m_s


def exposure_limits(sensor: ImagingSensor, focal_length_m: float | None) -> Limits:
    """Return the limits of the automatic exposure of `sensor`.

    Parameters
    ----------
    sensor : the sensor.
    focal_length_m : focal length of the lens, m; None if it is not known yet, in which case motion
        sets no limit.

    Raises
    ------
    ConfigError : no exposure meets the limits.
    """
    shortest_s = sensor.exposure_min_s
    shortest_by = "exposure_min_s"
    longest_s = sensor.exposure_max_s
    longest_by = "exposure_max_s"
    if focal_length_m:
        motion_s = motion_limit_s(sensor.exposure_speed_m_s, focal_length_m, sensor.pitch_um * 1e-6)
        if motion_s < longest_s:
            longest_s = motion_s
            longest_by = "exposure_speed_m_s"
    if hertz := sensor.exposure_flicker_hz:
        whole_s = max(ceil(shortest_s * hertz * (1 - ROUNDING)), 1) / hertz
        if whole_s > shortest_s * (1 + ROUNDING):
            shortest_s = whole_s
            shortest_by = "exposure_flicker_hz"
    if shortest_s > longest_s * (1 + ROUNDING):
        raise ConfigError(
            f"sensor.{shortest_by} = {getattr(sensor, shortest_by):g} needs exposures of at"
            f" least {shortest_s:.4g} s, sensor.{longest_by} = {getattr(sensor, longest_by):g} for"
            f" at most {longest_s:.4g} s; expected limits that some exposure meets; type"
            f" sensor.{shortest_by}=<other number> or sensor.{longest_by}=<other number>"
        )
    return Limits(shortest_s, longest_s, shortest_by, longest_by)


def whole_periods_s(exposure_s: float, flicker_hz: float) -> float:
    """Return `exposure_s` rounded down to whole periods; unchanged for 0 Hz.

    `exposure_s` is at least one period long.
    """
    if not flicker_hz:
        return exposure_s
    return floor(exposure_s * flicker_hz * (1 + ROUNDING)) / flicker_hz
