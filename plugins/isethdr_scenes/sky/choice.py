"""The fields `sky` and `hour` of a road scene.

They are checked when the scene is composed and used when it is built.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from isethdr_core.errors import ConfigError
from isethdr_core.scene import SkyDome, Spectrum

from ..lamp_spectra import sky_of
from .dome import dome_of
from .state import PRESETS, sky_state

SkyName = Literal["uniform", "noon", "dusk", "night_rural", "night_moon", "night_city"]


def check_sky(sky: str, hour: Mapping[str, Any]) -> None:
    """Raise ConfigError if `hour` has a wrong entry, or the sky is the same at all hours."""
    if sky != "uniform":
        sky_state(sky, hour)
    elif hour:
        raise ConfigError(
            f"scene.hour has {next(iter(hour))}, while scene.sky is uniform, the same at all hours;"
            f" expected scene.sky to be one of {', '.join(PRESETS)}; type for example"
            " scene.sky=noon"
        )


def sky_of_scene(scene: Any) -> Spectrum | SkyDome:
    """Return the sky that the fields of a scene select."""
    if scene.sky == "uniform":
        return sky_of(scene.sky_luminance_cd_m2)
    return dome_of(sky_state(scene.sky, scene.hour))
