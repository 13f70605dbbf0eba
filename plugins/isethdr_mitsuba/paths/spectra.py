"""Spectra on the device: spectra of surfaces and light at the wavelengths of one pass, band by
band.

A path carries one wavelength per band, at the same relative position in every band. Colours
therefore have no noise of their own. A band is divided into steps of at most half a nanometre. Half
of the positions of a pass are at the share u of a step, the others at 1 - u; each pass draws a new
u. Tables are linear between whole nanometres. The mean over all positions is the exact integral
over a band that begins and ends at multiples of half a nanometre: the sum of
(1 - u) f[j] + u f[j + 1] and u f[j] + (1 - u) f[j + 1] is the trapezoid rule. Other bands, and
products of spectra, are exact in the mean over u.
"""

from __future__ import annotations

from math import ceil
from typing import Any

import mitsuba as mi
import numpy as np

from ..lamps.placed_lamps import SPECTRUM_NM


class BandTable:
    """Rows of spectra (row, nm) on the 1 nm grid SPECTRUM_NM, constant beyond its ends, in bands of
    the width `step_nm` around `wavelength_nm`.
    """

    def __init__(
        self, rows: np.ndarray, wavelength_nm: np.ndarray, step_nm: float, means: int = 1
    ) -> None:
        """Lay out the samples within the bands.

        Parameters
        ----------
        rows : (row, SPECTRUM_NM) spectra.
        wavelength_nm : (band,) centres, nm.
        step_nm : width of the bands, nm.
        means : number of rows at the end of the table for which `at` also returns the means over
            the positions.
        """
        self.rows = np.asarray(rows, float)
        self.means = means
        # packets of four bands; copies of the last band fill the last packet
        self.packets = ceil(len(wavelength_nm) / 4)
        self.bands_nm = np.pad(
            np.asarray(wavelength_nm, float),
            (0, 4 * self.packets - len(wavelength_nm)),
            mode="edge",
        )
        steps = ceil(2 * step_nm)
        self.starts_nm = (np.arange(steps) / steps - 0.5) * step_nm
        self.spacing_nm = step_nm / steps
        self.places = 2 * steps

    def at(self, u: float) -> np.ndarray:
        """Return the values (place, row + means, band) at the shares `u` (0 to 1) and 1 - u of each
        step. The means of the last rows over all places follow at the end.
        """
        shift = np.stack(
            [self.starts_nm + u * self.spacing_nm, self.starts_nm + (1 - u) * self.spacing_nm], 1
        ).ravel()
        # (place, band)
        nm = np.clip(self.bands_nm + shift[:, None] - SPECTRUM_NM[0], 0, len(SPECTRUM_NM) - 1)
        left = np.minimum(nm.astype(int), len(SPECTRUM_NM) - 2)
        value = np.moveaxis(
            self.rows[:, left] * (1 - (nm - left)) + self.rows[:, left + 1] * (nm - left), 0, 1
        )
        last = value[:, -self.means :]
        return np.concatenate([value, np.broadcast_to(last.mean(0), last.shape)], 1)

    def on_device(self, u: float) -> Any:
        """Return `at(u)`, flat.

        The values pass through a list, which Dr.Jit copies into aligned memory. A NumPy array would
        be used in place; it is aligned only by chance, and an unaligned one needs another kernel.
        """
        return mi.Float(self.at(u).astype(np.float32).ravel().tolist())
