"""Contest: shots of one camera at one illuminance, their scores, and the colour matrix alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from isethdr_isp.develop import solve_matrix
from isethdr_isp.merge import charges
from isethdr_isp.scene_light import illuminant
from isethdr_isp.spectra import Illuminant

from isethdr_core import generator
from isethdr_core.data.derived_once import once
from isethdr_core.display.display_view import display, white_cd_m2
from isethdr_core.physics.photometry import luminance
from isethdr_core.plugins.registry import build
from isethdr_core.truth import make_picture, truth

from ..picture.camera import TrainingCamera
from ..picture.roads import Lit

LEVEL_PERCENTILE = 95.0  # percentile at which illuminance is clipped before the mean is taken
BYTE = 255.0
STEP_PX = 8  # a window of rows begins at a multiple of this; filter arrays repeat after 2, 4 or 8


class Shot(NamedTuple):
    """Captures of a road, its reference picture, and the light on the sensor plane."""

    captures: Any
    reference: Any
    light: Any

    def middle(self) -> Shot:
        """Return the middle half of the rows, which show most objects of a road."""
        rows = self.captures.sizes["y"]
        first = rows // 4 // STEP_PX * STEP_PX
        kept = slice(first, first + rows // 2)
        return self._replace(
            captures=self.captures.isel(y=kept), reference=self.reference.isel(y=kept)
        )


@dataclass(frozen=True, eq=False)
class Contest:
    """Shots of one camera at one illuminance, on which developments are compared.

    Parameters
    ----------
    camera : camera of the shots.
    lux : mean illuminance of the sensor plane, in which the brightest twentieth is clipped.
    """

    camera: TrainingCamera
    lux: float

    def shot(self, view: Lit, seed: int) -> Shot:
        """Return a shot of a road at the illuminance.

        Parameters
        ----------
        view : road under one light.
        seed : seed of the noise.
        """
        factor = np.float32(self.lux / illuminance(view.light))
        light = view.light.copy(data=view.light.values * factor)
        mixed = view.mixed.copy(data=view.mixed.values * factor)
        captures = self.camera.sensor(light, generator(seed, scene="learned picture"))
        return Shot(captures, truth(mixed, build("isp", "merge")(captures)), light)


def illuminance(light: Any) -> float:
    """Return the mean illuminance, lux, of a sensor plane, with its brightest parts clipped."""
    lux = luminance(light.values.astype(float), light.wavelength.values)
    return float(np.minimum(lux, np.percentile(lux, LEVEL_PERCENTILE)).mean())


def scores_of(picture: Any, reference: Any) -> dict[str, float]:
    """Return SSIM, PSNR of the displayed pictures in dB, and mean CIEDE2000.

    PSNR is 20 log10(255 / rms) over all pixels and channels of the same displayed pictures for
    which SSIM is computed. Within `derived_once.shared(reference)`, what follows from the reference
    alone is computed once.

    Parameters
    ----------
    picture : picture of the camera.
    reference : reference picture on the same grid.
    """
    white = once("white", (reference,), lambda: white_cd_m2(reference))
    ours = display(picture, white).astype(float)
    meant = once("displayed", (reference,), lambda: display(reference, white).astype(float))
    rms = float(np.sqrt(np.mean((ours - meant) ** 2)))
    return {
        "ssim": build("metric", "ssim")(picture, reference)[0].value,
        "psnr_db": 20 * np.log10(BYTE / rms) if rms > 0 else float("inf"),
        "ciede2000": build("metric", "ciede2000")(picture, reference)[0].value,
    }


def matrix_alone(shot: Shot, balance: str) -> Any:
    """Return the picture that the colour matrix makes of electrons without noise, with every filter
    at every pixel. It is the best that any processing before the matrix can achieve.

    Parameters
    ----------
    shot : captures of a road, and its light on the sensor plane.
    balance : white balance, as in the isp.
    """
    captures = shot.captures
    light = shot.light
    by: Illuminant = illuminant(captures, balance)
    groups, _ = charges(captures, by)
    response = groups[-1][0].response
    wavelength_nm = captures.wavelength.values
    matrix = solve_matrix(response, wavelength_nm, by, np.inf)
    radiance = light.values / light.attrs["throughput_sr"]
    planes = np.tensordot(matrix @ response, radiance, axes=1)
    first = [(have - want) // 2 for have, want in zip(planes.shape[1:], captures.filter.shape)]
    rows, columns = (
        slice(start, start + size) for start, size in zip(first, captures.filter.shape)
    )
    xyz = np.moveaxis(planes[:, rows, columns], 0, -1)
    attrs = {k: captures.attrs[k] for k in ("pitch_um", "focal_length_mm")}
    valid = np.ones(xyz.shape[:2], bool)
    variance = np.full(xyz.shape, np.nan)  # not known
    x = captures.x.values
    y = captures.y.values
    return make_picture(xyz, variance, valid, x, y, variance_known=False, **attrs)
