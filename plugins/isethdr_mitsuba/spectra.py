"""Spectra on the device: one table for all, looked up at the wavelengths that a path carries."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from .placed_lamps import SPECTRUM_NM


class SpectrumTable:
    """Rows of spectra on the 1 nm grid SPECTRUM_NM, linear between, constant beyond the ends."""

    def __init__(self, rows):
        self.values = mi.Float(np.concatenate([np.zeros(0), *rows]) if len(rows) else np.zeros(len(SPECTRUM_NM)))
        dr.eval(self.values)

    def at(self, row, waves, active=True):
        """Return row `row` at `waves`, a list of packets of four wavelengths in nm, as a list of Spectrum."""
        base, last = row * len(SPECTRUM_NM), len(SPECTRUM_NM) - 1
        out = []
        for packet in waves:
            lanes = []
            for k in range(4):
                place = dr.clip(packet[k] - SPECTRUM_NM[0], 0, last)
                left = dr.minimum(mi.UInt32(place), last - 1)
                a = dr.gather(mi.Float, self.values, base + left, active)
                b = dr.gather(mi.Float, self.values, base + left + 1, active)
                lanes.append(dr.lerp(a, b, place - mi.Float(left)))
            out.append(mi.Spectrum(*lanes))
        return out
