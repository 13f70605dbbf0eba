"""Coatings by name, and the reflectance of every surface of a prescription, by band and angle.

- `none`: bare glass.
- `mgf2`: a quarter wave of MgF2 at 550 nm.
- `multilayer`: a quarter wave of index 1.38, a half wave of 2.05 and a quarter wave of 1.70, at 520
  nm. It reflects less than 0.6 % from 420 to 680 nm, and 0.1 % in the middle. The design has the
  form of those by J. T. Cox, G. Hass and A. Thelen, J. Opt. Soc. Am. 52, 965 (1962), with other
  numbers.
- `broadband`: layers of index 1.38, 2.05, 1.38, 2.05 and 1.38, which are 94.9, 136.7, 41.0, 20.8
  and 43.7 nm thick. It reflects less than 0.55 % from 400 to 700 nm, up to 20 degrees, on glass of
  1.5 to 1.63. The thicknesses minimise the squared reflectance on glass of 1.52 and 1.62.
- `infrared_cut`: (half-L H half-L)^9 with H 2.35 and L 1.46, centred on 850 nm. It reflects 730 to
  1000 nm; the transmittance below has ripples.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.optics.glass import index
from isethdr_core.physics.optics.thin_film import quarter_wave_nm, reflect_unpolarised

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .prescription import Prescription

# number of cosines in the tables; linear interpolation has a measured error of 1e-5, except near
# the critical angle
COSINES = 513


def _mgf2(wavelength_nm: np.ndarray) -> list[tuple[np.ndarray, float]]:
    return [(index("MgF2", wavelength_nm), quarter_wave_nm(float(index("MgF2", 550.0)), 550.0))]


def _multilayer(wavelength_nm: np.ndarray) -> list[tuple[float, float]]:
    return [
        (1.38, quarter_wave_nm(1.38, 520.0)),
        (2.05, quarter_wave_nm(2.05, 520.0, 2.0)),
        (1.70, quarter_wave_nm(1.70, 520.0)),
    ]


def _broadband(wavelength_nm: np.ndarray) -> list[tuple[float, float]]:
    return [(1.38, 94.9), (2.05, 136.7), (1.38, 41.0), (2.05, 20.8), (1.38, 43.7)]


def _infrared_cut(wavelength_nm: np.ndarray) -> list[tuple[float, float]]:
    half = (1.46, quarter_wave_nm(1.46, 850.0, 0.5))
    high = (2.35, quarter_wave_nm(2.35, 850.0))
    return [half, high, half] * 9


COATINGS = {
    "none": lambda wavelength_nm: [],
    "mgf2": _mgf2,
    "multilayer": _multilayer,
    "broadband": _broadband,
    "infrared_cut": _infrared_cut,
}


def layers(coating: str, wavelength_nm: np.ndarray) -> list[Any]:
    """Return [(index, thickness_nm), ...] of the layers, from the air to the glass."""
    return COATINGS[coating](wavelength_nm)


class Powers:
    """Reflectance and transmittance of every surface of a prescription.

    Call it with (surface, reflects, forward, cosine); the cosine has the shape (band, ...), or one
    that broadcasts to it.
    """

    def __init__(
        self,
        prescription: Prescription,
        wavelength_nm: float | Sequence[float],
        sensor_reflectance: float = 0.0,
    ) -> None:
        self.prescription = prescription
        self.wavelength_nm = np.atleast_1d(np.asarray(wavelength_nm, float))
        self.indices = prescription.indices(self.wavelength_nm)
        self.sensor_reflectance = sensor_reflectance
        self._tables = {}

    def __call__(
        self, k: int, reflects: bool, forward: bool, cosine: np.ndarray
    ) -> float | np.ndarray:
        """Return the fraction of unpolarised power that is reflected or transmitted.

        The sensor absorbs all light that it does not reflect; its transmittance is 1 here.

        Parameters
        ----------
        k : number of the surface.
        reflects : whether the light is reflected; otherwise it is transmitted.
        forward : whether the light goes towards the sensor.
        cosine : cosine of the angle of incidence, any shape with bands first.
        """
        if k == len(self.prescription.surfaces) - 1:
            return self.sensor_reflectance if reflects else 1.0
        if self.prescription.media[k] == self.prescription.media[k + 1]:
            return 0.0 if reflects else 1.0
        reflectance = self._reflectance(k, forward, cosine)
        return reflectance if reflects else self._transmittance(k, reflectance)

    def at_normal(self, k: int) -> np.ndarray:
        """Return the reflectance of a surface at normal incidence, (band,)."""
        return np.broadcast_to(
            self(k, True, True, np.ones((len(self.wavelength_nm), 1))), (len(self.wavelength_nm), 1)
        )[:, 0]

    @staticmethod
    def _transmittance(_k: int, reflectance: np.ndarray) -> np.ndarray:
        return 1 - reflectance  # all layers are lossless

    def _reflectance(self, k: int, forward: bool, cosine: np.ndarray) -> np.ndarray:
        if (k, forward) not in self._tables:
            self._tables[k, forward] = self._table(k, forward)
        table = self._tables[k, forward]
        at = np.where(np.isfinite(cosine), np.clip(cosine, 0, 1), 0) * (COSINES - 1)
        low = np.minimum(at.astype(np.intp), COSINES - 2)
        part = at - low
        start = (np.arange(len(table)) * COSINES).reshape(-1, *[1] * (at.ndim - 1))
        flat = table.ravel()
        return flat[start + low] * (1 - part) + flat[start + low + 1] * part

    def _table(self, k: int, forward: bool) -> np.ndarray:
        lens = self.prescription
        wave = self.wavelength_nm[:, None]
        stack = [
            (np.reshape(n, (-1, 1)) if np.ndim(n) else n, d)
            for n, d in layers(lens.coatings[k], self.wavelength_nm)
        ]
        if "air" not in lens.media[k : k + 2]:
            stack = []  # cemented surfaces have no coating
        n_from, n_to = (
            (self.indices[k], self.indices[k + 1])
            if forward
            else (self.indices[k + 1], self.indices[k])
        )
        if (lens.media[k] if forward else lens.media[k + 1]) != "air":
            stack = stack[::-1]
        return reflect_unpolarised(
            n_from[:, None], n_to[:, None], stack, np.linspace(0, 1, COSINES)[None], wave
        )[0]
