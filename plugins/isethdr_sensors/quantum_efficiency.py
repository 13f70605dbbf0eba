"""Quantum efficiency: electrons per photon of every filter, blocking filter included, and which bands matter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError, did_you_mean

from . import spectral_curves
from .colour_filter_array import channels
from .pixel_grid import window_m
from .sensor_model import SensorModel

NEGLIGIBLE = 1e-6  # of the largest quantum efficiency: bands below it at both ends need not be rendered
BLIND = 0.02       # of a curve's peak: a table may end here
BEYOND_NM = 10.0   # so far light may reach beyond a table's end: the sub-bands of a last band do


def quantum_efficiency(model: SensorModel, wavelength_nm) -> np.ndarray:
    """Return (channel, wavelength) electrons per photon at the band centres; channels as `colour_filter_array.channels`."""
    w = np.asarray(wavelength_nm, float)
    qe = np.stack([_curve(model, letter, w) for letter in channels(model.cfa)])
    if model.infrared_cut and model.curves != "unit":
        qe = qe * spectral_curves.infrared_cut(w)
    if qe.max() > 1.0 + 1e-12:
        raise ConfigError(f"sensor.peak_qe={model.peak_qe} makes {qe.max():.3g} electrons per photon; expected at most 1")
    return qe


def band_centre_error(model: SensorModel, wavelength_nm) -> float:
    """Return how much a channel's response to a flat spectrum changes when each band is read at 9 points, not at its centre."""
    w = np.asarray(wavelength_nm, float)
    if len(w) < 2:
        return 0.0
    mean = _within_bands(model, w, (np.arange(9) - 4) / 9).mean(2).sum(1)
    return float(np.max(np.abs(quantum_efficiency(model, w).sum(1) - mean) / mean))


def line_error(model: SensorModel, wavelength_nm) -> float:
    """Return a bound on what is wrong for any spectrum, a line at the edge of its band included.

    A band holds the mean of its energy and no more, so light anywhere within it counts as light at its centre. Electrons per joule
    differ by no more than the largest change of wavelength x quantum efficiency within a band: that change, relative to its largest
    value. Times the electrons that all of the light's energy would make at the peak of the most sensitive filter it bounds the error.
    """
    w = np.asarray(wavelength_nm, float)
    if len(w) < 2:
        return 0.0
    offsets = np.linspace(-0.5, 0.5, 21)
    response = _within_bands(model, w, offsets) * (w[:, None] + np.gradient(w)[:, None] * offsets)
    centre = response[..., [10]]
    return float(np.max(np.abs(response - centre)) / np.max(centre))


def _within_bands(model, w, offsets):
    """Return (channel, wavelength, offset) electrons per photon at `offsets` of a band width from each centre."""
    fine = quantum_efficiency(model, (w[:, None] + np.gradient(w)[:, None] * offsets).ravel())
    return fine.reshape(len(fine), len(w), len(offsets))


def narrow(model: SensorModel, demand):
    """Return the demand for what the sensor sees: its window, and no outer band in which it is blind; states the bound."""
    demand = replace(demand, window_m=window_m(model.pitch_um, model.rows, model.columns))
    if demand.wavelength_nm is None:
        return demand
    strongest = quantum_efficiency(model, demand.wavelength_nm).max(0)
    seen = np.flatnonzero(strongest > NEGLIGIBLE * strongest.max())
    # inner bands stay, and always two: band widths come from the distances between centres
    first, last = seen[0], max(seen[-1], min(seen[0] + 1, len(strongest) - 1))
    kept = demand.wavelength_nm[first:last + 1]
    dropped = [f"{w:g}" for w in demand.wavelength_nm if w not in kept]
    if dropped:
        ledger.left_out(f"bands {', '.join(dropped)} nm", "quantum efficiency below 1e-6 of its peak", NEGLIGIBLE,
                        "electrons per electron that the same photons make at the peak")
    return replace(demand, wavelength_nm=tuple(kept))


def _curve(model, letter, w):
    if letter.islower() and model.lower_case_share != 1.0:
        return model.lower_case_share * _curve(model, letter.upper(), w)
    letter = letter.upper()
    if model.qe_csv:
        table = spectral_curves.read_csv(model.qe_csv)
        if letter not in table:
            known = [name for name in table if name != "wavelength_nm"]
            raise ConfigError(f"sensor.qe_csv={model.qe_csv!r} has no column for filter {letter!r}{did_you_mean(letter, known)}")
        seen = table[letter] * (spectral_curves.infrared_cut(table["wavelength_nm"]) if model.infrared_cut else 1.0)
        _check_cover(model.qe_csv, letter, table["wavelength_nm"], seen, w)
        return np.interp(w, table["wavelength_nm"], table[letter], left=0.0, right=0.0)
    if model.curves == "unit":
        return np.ones_like(w)
    return model.peak_qe * spectral_curves.filter_curve(letter, w)


def _check_cover(path, letter, table_nm, values, w):
    """Refuse a table that ends while the filter still sees and the light goes on."""
    for end, beyond in ((0, w.min() < table_nm[0] - BEYOND_NM), (-1, w.max() > table_nm[-1] + BEYOND_NM)):
        if beyond and values[end] > BLIND * values.max():
            raise ConfigError(f"sensor.qe_csv={path!r}: filter {letter} still has {values[end]:.3g} electrons per photon at "
                              f"{table_nm[end]:g} nm, where the table ends; the light covers {w.min():g}..{w.max():g} nm; "
                              "add rows, the last one 0 where it is blind")
