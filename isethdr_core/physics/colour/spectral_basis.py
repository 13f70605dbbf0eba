"""Spectral basis: a few numbers per spectrum that determine the sensor's signal, even if each
wavelength is blurred differently.

W (functional, band) maps a spectrum s to numbers a = W s, and G (band, functional) predicts the
spectrum from them: s ~ G a. The first functionals are the sensor's own sensitivities: the part of
the spectrum that they do not predict makes no electrons unless the blur changes with wavelength.
The other functionals are the strongest directions of the kernels, in the metric of the given
spectra (principal components of the kernels after a regression on the first numbers).
"""

from __future__ import annotations

import numpy as np

# least eigenvalue over the largest one; the given spectra do not differ in directions with smaller
# eigenvalues
FLOOR = 1e-14


def shot_noise_moments(spectra: np.ndarray, counts: np.ndarray, weight: float = 1.0) -> np.ndarray:
    """Return the second moments (band, band) of spectra, each divided by its signal. This weights
    spectra by the inverse of their shot noise variance.

    Parameters
    ----------
    spectra : (sample, band) array of spectra, any unit.
    counts : (sample,) signal of each spectrum, any unit; samples without signal are left out.
    weight : factor on the result, no unit.
    """
    lit = counts > 0
    return weight * ((spectra[lit] / counts[lit, None]).T @ spectra[lit])


def kernel_moments(kernels: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the second moments (band, band) of the light of kernels, summed over channels, with
    the weights of `shot_noise_moments`. The trace is 1.

    Parameters
    ----------
    kernels : (point, band) samples of the kernels.
    weights : (channel, band) response of the channels.
    """
    total = 0.0
    for row in weights:
        weighted_kernels = kernels * row
        counts = weighted_kernels.sum(1)
        part = shot_noise_moments(weighted_kernels, counts)
        total = total + part
    return total / np.trace(total)


def directions(weights: np.ndarray, moments: np.ndarray, kernel_spread: np.ndarray) -> np.ndarray:
    """Return W (band, band) with unit rows. The first rows span `weights`; the others are
    directions of `kernel_spread`, the strongest first.

    Parameters
    ----------
    weights : (channel, band) response.
    moments : (band, band) second moments of the spectra.
    kernel_spread : (band, band) second moments of the kernels.
    """
    value, vector = np.linalg.eigh(moments)
    root = (vector * np.sqrt(np.maximum(value, FLOOR * value[-1]))) @ vector.T
    own, size, _ = np.linalg.svd(
        (root @ weights.T) / np.linalg.norm(weights, axis=1), full_matrices=False
    )
    own = own[:, size > 1e-9 * size[0]]  # channels may be linearly dependent
    complement = np.eye(len(moments)) - own @ own.T
    _, vector = np.linalg.eigh(complement @ root @ kernel_spread @ root @ complement)
    rows = np.linalg.solve(
        root, np.concatenate([own, vector[:, ::-1][:, : len(moments) - own.shape[1]]], axis=1)
    ).T
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def predictor(functionals: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """Return G (band, functional), the best linear prediction of spectra from W s.

    Parameters
    ----------
    functionals : W (functional, band).
    moments : (band, band) second moments of the spectra.
    """
    cross_moments = moments @ functionals.T
    return np.linalg.lstsq((functionals @ cross_moments).T, cross_moments.T, rcond=1e-12)[0].T
