"""A simulated camera on the bench of EMVA 1288: even narrow-band light with a known number of
photons, pairs and stacks of pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.radiometry import photon_energy_j
from isethdr_core.quantities import IRRADIANCE, centres, plane
from isethdr_core.seeds import generator

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.runs.seeds import Generator

BAND_NM = 10.0
# width of the border that is left out, pixels; there, crosstalk is computed with mirrored filters
BORDER = 2
DARK = 0.0  # photons per pixel of dark pictures
STACK = 100  # number of the first picture of a stack


@dataclass(frozen=True, eq=False)
class Bench:
    """One capture and one channel of a sensor under light of one wavelength."""

    sensor: object
    capture: int
    channel: int
    wavelength_nm: float
    size: int  # side of the picture, pixels of all channels
    seed: int

    def shot(self, photons: float, number: int) -> tuple[Any, Any, Any, Any]:
        """Return DN, row, column and saturation (bool) of the channel's pixels, each (pixel,), in
        one picture.

        Parameters
        ----------
        photons : mean photons per pixel, counted over the whole pixel area, during the longest
            exposure.
        number : number of the picture, which seeds its noise.
        """
        captures = self.sensor(self.light(photons), picture_key(self, photons, number))
        y, x = np.nonzero(
            captures["filter"].values[BORDER:-BORDER, BORDER:-BORDER] == self.channel
        ) + np.int64(BORDER)
        return (
            captures["raw"].values[self.capture][y, x].astype(float),
            y,
            x,
            captures["saturated"].values[self.capture][y, x],
        )

    def efficiency(self) -> float:
        """Return the electrons per photon of the channel, including fill factor and share of the
        exposure.
        """
        model = self.sensor.model()
        shot = self.sensor(self.light(0.0), generator(0, "bench", ""))
        diode = model.diode_of(model.readings[self.capture])
        curve = shot.quantum_efficiency.values[self.capture, self.channel]
        return (
            float(np.interp(self.wavelength_nm, shot.wavelength.values, curve))
            * diode.fill_factor
            * diode.exposure_share
        )

    def light(self, photons: float) -> xr.DataArray:
        """Return even irradiance with `photons` per pixel and exposure at the wavelength."""
        pitch = self.sensor.pitch_um * 1e-6
        level = (
            photons
            * photon_energy_j(self.wavelength_nm)
            / (pitch**2 * self.sensor.exposure_s * BAND_NM)
        )
        side = self.size * pitch
        values = level * np.array([0.0, 1.0, 0.0])[:, None, None] * np.ones((1, 2, 2))
        wavelengths = self.wavelength_nm + np.array([-BAND_NM, 0.0, BAND_NM])
        return plane(
            values,
            wavelengths,
            centres(2, side),
            centres(2, side),
            IRRADIANCE,
            f_number=8.0,
            focal_length_mm=16.0,
            throughput_sr=1.0,
            falloff="none",
            field_width=side,
            field_height=side,
        )


def picture_key(bench: Bench, photons: float, number: int) -> Generator:
    """Return the key of the noise of picture `number` at a level of light. The device, with its
    fixed patterns, is the same in all pictures.

    Parameters
    ----------
    bench : camera and light; its seed plus `number` seeds the noise.
    photons : mean photons per pixel and exposure.
    number : number of the picture in its series.
    """
    return generator(bench.seed + number, "bench", f"{photons:.6g}")


@dataclass(frozen=True, eq=False)
class Pair:
    """Statistics of two pictures at one level of light: mean, DN, temporal variance, DN^2, share of
    saturated pixels, and number of pixels.
    """

    photons: float
    mean_dn: float
    variance_dn2: float
    saturated: float
    pixels: int


def pair(bench: Bench, photons: float) -> Pair:
    """Return the mean of two pictures, and the temporal variance from their difference (EMVA 1288
    release 4.0, section 6.6).

    Parameters
    ----------
    bench : camera and light.
    photons : mean photons per pixel and exposure.
    """
    first, second = (bench.shot(photons, k) for k in (0, 1))
    difference = first[0] - second[0]
    return Pair(
        photons,
        float(np.mean((first[0] + second[0]) / 2)),
        float(np.var(difference, ddof=1) / 2),
        float(np.mean(first[3] | second[3])),
        len(difference),
    )


@dataclass(frozen=True, eq=False)
class Stack:
    """The mean of several pictures, and the temporal variance that remains in that mean."""

    mean_dn: np.ndarray  # (pixel,) mean of the pictures
    left_dn2: float  # temporal variance of `mean_dn`
    pixels: int
    pictures: int


def stack(bench: Bench, photons: float, pictures: int) -> Stack:
    """Return the average of several pictures (EMVA 1288 release 4.0, section 8.1).

    Parameters
    ----------
    bench : camera and light.
    photons : mean photons per pixel and exposure.
    pictures : number of pictures, at least 2.
    """
    total = 0.0
    squares = 0.0
    for k in range(pictures):
        values = bench.shot(photons, STACK + k)[0]
        total = total + values
        squares = squares + values**2
    mean = total / pictures
    temporal = float(np.mean(squares / pictures - mean**2)) * pictures / (pictures - 1)
    return Stack(mean, temporal / pictures, len(mean), pictures)
