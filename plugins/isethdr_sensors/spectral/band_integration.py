"""Band integration: means of spectral curves over the bands of the light, and their errors for
smooth spectra.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from isethdr_core.physics.radiometry import band_widths_nm, planck_radiance

# number of Gauss-Legendre points of a piece, exact for polynomials up to the 15th degree
POINTS = 8
# temperatures of black bodies, K, from a candle to a blue sky
SMOOTH_K = (2000.0, 3000.0, 5000.0, 10000.0, 20000.0)


class Pieces(NamedTuple):
    """Intervals within bands over which all curves are smooth."""

    low_nm: np.ndarray
    high_nm: np.ndarray
    band: np.ndarray  # index of the band


class Nodes(NamedTuple):
    """Points at which curves are integrated over bands."""

    wavelength_nm: np.ndarray
    weight: np.ndarray  # nm; the weights of a band sum to its width
    band: np.ndarray  # index of the band


def pieces(wavelength_nm: np.ndarray, breaks_nm: np.ndarray = ()) -> Pieces:
    """Return the pieces of bands. The borders of bands lie half way between their centres.

    Parameters
    ----------
    wavelength_nm : (band,) centres of two or more bands, increasing, nm.
    breaks_nm : wavelengths at which curves have corners, nm.
    """
    w = np.asarray(wavelength_nm, float)
    inner = (w[1:] + w[:-1]) / 2
    borders = np.concatenate([[2 * w[0] - inner[0]], inner, [2 * w[-1] - inner[-1]]])
    breaks = np.asarray(breaks_nm, float)
    edges = np.union1d(borders, breaks[(breaks > borders[0]) & (breaks < borders[-1])])
    low = edges[:-1]
    high = edges[1:]
    return Pieces(low, high, np.clip(np.searchsorted(borders, (low + high) / 2) - 1, 0, len(w) - 1))


def nodes(wavelength_nm: np.ndarray, breaks_nm: np.ndarray = ()) -> Nodes:
    """Return the Gauss-Legendre points of the `pieces` of bands. The arguments are those of
    `pieces`.
    """
    low, high, band = pieces(wavelength_nm, breaks_nm)
    at, weight = np.polynomial.legendre.leggauss(POINTS)
    middle = (low + high)[:, None] / 2
    half = (high - low)[:, None] / 2
    return Nodes((middle + half * at).ravel(), (half * weight).ravel(), np.repeat(band, POINTS))


def photon_means(curve: np.ndarray, at: Nodes, nodes_used: np.ndarray | None = None) -> np.ndarray:
    """Return the mean of a curve over each band, weighted by photons of a constant energy spectrum.

    Parameters
    ----------
    curve : (node,) values at the nodes `at`.
    at : nodes of the integration.
    nodes_used : (node,) mask of the nodes to use; None: all. A band without nodes has the mean 0.

    Notes
    -----
    A constant energy E per nm is E wavelength / (h c) photons per nm, so that the mean of q is
    int q w dw / int w dw.
    """
    photons = at.weight * at.wavelength_nm * (1.0 if nodes_used is None else nodes_used)
    count = at.band.max() + 1
    photons_of_bands = np.bincount(at.band, photons, count)
    return np.bincount(at.band, photons * curve, count) / np.where(
        photons_of_bands > 0, photons_of_bands, 1.0
    )


def smooth_spectrum_error(
    response: np.ndarray,
    curves: np.ndarray,
    at: Nodes,
    wavelength_nm: np.ndarray,
    spectrum: np.ndarray | None = None,
) -> float:
    """Return the largest relative error of a channel's electrons that are computed from the band
    means of smooth spectra.

    Parameters
    ----------
    response : (channel, band) electrons per photon of the bands.
    curves : (channel, node) electrons per photon at the nodes `at`.
    at : nodes of the integration.
    wavelength_nm : (band,) centres of the bands, nm.
    spectrum : (band,) mean energy per nm of the light in its bands, linear between band centres;
        None: black bodies only.
    """
    w = np.asarray(wavelength_nm, float)
    spectra = [planck_radiance(at.wavelength_nm, k) for k in SMOOTH_K]
    if spectrum is not None and np.any(spectrum):
        spectra.append(np.interp(at.wavelength_nm, w, spectrum))
    width = band_widths_nm(w)
    worst = 0.0
    for energy in spectra:
        mean = np.bincount(at.band, at.weight * energy, len(w)) / width
        counted = response @ (mean * width * w)
        true = curves @ (energy * at.weight * at.wavelength_nm)
        lit = true > 0
        worst = max(worst, float(np.max(np.abs(counted[lit] / true[lit] - 1), initial=0.0)))
    return worst
