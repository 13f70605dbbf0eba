"""Spectral fit: which functionals of a scene's spectra to convolve, so that what they cannot tell stays below the sensor's noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from isethdr_core.accuracy import FUNCTIONALS
from isethdr_core.physics.convolution_spectral import matrix_product
from isethdr_core.physics.spectral_basis import directions, kernel_moments, predictor, shot_noise_moments

from . import bright_tiles

BRIGHT = 100.0  # times the median: tiles that count as bright
MOST_BRIGHT = 16384
LEAST_BRIGHT = 64
SPECTRA = 2048  # of bright tiles that the fit is made from, and that many of the others
TARGETS = 64  # tiles at which the light that comes from bright ones is looked at
SOURCES = 256  # bright tiles, the brightest
NEIGHBOURHOODS = 700  # tiles at which the light that comes from around them is looked at
STEPS = np.stack(np.mgrid[-1:2, -1:2], axis=-1).reshape(-1, 2)
WORST = 1.7, 3.5, 2.0  # of all tiles, over that of those looked at: of light from around, from all bright ones, from single ones
TOLERATED = FUNCTIONALS  # of the error allowed, at the worst of all tiles
MOST = 12  # functionals; beyond them band by band is as fast


@dataclass(frozen=True, eq=False)
class Fit:
    """Functionals and what they tell: spectrum ~ predict @ (project @ spectrum)."""

    project: np.ndarray  # (functional, band)
    predict: np.ndarray  # (band, functional)
    bright: np.ndarray  # flat indices of bright tiles, and the radii in tiles within which they are corrected
    radii: np.ndarray
    noise_share: float  # largest error, in standard deviations of the noise, from those looked at
    looked_at: int


def fit(cube, relative, weights, made, response) -> Fit | None:
    """Return the fewest functionals that tell the spectra of `cube` well enough for a sensor; None where too many are needed.

    Parameters
    ----------
    cube : (band, y, x) radiance. `relative` : None, or its (y, x) factor.
    weights : (channel, band) photocurrent per radiance and kernel.
    made : `kernels.Kernels` of the bands. `response` : the sensor's, for its noise.
    """
    total = np.abs(weights).sum(0)
    rate = matrix_product(total[None].astype(cube.dtype), cube)[0].ravel()
    bright, others = _tiles(rate, cube.shape[1:])
    factor = np.ones(rate.size) if relative is None else relative.ravel()
    spectra, rest = (_spectra(cube, factor, i) for i in (bright, others))
    some = spectra[:: max(1, len(spectra) // SPECTRA)]
    moments = shot_noise_moments(some, some @ total, len(spectra) / len(some)) + shot_noise_moments(rest, rest @ total, rate.size / len(rest))
    scale = np.trace(moments)
    if not scale > 0:
        return None
    moments /= scale
    points, steps, first = made.sampled
    centre = np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in made.bands], float)
    known = np.concatenate([weights, weights * centre])  # all of a tile's light, and what stays in the tile: both exact
    rows = directions(known, moments, kernel_moments(points.reshape(-1, len(cube)), weights))
    looks = _Looks(cube, factor, bright, others, spectra, weights, made, response)
    for count in range(np.linalg.matrix_rank(known), min(MOST, len(cube) // 2) + 1):
        project = rows[:count]
        predict = predictor(project, moments)
        share, number = looks.worst(project, predict)
        if share < TOLERATED * response.noise_fraction_allowed:
            return Fit(project, predict, bright, looks.radii, share, number)
    return None


def _tiles(rate, shape):
    """Return flat indices of the bright tiles, the brightest ones, and of tiles spread evenly over the frame."""
    height, width = shape
    steps = [max(1, int(n // np.sqrt(SPECTRA * n / (height + width - n)))) for n in shape]
    rows, columns = (np.arange(s // 2, n, s) for s, n in zip(steps, shape))
    others = (rows[:, None] * width + columns).ravel()
    bright = np.flatnonzero(rate > BRIGHT * np.median(rate[others]))
    if len(bright) < LEAST_BRIGHT:
        bright = np.argpartition(rate, -min(LEAST_BRIGHT, rate.size))[-LEAST_BRIGHT:]
    bright = bright[np.argsort(-rate[bright], kind="stable")][:MOST_BRIGHT]
    return bright, np.setdiff1d(others, bright)


def _spectra(cube, factor, tiles):
    return np.stack([band.ravel()[tiles] for band in cube], axis=1) * factor[tiles, None]


class _Looks:
    """Errors of a fit in standard deviations of the noise: at tiles lit by their neighbours, and by bright ones far away."""

    def __init__(self, cube, factor, bright, others, spectra, weights, made, response):
        shape = cube.shape[1:]
        self.weights, self.response, self.bright = weights, response, spectra[:SOURCES]
        self.points, self.steps, self.first = made.sampled
        self.middle = [n // 2 for n in made.bands[0].shape]
        some = np.stack(np.unravel_index(others[:: max(1, len(others) // NEIGHBOURHOODS)], shape), axis=-1)
        around = np.clip(some[:, None] + STEPS, 0, np.array(shape) - 1)
        around = np.ravel_multi_index((around[..., 0], around[..., 1]), shape)
        self.near = _spectra(cube, factor, around.ravel()).reshape(*around.shape, -1)
        self.counts = ~np.isin(around, bright)  # the light of bright tiles is corrected
        reach = [min(1, m) for m in self.middle]
        self.core = np.stack([[b[self.middle[0] - y * reach[0], self.middle[1] - x * reach[1]] for b in made.bands] for y, x in STEPS]).astype(float)
        self.near_light = self._from_neighbours(self.near)
        self.radii = bright_tiles.radii(spectra @ weights.sum(0))
        targets = some[:: max(1, len(some) // TARGETS)]
        self.kernels = self._kernels(targets, np.stack(np.unravel_index(bright[:SOURCES], shape), axis=-1))
        self.far_light = self._from_bright(self.bright) + self.near_light[:: max(1, len(some) // TARGETS)]
        self.single, self.around = spectra[:: max(1, len(spectra) // SOURCES)], self._beyond(bright_tiles.RADII[0])
        self.single_light = self._from_single(self.single)

    def _beyond(self, radius):
        """Return sampled kernels (point, band), those nearest to the axis that lie beyond a radius in tiles."""
        y, x = (np.arange(n) * step + first - middle for n, step, first, middle in zip(self.points.shape, self.steps, self.first, self.middle))
        away = np.hypot(y[:, None], x).ravel()
        order = np.argsort(np.where(away > min(radius, away.max() / 2), away, np.inf), kind="stable")[:TARGETS]
        return self.points.reshape(-1, self.points.shape[2])[order]

    def worst(self, project, predict):
        """Return the largest error to be expected of any tile, and how many were looked at."""
        near = self._share(self._from_neighbours((self.near - self.near @ project.T @ predict.T) * self.counts[..., None]), self.near_light)
        far = self._share(self._from_bright(self.bright - self.bright @ project.T @ predict.T), self.far_light)
        single = self._share(self._from_single(self.single - self.single @ project.T @ predict.T), self.single_light)
        looked = near, far, single
        return max(w * float(z.max(initial=0.0)) for w, z in zip(WORST, looked)), sum(z.size for z in looked)

    def _from_neighbours(self, spectra):
        """Return the (tile, channel) photocurrent that a tile and those around it make."""
        return np.einsum("nub,ub->nb", spectra, self.core) @ self.weights.T

    def _from_bright(self, spectra):
        """Return the (target, channel) photocurrent that the light of bright tiles makes."""
        return np.einsum("tsb,sb->tb", self.kernels, spectra) @ self.weights.T

    def _from_single(self, spectra):
        """Return the (source, point, channel) photocurrent that single bright tiles make at points around them."""
        return np.einsum("sb,jb,pb->spj", spectra, self.weights, self.around, optimize=["einsum_path", (0, 1), (0, 1)])

    def _share(self, error, light):
        scale = self.response.area_exposure_m2_s
        noise = np.sqrt(max(self.response.read_noise_e, 1.0) ** 2 + scale * np.abs(light))
        return scale * np.abs(error) / noise

    def _kernels(self, targets, sources):
        """Return the kernels (target, source, band) at the sampled points nearest to the way from each source to each target."""
        away = targets[:, None] - sources
        index = [np.clip(np.rint((away[..., a] + self.middle[a] - self.first[a]) / self.steps[a]).astype(int), 0, n - 1)
                 for a, n in enumerate(self.points.shape[:2])]
        return self.points[index[0], index[1]]
