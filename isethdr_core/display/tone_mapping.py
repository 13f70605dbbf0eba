"""Local tone mapping: displayed luminance that depends on a pixel's surroundings, so that both a
tunnel and its exit are visible.

All values are relative to a stated white; no step uses the largest value of the picture. Pyramids
have a fixed depth, so pixels farther away than `REACH_PX` have no influence: a lamp at one end does
not darken the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..physics.colour.colour_spaces import srgb_decode, srgb_encode

LEVELS = 6  # largest number of halvings of the size in a pyramid
REACH_PX = 4 * 2**LEVELS
# exposure fusion
STOPS = tuple(
    range(-4, 7)
    # exposures that are fused, in stops relative to that of the white; with a spacing of one stop,
    # brighter light is displayed brighter everywhere
)
# best exposed code value, and the standard deviation of its weight (Mertens et al. 2009)
WELL = 0.5
SPREAD = 0.2
FAINT = 1e-12  # weight of a sample that no exposure shows well
# local Laplacian
SIGMA = np.log(2.5)  # largest contrast that is detail and is kept, natural logarithm
BETA = 0.4  # exponent of larger contrasts: two decades below white become 0.16 of white
# luminance / white: darker and brighter samples are shown as these
DARKEST = 1e-5
BRIGHTEST = 1e3


def exposure_fusion(relative: np.ndarray) -> np.ndarray:
    """Return displayed linear luminance 0..1 (y, x): a blend of several exposures of the picture.

    The weight of a sample increases with its contrast and towards the best exposed code value. The
    exposures are blended in Laplacian pyramids (Mertens, Kautz, Van Reeth 2009, without their
    weight of colour saturation, because luminance has no colour).

    Parameters
    ----------
    relative : (y, x) luminance over that of white; negative estimates show as black.
    """
    t = np.maximum(np.asarray(relative, float), 0.0)
    shots = [srgb_encode(t * 2.0**stop) for stop in STOPS]
    weights = np.array(
        [
            np.exp(-((shot - WELL) ** 2) / (2 * SPREAD**2)) * (np.abs(_contrast(shot)) + 0.01)
            + FAINT
            for shot in shots
        ]
    )
    weights /= weights.sum(0)
    blended = None
    for shot, weight in zip(shots, weights):
        part = [w * band for w, band in zip(_gaussian(weight), _laplacian(shot))]
        blended = part if blended is None else [a + b for a, b in zip(blended, part)]
    return srgb_decode(_collapsed(blended))


def local_laplacian(relative: np.ndarray) -> np.ndarray:
    """Return displayed linear luminance 0..1 (y, x): large contrasts compressed, small ones kept,
    without halos.

    Paris, Hasinoff, Kautz 2011 in the fast form of Aubry et al. 2014, on the logarithm of
    luminance. White stays white.

    Parameters
    ----------
    relative : (y, x) luminance over that of white; negative estimates show as black.
    """
    level = np.log(np.clip(np.asarray(relative, float), DARKEST, BRIGHTEST))
    guide = _gaussian(level)
    pyramid = [np.zeros_like(band) for band in guide[:-1]] + [BETA * guide[-1]]
    first, last = (int(np.floor(v / SIGMA)) for v in (level.min(), level.max()))
    for k in range(first, last + 2):
        centre = k * SIGMA  # on a grid that is fixed to the white
        near = [np.maximum(1 - np.abs(band - centre) / SIGMA, 0.0) for band in guide[:-1]]
        if not any(n.any() for n in near):
            continue
        distance = level - centre
        remapped = centre + np.where(
            np.abs(distance) > SIGMA,
            np.sign(distance) * (BETA * (np.abs(distance) - SIGMA) + SIGMA),
            distance,
        )
        for band, n, detail in zip(pyramid, near, _laplacian(remapped)):
            band += n * detail
    luminance = np.exp(_collapsed(pyramid))
    return np.clip(np.where(np.asarray(relative) > 0, luminance, 0.0), 0.0, 1.0)


def _contrast(image: np.ndarray) -> np.ndarray:
    from scipy.ndimage import laplace

    return laplace(image, mode="mirror")


def _depth(shape: tuple[int, int]) -> int:
    return max(min(LEVELS, int(np.log2(max(min(shape), 1))) - 1), 0)


def _gaussian(image: np.ndarray) -> list:
    """Return the Gaussian pyramid: the picture and smaller ones, each a blur of the one before,
    taken at every second pixel (Burt, Adelson 1983).
    """
    levels = [image]
    for _ in range(_depth(image.shape)):
        levels.append(_blurred(levels[-1])[::2, ::2])
    return levels


def _laplacian(image: np.ndarray) -> list:
    """Return the differences between successive blurs, finest first, and the coarsest blur."""
    steps = _gaussian(image)
    return [fine - _enlarged(coarse, fine.shape) for fine, coarse in zip(steps[:-1], steps[1:])] + [
        steps[-1]
    ]


def _collapsed(bands: Sequence[np.ndarray]) -> np.ndarray:
    """Return the picture of a Laplacian pyramid."""
    image = bands[-1]
    for band in bands[-2::-1]:
        image = band + _enlarged(image, band.shape)
    return image


def _blurred(image: np.ndarray) -> np.ndarray:
    from scipy.ndimage import convolve1d

    for axis in (0, 1):
        image = convolve1d(image, np.array([1, 4, 6, 4, 1]) / 16, axis, mode="mirror")
    return image


def _enlarged(image: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    wide = np.zeros(shape)
    wide[::2, ::2] = image
    weight = np.zeros(shape)
    weight[::2, ::2] = 1.0
    return _blurred(wide) / _blurred(weight)  # division: the border has fewer samples


OPERATORS = {"exposure_fusion": exposure_fusion, "local_laplacian": local_laplacian}
