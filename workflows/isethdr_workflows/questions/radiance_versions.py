"""Versions of stored radiance: as it is, either of its half buffers, or denoised.

A renderer with half buffers stores half of the luminance difference of buffers A and B. Radiance
times (Y + difference) / Y is that of one buffer, and its noise is larger by the square root of two.
All bands of a tile are scaled by the same factor, because they share their paths.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.display.preview import denoised, tristimulus
from isethdr_core.errors import ConfigError, UnitError, did_you_mean
from isethdr_core.uncertainty.render_noise import HALF_DIFFERENCE

if TYPE_CHECKING:
    import xarray as xr

STORED = "stored"


def _half(scene: xr.Dataset, sign: float) -> np.ndarray:
    """Return the luminance (light_group, y, x) of one half buffer, cd/m2.

    Parameters
    ----------
    scene : scene radiance with half buffers.
    sign : 1 for buffer A, -1 for buffer B.
    """
    if HALF_DIFFERENCE not in scene or not np.isfinite(scene[HALF_DIFFERENCE].values).all():
        raise UnitError(
            f"the scene has no variable {HALF_DIFFERENCE!r}: it was rendered in a single pass;"
            " expected a rendering of two passes or more"
        )
    return np.maximum(
        tristimulus(scene)[:, 1] + sign * scene[HALF_DIFFERENCE].values.astype(float), 0.0
    )


# {version: function of a scene that returns luminance (light_group, y, x), cd/m2}
VERSIONS: dict[str, Callable[[Any], np.ndarray]] = {
    STORED: lambda scene: tristimulus(scene)[:, 1],
    "half_a": lambda scene: _half(scene, 1.0),
    "half_b": lambda scene: _half(scene, -1.0),
    "denoised": lambda scene: denoised(scene)[:, 1],
}


@dataclass(frozen=True)
class RadianceVersion:
    """A stored scene with radiance that is changed before it is used.

    Parameters
    ----------
    scene : component that returns stored scene radiance, its field, bands and groups.
    version : name of the version.
    """

    scene: Any
    version: str

    def __call__(self) -> xr.Dataset:
        """Return scene radiance of this version, with the labels of the stored scene."""
        return changed(self.scene(), self.version)

    def bands_nm(self) -> list[float]:
        """Return the centres of the stored bands, nm."""
        return list(self.scene.bands_nm())

    def light_groups(self) -> tuple[str, ...]:
        """Return the names of the stored light groups."""
        return tuple(self.scene.light_groups())

    def camera_field(self) -> tuple[float, float, str]:
        """Return (width, height, projection) of the camera's field."""
        width, height, projection = self.scene.camera_field()
        return float(width), float(height), str(projection)


def checked_version(version: str) -> str:
    """Return the name of a version; raise ConfigError if there is none of that name."""
    if version not in VERSIONS:
        raise ConfigError(
            f"there is no version of radiance {version!r}{did_you_mean(version, VERSIONS)}"
        )
    return version


def changed(scene: xr.Dataset, version: str) -> xr.Dataset:
    """Return scene radiance of a version.

    Raises
    ------
    UnitError : the scene does not state the noise or the half buffers that the version needs.
    """
    if version == STORED:
        return scene
    before = tristimulus(scene)[:, 1]
    after = VERSIONS[version](scene)
    factor = np.divide(after, before, out=np.ones_like(before), where=before > 0)
    values = scene["radiance"].values * factor[:, None].astype(np.float32)
    return scene.assign(radiance=scene["radiance"].copy(data=values))
