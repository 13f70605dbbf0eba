"""Spectra on the device: colours of surfaces and of light, band by band, at the wavelengths that
the paths of one pass carry.

A path carries one wavelength per band, at the same place of every band: there is no colour noise.
The places of a pass are steps of half a nanometre, plus u for half of them and plus 1 - u for the
others, in steps; u is drawn anew for each pass. Tables are linear between whole nanometres, so that
all places together integrate a band exactly that begins and ends at whole or half ones: sums of (1
- u) f[j] + u f[j + 1] and of u f[j] + (1 - u) f[j + 1] make the trapezoid rule. Other bands, and
products of spectra, are right on average over u.
"""

from __future__ import annotations

from math import ceil

import mitsuba as mi
import numpy as np

from ..lamps.placed_lamps import SPECTRUM_NM


class BandTable:
    """Rows of spectra (row, nm) on the 1 nm grid SPECTRUM_NM, constant beyond its ends, in bands
    `step_nm` wide around `wavelength_nm`.
    """

    def __init__(self, rows, wavelength_nm, step_nm: float, means: int = 1):
        self.rows, self.means = np.asarray(rows, float), means  # of the last rows, in `at`
        self.packets = ceil(len(wavelength_nm) / 4)  # of four bands; the last band fills them up
        self.bands_nm = np.pad(
            np.asarray(wavelength_nm, float),
            (0, 4 * self.packets - len(wavelength_nm)),
            mode="edge",
        )
        steps = ceil(2 * step_nm)
        self.starts_nm, self.spacing_nm = (
            (np.arange(steps) / steps - 0.5) * step_nm,
            step_nm / steps,
        )
        self.places = 2 * steps

    def at(self, u: float) -> np.ndarray:
        """Return the values (place, row + means, band) of a pass whose places stand `u` (0 to 1)
        and 1 - u above whole steps; last come the means of the last rows.
        """
        shift = np.stack(
            [self.starts_nm + u * self.spacing_nm, self.starts_nm + (1 - u) * self.spacing_nm], 1
        ).ravel()
        nm = np.clip(
            self.bands_nm + shift[:, None] - SPECTRUM_NM[0], 0, len(SPECTRUM_NM) - 1
        )  # (place, band)
        left = np.minimum(nm.astype(int), len(SPECTRUM_NM) - 2)
        value = np.moveaxis(
            self.rows[:, left] * (1 - (nm - left)) + self.rows[:, left + 1] * (nm - left), 0, 1
        )
        last = value[:, -self.means :]
        return np.concatenate([value, np.broadcast_to(last.mean(0), last.shape)], 1)

    def on_device(self, u: float):
        """Return `at(u)`, flat.

        It goes through a list, which the renderer copies into aligned memory. It would use a NumPy
        array where that lies, which is aligned only by chance, and then compiles another kernel.
        """
        return mi.Float(self.at(u).astype(np.float32).ravel().tolist())
