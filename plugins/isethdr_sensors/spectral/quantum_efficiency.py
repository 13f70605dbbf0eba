"""Quantum efficiency: electrons per photon of every filter, including the blocking filter, and the
bands in which the sensor responds.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError, did_you_mean

from ..sampling.pixel_grid import window_m
from ..sensor_model import SensorModel
from . import band_integration, spectral_curves
from .colour_filter_array import channels

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from isethdr_core.pipeline.demand import Demand

    from .band_integration import Nodes

# quantum efficiency, relative to the largest, below which outer bands need not be rendered
NEGLIGIBLE = 1e-6
BLIND = 0.02  # largest value at which a table may end, relative to the peak of the curve
# distance by which light may exceed the end of a table, for sub-bands of its last band
BEYOND_NM = 10.0


def quantum_efficiency(model: SensorModel, wavelength_nm: ArrayLike) -> np.ndarray:
    """Return (channel, band) electrons per photon, for light that is constant over each band. The
    channels are those of `colour_filter_array.channels`.

    The curves are integrated over every band, so that a peak between two band centres counts.
    Curves of a table are linear from row to row, and their integral is exact. A band that extends
    beyond the table, but has its centre inside, has the mean over its part inside the table. The
    width of a single band is not known; its value is that at its centre.

    Raises
    ------
    ConfigError : there is more than one electron per photon, or none in all bands of the light.
    """
    w = np.asarray(wavelength_nm, float)
    if len(w) < 2:
        return _with_response(model, spectral_curve(model, w), w)
    at = band_integration.nodes(w, _breaks_nm(model))
    curves = spectral_curve(model, at.wavelength_nm)
    within_table = _nodes_in_table(model, at, w)
    return _with_response(
        model, np.stack([band_integration.photon_means(row, at, within_table) for row in curves]), w
    )


def spectral_curve(model: SensorModel, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return (channel, wavelength) electrons per photon at single wavelengths. The channels are
    those of `colour_filter_array.channels`.
    """
    w = np.asarray(wavelength_nm, float)
    qe = np.stack([_curve(model, letter, w) for letter in channels(model.cfa)])
    if model.infrared_cut and model.curves != "unit":
        qe = qe * spectral_curves.infrared_cut(w)
    if qe.max() > 1.0 + 1e-12:
        raise ConfigError(
            f"sensor.peak_qe={model.peak_qe} makes {qe.max():.3g} electrons per photon; expected at"
            " most 1"
        )
    return qe


