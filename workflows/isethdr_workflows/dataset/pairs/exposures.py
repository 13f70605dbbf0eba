"""One shot of every member of a pair, all with the exposure that is right for the full light.

If automatic exposure worked on each member separately, the exposures would differ, and the members
would differ by more than their terms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from isethdr_sensors.imaging_sensor import ImagingSensor
from isethdr_sensors.staggered import StaggeredSensor
from isethdr_sensors.timing.auto_exposure import settle

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.protocols import DeclaresNoise
from isethdr_core.runs.seeds import Generator

from .terms import FULL, Member


@dataclass(frozen=True)
class Shots:
    """The exposures of all members by one camera.

    Parameters
    ----------
    captures : noisy captures of the full light, with all figures that convert DN to electrons.
    electrons : {term: (capture, y, x) float32}, mean electrons of its light, without dark charge.
    raw : {member: (capture, y, x) DN} without noise.
    saturated : {member: (capture, y, x) bool} without noise.
    noisy : {member: (shot, capture, y, x) DN}; empty without noisy shots.
    """

    captures: Any
    electrons: dict[str, np.ndarray]
    raw: dict[str, np.ndarray]
    saturated: dict[str, np.ndarray]
    noisy: dict[str, np.ndarray]


def exposed(
    sensor: Any, members: Sequence[Member], light: Mapping[str, Any], keys: Sequence[Generator]
) -> Shots:
    """Return the exposures of all members.

    Parameters
    ----------
    sensor : sensor of the camera.
    members : members of the pair, in the order of their terms.
    light : {member: irradiance or photocurrent on the sensor plane}.
    keys : keys of the noise, one for each shot and at least one; all members share them.

    Notes
    -----
    The first key is that of a run of this scene, so the DN of the first shot equal those of the
    run.
    """
    fixed = at_one_exposure(sensor, light[FULL])
    silent = replace(fixed, noise=False) if isinstance(fixed, ImagingSensor) else fixed
    captures = fixed(light[FULL], keys[0])
    dark_e = captures["dark_e"].values[:, None, None] if "dark_e" in captures else 0.0
    electrons = {}
    before = dark_e
    for member in members:
        mean_e = np.asarray(fixed.expected(light[member.name]).values, float)
        electrons[member.term] = (mean_e - before).astype(np.float32)
        before = mean_e
    without_noise = {m.name: silent(light[m.name], keys[0]) for m in members}
    noisy = {}
    if len(keys) > 1 or varies(fixed):
        for member in members:
            shots = [fixed(light[member.name], key)["raw"].values for key in keys]
            noisy[member.name] = np.stack(shots)
    return Shots(
        captures=captures,
        electrons=electrons,
        raw={name: shot["raw"].values for name, shot in without_noise.items()},
        saturated={name: shot["saturated"].values for name, shot in without_noise.items()},
        noisy=noisy,
    )


def varies(sensor: Any) -> bool:
    """Return whether a sensor has noise."""
    return not isinstance(sensor, DeclaresNoise) or bool(sensor.noise)


def at_one_exposure(sensor: Any, light: Any) -> Any:
    """Return the sensor, fixed at the exposure and the gain that automatic exposure finds for the
    light.

    Parameters
    ----------
    sensor : sensor of the camera.
    light : irradiance or photocurrent on the sensor plane.

    Raises
    ------
    ConfigError : the sensor meters each of its exposures separately.
    """
    if not isinstance(sensor, ImagingSensor) or sensor.exposure_rule == "fixed":
        return sensor
    if isinstance(sensor, StaggeredSensor) and sensor.exposure_each:
        raise ConfigError(
            "sensor.exposure_each is true; expected one exposure for all members of a pair; type"
            " sensor.exposure_each=false"
        )
    found = settle(sensor, light)
    gained = sensor.with_gain(found.gain) if found.gain > 1 else sensor
    return replace(gained, exposure_rule="fixed", exposure_s=found.exposure_s)
