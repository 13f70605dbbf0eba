"""Lenses: thin, shift-invariant, with a round stop of diameter focal length / f-number.

`lens(mixed, flares)` gives irradiance, `lens.psf(...)` the point spread function, `lens.throughput(...)` irradiance per radiance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class IdealLens:
    """No blur: irradiance is a constant times radiance, with or without cos4 falloff."""

    f_number: float = 4.0  # focal length / diameter of the stop
    focal_length_mm: float = 4.0  # sensor position = focal length x tangent
    transmittance: float = 1.0  # of the glass, all wavelengths
    pupil: Literal["tangent", "aplanatic"] = "tangent"  # energy: pi / (1 + 4 N^2), or the sine condition's pi / (4 N^2)
    falloff: Literal["cos4", "none"] = "cos4"  # off the axis
    object_distance_m: float = float("inf")  # where the lens is focused: widens the working f-number

    def __post_init__(self):
        _check(self)

    def __call__(self, mixed, flares=()):
        """Return irradiance of mixed radiance; scatter and added light of `flares` are honoured."""
        from .imaging import image

        return image(self, mixed, _sequence(flares))

    @property
    def magnification(self) -> float:
        """Absolute magnification of an object at `object_distance_m`: f / (d - f)."""
        f_m = 1e-3 * self.focal_length_mm
        return f_m / (self.object_distance_m - f_m)

    def throughput_sr(self) -> float:
        """Return irradiance / radiance on the axis of a uniform scene with a clean round stop, sr."""
        from isethdr_core.physics.radiometry import irradiance_factor, irradiance_factor_aplanatic

        rule = irradiance_factor if self.pupil == "tangent" else irradiance_factor_aplanatic
        return self.transmittance * rule(self.f_number, self.magnification)

    def psf(self, wavelength_nm, pitch_um=1.0, size=256, flares=()):
        """Return the point spread function (wavelength, y, x): all light on the sample at index size // 2."""
        import numpy as np

        from .kernels import psf_array

        values = np.zeros((np.size(wavelength_nm), size, size))
        values[:, size // 2, size // 2] = 1.0
        return psf_array(values, wavelength_nm, pitch_um, self, _sequence(flares))


@dataclass(frozen=True)
class DiffractionLimitedLens(IdealLens):
    """Perfect but for diffraction at its round stop, or at what a flare makes of it."""

    aperture_loss: bool = True  # False: as ISETCam, light that flares block is not missing

    zernike_um = None  # not a field: this lens has no wavefront error

    def psf(self, wavelength_nm, pitch_um=1.0, size=256, flares=(), integrated=None):
        """Return the point spread function of the lens with `flares`.

        Parameters
        ----------
        wavelength_nm : one or more wavelengths, nm.
        pitch_um, size : size x size samples `pitch_um` apart, the axis at index size // 2.
        flares : list or dictionary of flares.
        integrated : False: intensity at each sample's centre times its area. True: integral over each sample's square. None: the
            first
            where the pitch is below wavelength x f-number for all wavelengths (then the samples sum to the energy), else the
            second.

        Returns
        -------
        DataArray (wavelength, y, x), y and x in metres: the fraction of the light through the pupil on each sample. What is
        missing from
        a sum of 1 falls outside.
        """
        from .kernels import point_spread

        return point_spread(self, wavelength_nm, pitch_um, size, _sequence(flares), integrated)


@dataclass(frozen=True)
class WavefrontLens(DiffractionLimitedLens):
    """Diffraction and a wavefront error in OSA/ANSI Zernike coefficients."""

    zernike_um: dict[int, float] = field(
        default_factory=dict
    )  # {OSA index: rms in micrometres}; 4 is defocus; over the whole stop


def _sequence(flares) -> tuple:
    return tuple(flares.values()) if hasattr(flares, "values") else tuple(flares)


def _check(lens):
    from isethdr_core.errors import ConfigError

    lowest = 0.5 if lens.pupil == "aplanatic" else 0.0
    if not lens.f_number > 0 or lens.f_number < lowest:
        raise ConfigError(
            f"lens.f_number is {lens.f_number!r}; expected above 0, at least 0.5 with pupil=aplanatic; set lens.f_number=4"
        )
    if not lens.focal_length_mm > 0:
        raise ConfigError(f"lens.focal_length_mm is {lens.focal_length_mm!r}; expected above 0; set lens.focal_length_mm=4")
    if not 0 < lens.transmittance <= 1:
        raise ConfigError(
            f"lens.transmittance is {lens.transmittance!r}; expected above 0 and at most 1; set lens.transmittance=1"
        )
    if not lens.object_distance_m > 2e-3 * lens.focal_length_mm:
        raise ConfigError(
            f"lens.object_distance_m is {lens.object_distance_m!r}; expected metres, more than twice the focal length; "
            "set lens.object_distance_m=.inf for a far object"
        )