def _with_response(model: SensorModel, qe: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return `qe` unchanged; raise ConfigError if all of it is 0."""
    if qe.any():
        return qe
    where = f"sensor.qe_csv={model.qe_csv!r}" if model.qe_csv else f"sensor.cfa={model.cfa!r}"
    raise ConfigError(
        f"{where} has no response in the bands from {w.min():g} to {w.max():g} nm; expected a"
        " quantum efficiency above 0 in one of them; use bands within the curve, or another curve"
    )


def _breaks_nm(model: SensorModel) -> np.ndarray:
    """Return the wavelengths at which the model's curves have corners."""
    if model.qe_csv:
        return spectral_curves.read_csv(model.qe_csv)["wavelength_nm"]
    return np.array(spectral_curves.FITTED_NM)


def _nodes_in_table(model: SensorModel, at: Nodes, w: np.ndarray) -> np.ndarray | None:
    """Return a mask of the nodes that the mean of a band uses. If the centre of the band is inside
    the table, these are the nodes inside the table; otherwise all nodes. None without a table.
    """
    if not model.qe_csv:
        return None
    table_nm = spectral_curves.read_csv(model.qe_csv)["wavelength_nm"]
    centre_within = (w >= table_nm[0]) & (w <= table_nm[-1])
    within = (at.wavelength_nm >= table_nm[0]) & (at.wavelength_nm <= table_nm[-1])
    return within | ~centre_within[at.band]


def smooth_spectrum_error(
    model: SensorModel, wavelength_nm: np.ndarray, spectrum: np.ndarray | None = None
) -> float:
    """Return a bound on the relative error of a channel's electrons due to the assumption that
    light is constant over each band.

    Parameters
    ----------
    model : `SensorModel` with the curves.
    wavelength_nm : centres of the bands (band,), nm.
    spectrum : mean energy per nm of the light (band,). It is tested together with black bodies of
        2000 to 20000 K; None: these alone.
    """
    w = np.asarray(wavelength_nm, float)
    if len(w) < 2:
        return 0.0
    at = band_integration.nodes(w, _breaks_nm(model))
    curves = spectral_curve(model, at.wavelength_nm)
    return band_integration.smooth_spectrum_error(
        quantum_efficiency(model, w), curves, at, w, spectrum
    )


def line_error(model: SensorModel, wavelength_nm: np.ndarray) -> float:
    """Return a bound on the error for any spectrum, including a line at the edge of its band.

    Only the mean energy of a band is known, so all light in it counts with the mean efficiency over
    the band. Electrons per joule are proportional to wavelength x quantum efficiency. The bound is
    the largest deviation of this product from its mean over the band, relative to the largest mean.
    Multiplied by the electrons that all energy of the light would make in the most sensitive band,
    it bounds the error.
    """
    w = np.asarray(wavelength_nm, float)
    if len(w) < 2:
        return 0.0
    part_bands, at = (
        make(w, _breaks_nm(model)) for make in (band_integration.pieces, band_integration.nodes)
    )
    points_nm = np.concatenate([at.wavelength_nm, part_bands.low_nm, part_bands.high_nm])
    band = np.concatenate([at.band, part_bands.band, part_bands.band])
    mean = quantum_efficiency(model, w) * w
    return float(
        np.max(np.abs(spectral_curve(model, points_nm) * points_nm - mean[:, band])) / np.max(mean)
    )


def narrow(model: SensorModel, demand: Demand) -> Demand:
    """Return the demand limited to the sensor's window, and without the outer bands in which the
    sensor does not respond. The ledger states a bound of the effect.
    """
    demand = replace(demand, window_m=window_m(model.pitch_um, model.rows, model.columns))
    if demand.wavelength_nm is None:
        return demand
    strongest = quantum_efficiency(model, demand.wavelength_nm).max(0)
    sensitive = np.flatnonzero(strongest > NEGLIGIBLE * strongest.max())
    # inner bands remain, and at least two bands, because band widths follow from the distances
    # between centres
    first = min(sensitive[0], max(len(strongest) - 2, 0))
    last = max(sensitive[-1], min(first + 1, len(strongest) - 1))
    needed_nm = demand.wavelength_nm[first : last + 1]
    dropped = [f"{w:g}" for w in demand.wavelength_nm if w not in needed_nm]
    if dropped:
        ledger.left_out(
            "bands"
            f" {', '.join(dropped if len(dropped) < 9 else [*dropped[:4], '...', *dropped[-4:]])}"
            " nm",
            "quantum efficiency below 1e-6 of its peak",
            NEGLIGIBLE,
            "electrons per electron that the same photons make at the peak",
            key="bands",
            needless=True,
        )
    return replace(demand, wavelength_nm=tuple(needed_nm))


def _curve(model: SensorModel, letter: str, w: np.ndarray) -> np.ndarray:
    if letter.islower() and model.lower_case_share != 1.0:
        return model.lower_case_share * _curve(model, letter.upper(), w)
    letter = letter.upper()
    if model.qe_csv:
        table = spectral_curves.read_csv(model.qe_csv)
        if letter not in table:
            channels = [name for name in table if name != "wavelength_nm"]
            raise ConfigError(
                f"sensor.qe_csv={model.qe_csv!r} has no column for filter"
                f" {letter!r}{did_you_mean(letter, channels)}"
            )
        response = table[letter] * (
            spectral_curves.infrared_cut(table["wavelength_nm"]) if model.infrared_cut else 1.0
        )
        _check_cover(model.qe_csv, letter, table["wavelength_nm"], response, w)
        return np.interp(w, table["wavelength_nm"], table[letter], left=0.0, right=0.0)
    if model.curves == "unit":
        return np.ones_like(w)
    return model.peak_qe * spectral_curves.filter_curve(letter, w)


def _check_cover(
    path: str, letter: str, table_nm: np.ndarray, values: np.ndarray, w: np.ndarray
) -> None:
    """Refuse a table that ends where the filter still transmits, if the light extends beyond the
    end of the table.
    """
    for end, light_goes_on in (
        (0, w.min() < table_nm[0] - BEYOND_NM),
        (-1, w.max() > table_nm[-1] + BEYOND_NM),
    ):
        if light_goes_on and values[end] > BLIND * values.max():
            raise ConfigError(
                f"sensor.qe_csv={path!r}: filter {letter} still has {values[end]:.3g} electrons per"
                f" photon at {table_nm[end]:g} nm, where the table ends; the light covers"
                f" {w.min():g}..{w.max():g} nm; add rows, the last one 0 where it is blind"
            )
