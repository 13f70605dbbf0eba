"""Spectral fit: which functionals of a scene's spectra to convolve, so that what they cannot tell
stays below the sensor's noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from isethdr_core.physics.colour.spectral_basis import (
    directions,
    kernel_moments,
    predictor,
    shot_noise_moments,
)
from isethdr_core.physics.convolution.spectral import matrix_product

from ..psf.kernel_spectra import NEAR
from . import bright_tiles
from .accuracy_shares import FUNCTIONALS

BRIGHT = 100.0  # times the median: tiles that count as bright
MOST_BRIGHT = 16384
ROWS = 64  # whose light is added up at a time
LEAST_BRIGHT = 64
SPECTRA = 2048  # of bright tiles that the fit is made from, and that many of the others
TARGETS = 64  # tiles at which the light that comes from bright ones is looked at
SOURCES = 256  # bright tiles, the brightest
NEIGHBOURHOODS = 700  # tiles at which the light that comes from around them is looked at
STEPS = np.stack(np.mgrid[-1:2, -1:2], axis=-1).reshape(-1, 2)
WORST = (
    1.7,
    3.5,
    2.0,
    # of all tiles, over that of those looked at: of light from around, from all bright ones, from
    # single ones
)
TOLERATED = FUNCTIONALS  # of the error allowed, at the worst of all tiles
MOST = 12  # functionals; beyond them band by band is as fast


@dataclass(frozen=True, eq=False)
class Basis:
    """Functionals of spectra and what they tell: spectrum ~ predict @ (project @ spectrum)."""

    project: np.ndarray  # (functional, band)
    predict: np.ndarray  # (band, functional)

    def missed(self, spectra):
        """Return what is not told of spectra (..., band)."""
        return spectra - spectra @ self.project.T @ self.predict.T


@dataclass(frozen=True, eq=False)
class Fit:
    """The functionals for the near and the far part of the kernels, and the tiles around which they
    are not enough.
    """

    near: Basis
    far: Basis | None  # None where the kernels are not divided
    bright: (
        np.ndarray
    )  # flat indices of bright tiles, and the radii in tiles within which they are corrected
    radii: np.ndarray
    noise_share: float  # largest error, in standard deviations of the noise, from those looked at
    looked_at: int


def fit(cube, given, weights, response, apply=map) -> Fit | None:
    """Return the fewest functionals that tell the spectra of `cube` well enough for a sensor; None
    where too many are needed.

    Parameters
    ----------
    cube : (band, y, x) radiance. `given` : `field_optics.FieldOptics` of its field.
    weights : (channel, band) photocurrent per radiance and kernel.
    response : the sensor's, for its noise.
    apply : how to call a function for every block of rows: `map`, or that of a pool of threads.
    """
    total, made, relative = np.abs(weights).sum(0), given.made, given.relative
    rate = _rate(cube, total, apply) if given.counted is None else given.counted.whole.ravel()
    bright, others = _tiles(rate, cube.shape[1:])
    factor = np.ones(rate.size) if relative is None else relative.ravel()
    spectra, rest = (_spectra(cube, factor, i) for i in (bright, others))
    some = spectra[:: max(1, len(spectra) // SPECTRA)]
    moments = shot_noise_moments(some, some @ total, len(spectra) / len(some)) + shot_noise_moments(
        rest, rest @ total, rate.size / len(rest)
    )
    scale = np.trace(moments)
    if not scale > 0:
        return None
    moments /= scale
    centre = np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in made.bands], float)
    known = np.concatenate(
        [weights, weights * centre]
    )  # all of a tile's light, and what stays in the tile: both exact
    looks = _Looks(cube, factor, bright, others, spectra, weights, made, response)
    allowed = TOLERATED * response.noise_fraction_allowed

    def fewest(known, points, share):
        """Return the first basis whose `share` of the noise is allowed, and that share; (None,
        share) where there is none.
        """
        rows, found = directions(known, moments, kernel_moments(points, weights)), np.inf
        for count in range(np.linalg.matrix_rank(known), min(MOST, len(cube) // 2) + 1):
            basis = Basis(rows[:count], predictor(rows[:count], moments))
            found = share(basis)
            if found < allowed:
                return basis, found
        return None, found

    points = made.sampled[0].reshape(-1, len(cube))
    if made.divided.far is None:
        near, share = fewest(
            known,
            points,
            lambda basis: max(looks.around_tiles(basis), looks.of_bright(basis, basis)),
        )
        return near and Fit(near, None, bright, looks.radii, share, looks.looked_at)
    near, first = fewest(known, looks.core.reshape(-1, len(cube)), looks.around_tiles)
    if near is None:
        return None
    asked = np.concatenate([points[~looks.points_near], looks.beyond_near])
    far, share = fewest(weights, asked, lambda basis: looks.of_bright(near, basis))
    return far and Fit(near, far, bright, looks.radii, max(first, share), looks.looked_at)


def _rate(cube, total, apply):
    """Return the light of each tile, bands weighted by `total`, as one row."""
    rows, first = total[None].astype(cube.dtype), range(0, cube.shape[1], ROWS)
    return np.concatenate(
        list(apply(lambda start: matrix_product(rows, cube[:, start : start + ROWS])[0], first))
    ).ravel()


def _tiles(rate, shape):
    """Return flat indices of the bright tiles, the brightest ones, and of tiles spread evenly over
    the frame.
    """
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
    """Errors of a fit in standard deviations of the noise: at tiles lit by their neighbours, and by
    bright ones far away.
    """

    def __init__(self, cube, factor, bright, others, spectra, weights, made, response):
        shape = cube.shape[1:]
        self.weights, self.response, self.bright = weights, response, spectra[:SOURCES]
        self.points, self.steps, self.first = made.sampled
        self.middle = [n // 2 for n in made.bands[0].shape]
        some = np.stack(
            np.unravel_index(others[:: max(1, len(others) // NEIGHBOURHOODS)], shape), axis=-1
        )
        around = np.clip(some[:, None] + STEPS, 0, np.array(shape) - 1)
        around = np.ravel_multi_index((around[..., 0], around[..., 1]), shape)
        self.near = _spectra(cube, factor, around.ravel()).reshape(*around.shape, -1)
        self.counts = ~np.isin(around, bright)  # the light of bright tiles is corrected
        reach = [min(1, m) for m in self.middle]
        self.core = np.stack(
            [
                [
                    b[self.middle[0] - y * reach[0], self.middle[1] - x * reach[1]]
                    for b in made.bands
                ]
                for y, x in STEPS
            ]
        ).astype(float)
        self.near_light = self._from_neighbours(self.near)
        self.radii = bright_tiles.radii(spectra @ weights.sum(0))
        targets = some[:: max(1, len(some) // TARGETS)]
        away = targets[:, None] - np.stack(np.unravel_index(bright[:SOURCES], shape), axis=-1)
        away_by = np.abs(away).max(axis=-1)[..., None]
        self.kernels, self.beyond = self._kernels(away), away_by > NEAR
        self.missed_near = ~self.beyond & (
            away_by > self.radii[:SOURCES, None]
        )  # nearer ones are corrected
        self.far_light = (
            np.einsum("tsb,sb->tb", self.kernels, self.bright) @ weights.T
            + self.near_light[:: max(1, len(some) // TARGETS)]
        )
        y, x = (
            np.arange(n) * step + first - middle
            for n, step, first, middle in zip(
                self.points.shape, self.steps, self.first, self.middle
            )
        )
        self.points_near = (np.maximum(np.abs(y)[:, None], np.abs(x)) <= NEAR).ravel()
        self.single, self.beyond_near = (
            spectra[:: max(1, len(spectra) // SOURCES)],
            self._beyond(bright_tiles.RADII[0]),
        )
        self.single_light = self._from_single(self.single)

    def _beyond(self, radius):
        """Return sampled kernels (point, band), those nearest to the axis that lie beyond a radius
        in tiles.
        """
        y, x = (
            np.arange(n) * step + first - middle
            for n, step, first, middle in zip(
                self.points.shape, self.steps, self.first, self.middle
            )
        )
        away = np.hypot(y[:, None], x).ravel()
        order = np.argsort(
            np.where(away > min(radius, away.max() / 2), away, np.inf), kind="stable"
        )[:TARGETS]
        return self.points.reshape(-1, self.points.shape[2])[order]

    def around_tiles(self, near) -> float:
        """Return the largest error to be expected where light comes from a tile and its
        neighbours.
        """
        return WORST[0] * float(
            self._share(
                self._from_neighbours(near.missed(self.near) * self.counts[..., None]),
                self.near_light,
            ).max(initial=0.0)
        )

    def of_bright(self, near, far) -> float:
        """Return the largest error to be expected of light that comes from bright tiles, all
        together and single ones.
        """
        parts = (self.missed_near, near), (self.beyond, far)
        seen = sum(
            np.einsum("tsb,sb->tb", self.kernels * part, basis.missed(self.bright))
            for part, basis in parts
        )
        together = self._share(seen @ self.weights.T, self.far_light)
        single = self._share(self._from_single(far.missed(self.single)), self.single_light)
        return max(
            WORST[1] * float(together.max(initial=0.0)), WORST[2] * float(single.max(initial=0.0))
        )

    @property
    def looked_at(self) -> int:
        """How many values were looked at."""
        return self.near_light.size + self.far_light.size + self.single_light.size

    def _from_neighbours(self, spectra):
        """Return the (tile, channel) photocurrent that a tile and those around it make."""
        return np.einsum("nub,ub->nb", spectra, self.core) @ self.weights.T

    def _from_single(self, spectra):
        """Return the (source, point, channel) photocurrent that single bright tiles make at points
        around them.
        """
        return np.einsum(
            "sb,jb,pb->spj",
            spectra,
            self.weights,
            self.beyond_near,
            optimize=["einsum_path", (0, 1), (0, 1)],
        )

    def _share(self, error, light):
        scale = self.response.area_exposure_m2_s
        noise = np.sqrt(max(self.response.read_noise_e, 1.0) ** 2 + scale * np.abs(light))
        return scale * np.abs(error) / noise

    def _kernels(self, away):
        """Return the kernels (target, source, band) at the sampled points nearest to the ways
        (target, source, 2) in tiles.
        """
        index = [
            np.clip(
                np.rint((away[..., a] + self.middle[a] - self.first[a]) / self.steps[a]).astype(
                    int
                ),
                0,
                n - 1,
            )
            for a, n in enumerate(self.points.shape[:2])
        ]
        return self.points[index[0], index[1]]
