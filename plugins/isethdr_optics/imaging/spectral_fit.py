"""Spectral fit: the functionals of a scene's spectra that are convolved, chosen so that their error
stays below the sensor's noise. A functional is a weighted sum of the bands.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from isethdr_core.pipeline.demand import Response

    from ..psf.kernels import Kernels
    from .field_optics import FieldOptics

BRIGHT = 100.0  # light of a bright tile, at least, over the median of all tiles
MOST_BRIGHT = 16384  # largest number of bright tiles
LEAST_BRIGHT = 64  # least number of bright tiles
ROWS = 64  # number of rows that are summed in one block
SPECTRA = 2048  # number of spectra of bright tiles, and of other tiles, that are used for the fit
TARGETS = 64  # number of tiles at which the error of light from bright tiles is computed
SOURCES = 256  # number of the brightest tiles that send light to them
NEIGHBOURHOODS = 700  # number of tiles at which the error of light from adjacent tiles is computed
STEPS = np.stack(np.mgrid[-1:2, -1:2], axis=-1).reshape(-1, 2)
# largest error of all tiles over that of the sampled tiles: for light from adjacent tiles, from all
# bright tiles together, and from single bright tiles
WORST = (1.7, 3.5, 2.0)
TOLERATED = FUNCTIONALS  # share of the allowed error that functionals may use, at the worst tile
# share of the allowed error that the functionals of the near part may use for light from bright
# tiles. With more, no number of functionals of the far part would be enough.
NEAR_SHARE = 0.8
MOST = 12  # largest number of functionals; with more, imaging band by band is as fast


@dataclass(frozen=True, eq=False)
class Basis:
    """Functionals and the spectra they predict: spectrum ~ predict @ (project @ spectrum)."""

    project: np.ndarray  # (functional, band)
    predict: np.ndarray  # (band, functional)

    def missed(self, spectra: np.ndarray) -> np.ndarray:
        """Return the part of spectra (..., band) that is not predicted."""
        return spectra - spectra @ self.project.T @ self.predict.T


@dataclass(frozen=True, eq=False)
class Fit:
    """The functionals for the near and far part of the kernels, and the bright tiles to correct."""

    near: Basis
    far: Basis | None  # None: the kernels are not divided
    bright: np.ndarray  # (tile,) flat indices of bright tiles
    radii: np.ndarray  # (tile,) radius in tiles within which each bright tile is corrected
    noise_share: float  # largest error of the samples, standard deviations of the noise
    sample_count: int  # number of sampled values


def fit(
    cube: np.ndarray,
    optics: FieldOptics,
    weights: np.ndarray,
    response: Response,
    apply: Callable[..., Any] = map,
) -> Fit | None:
    """Return the fewest functionals that are accurate enough for a sensor; None if too many.

    Parameters
    ----------
    cube : (band, y, x) radiance.
    optics : `field_optics.FieldOptics` of its field.
    weights : (channel, band) photocurrent per radiance and kernel.
    response : `isethdr_core.demand.Response` of the sensor, for its noise.
    apply : `map`, or the `map` of a pool of threads.
    """
    total = np.abs(weights).sum(0)
    kernels = optics.kernels
    relative = optics.relative
    rate = (
        _rate(cube, total, apply)
        if optics.electron_map is None
        else optics.electron_map.total_e.ravel()
    )
    bright, others = _tiles(rate, cube.shape[1:])
    if not len(others):  # so few tiles that all count as bright: band by band is as fast
        return None
    factor = np.ones(rate.size) if relative is None else relative.ravel()
    spectra, other_spectra = (_spectra(cube, factor, i) for i in (bright, others))
    sampled_spectra = spectra[:: max(1, len(spectra) // SPECTRA)]
    moments = shot_noise_moments(
        sampled_spectra, sampled_spectra @ total, len(spectra) / len(sampled_spectra)
    ) + shot_noise_moments(other_spectra, other_spectra @ total, rate.size / len(other_spectra))
    scale = np.trace(moments)
    if not scale > 0:
        return None
    moments /= scale
    centre = np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in kernels.bands], float)
    # all light of a tile, and the light that stays in the tile, are predicted exactly
    exact_functionals = np.concatenate([weights, weights * centre])
    light = _Light(cube, factor, bright, others, spectra)
    samples = _ErrorSamples(light, weights, kernels, response)
    allowed = TOLERATED * response.noise_fraction_allowed

    def fewest(
        exact_functionals: np.ndarray, points: np.ndarray, noise_share_of: Callable[..., Any]
    ) -> tuple[Basis | None, float]:
        """Return the basis with the fewest functionals and an allowed error, and its error over the
        noise; (None, error) if there is none.

        Parameters
        ----------
        exact_functionals : (functional, band) functionals that the basis must contain.
        points : (point, band) samples of the kernels.
        noise_share_of : function(basis) -> error over the noise.
        """
        rows = directions(exact_functionals, moments, kernel_moments(points, weights))
        noise_share = np.inf
        for count in range(np.linalg.matrix_rank(exact_functionals), min(MOST, len(cube) // 2) + 1):
            basis = Basis(rows[:count], predictor(rows[:count], moments))
            noise_share = noise_share_of(basis)
            if noise_share < allowed:
                return basis, noise_share
        return None, noise_share

    points = kernels.sampled[0].reshape(-1, len(cube))
    if kernels.divided.far is None:
        near, share = fewest(
            exact_functionals,
            points,
            lambda basis: max(samples.around_tiles(basis), samples.of_bright(basis, basis)),
        )
        return near and Fit(near, None, bright, samples.radii, share, samples.sample_count)
    near, first = fewest(
        exact_functionals,
        samples.core.reshape(-1, len(cube)),
        lambda basis: max(samples.around_tiles(basis), samples.of_bright(basis, None) / NEAR_SHARE),
    )
    if near is None:
        return None
    kernel_points = np.concatenate([points[~samples.points_near], samples.beyond_near])
    far, share = fewest(weights, kernel_points, lambda basis: samples.of_bright(near, basis))
    return far and Fit(near, far, bright, samples.radii, max(first, share), samples.sample_count)


def _rate(cube: np.ndarray, total: np.ndarray, apply: Callable[..., Any]) -> np.ndarray:
    """Return the light of each tile, flat; `total` (band,) weights the bands."""
    rows = total[None].astype(cube.dtype)
    first = range(0, cube.shape[1], ROWS)
    return np.concatenate(
        list(apply(lambda start: matrix_product(rows, cube[:, start : start + ROWS])[0], first))
    ).ravel()


def _tiles(rate: np.ndarray, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return flat indices of the bright tiles, and of other tiles on a regular grid."""
    height, width = shape
    steps = [max(1, int(n // np.sqrt(SPECTRA * n / (height + width - n)))) for n in shape]
    rows, columns = (np.arange(s // 2, n, s) for s, n in zip(steps, shape))
    others = (rows[:, None] * width + columns).ravel()
    bright = np.flatnonzero(rate > BRIGHT * np.median(rate[others]))
    if len(bright) < LEAST_BRIGHT:
        bright = np.argpartition(rate, -min(LEAST_BRIGHT, rate.size))[-LEAST_BRIGHT:]
    bright = bright[np.argsort(-rate[bright], kind="stable")][:MOST_BRIGHT]
    return bright, np.setdiff1d(others, bright)


def _spectra(cube: np.ndarray, factor: np.ndarray, tiles: np.ndarray) -> np.ndarray:
    return np.stack([band.ravel()[tiles] for band in cube], axis=1) * factor[tiles, None]


@dataclass(frozen=True, eq=False)
class _Light:
    """The light of a scene, and its bright tiles."""

    cube: np.ndarray  # (band, y, x) radiance
    factor: np.ndarray  # (tile,) factor on the light of each tile of the cube
    bright: np.ndarray  # flat indices of the bright tiles, the brightest first
    others: np.ndarray  # flat indices of other tiles on a regular grid
    spectra: np.ndarray  # (tile, band) light of the bright tiles


class _ErrorSamples:
    """Errors of a fit at sampled tiles, in standard deviations of the sensor's noise.

    Light reaches the samples from adjacent tiles and from distant bright tiles.
    """

    def __init__(
        self, light: _Light, weights: np.ndarray, kernels: Kernels, response: Response
    ) -> None:
        cube = light.cube
        factor = light.factor
        bright = light.bright
        others = light.others
        spectra = light.spectra
        shape = cube.shape[1:]
        self.weights = weights
        self.response = response
        self.bright = spectra[:SOURCES]
        self.points, self.steps, self.first = kernels.sampled
        self.middle = [n // 2 for n in kernels.bands[0].shape]
        sampled_tiles = np.stack(
            np.unravel_index(others[:: max(1, len(others) // NEIGHBOURHOODS)], shape), axis=-1
        )
        neighbours = np.clip(sampled_tiles[:, None] + STEPS, 0, np.array(shape) - 1)
        neighbours = np.ravel_multi_index((neighbours[..., 0], neighbours[..., 1]), shape)
        self.near = _spectra(cube, factor, neighbours.ravel()).reshape(*neighbours.shape, -1)
        self.counts = ~np.isin(neighbours, bright)  # the light of bright tiles is corrected
        reach = [min(1, m) for m in self.middle]
        self.core = np.stack(
            [
                [
                    b[self.middle[0] - y * reach[0], self.middle[1] - x * reach[1]]
                    for b in kernels.bands
                ]
                for y, x in STEPS
            ]
        ).astype(float)
        self.near_light = self._from_neighbours(self.near)
        self.radii = bright_tiles.radii(spectra @ weights.sum(0))
        targets = sampled_tiles[:: max(1, len(sampled_tiles) // TARGETS)]
        offsets = targets[:, None] - np.stack(np.unravel_index(bright[:SOURCES], shape), axis=-1)
        distances = np.abs(offsets).max(axis=-1)[..., None]
        self.kernels = self._kernels(offsets)
        self.beyond = distances > NEAR
        # within their radii, bright tiles are corrected
        self.missed_near = ~self.beyond & (distances > self.radii[:SOURCES, None])
        self.far_light = (
            np.einsum("tsb,sb->tb", self.kernels, self.bright) @ weights.T
            + self.near_light[:: max(1, len(sampled_tiles) // TARGETS)]
        )
        y, x = (
            np.arange(n) * step + first - middle
            for n, step, first, middle in zip(
                self.points.shape, self.steps, self.first, self.middle
            )
        )
        self.points_near = (np.maximum(np.abs(y)[:, None], np.abs(x)) <= NEAR).ravel()
        self.single = spectra[:: max(1, len(spectra) // SOURCES)]
        self.beyond_near = self._beyond(bright_tiles.RADII[0])
        self.single_light = self._from_single(self.single)

    def _beyond(self, radius: int) -> np.ndarray:
        """Return the kernels (point, band) at the `TARGETS` sampled points nearest beyond `radius`
        tiles.
        """
        y, x = (
            np.arange(n) * step + first - middle
            for n, step, first, middle in zip(
                self.points.shape, self.steps, self.first, self.middle
            )
        )
        distances = np.hypot(y[:, None], x).ravel()
        order = np.argsort(
            np.where(distances > min(radius, distances.max() / 2), distances, np.inf), kind="stable"
        )[:TARGETS]
        return self.points.reshape(-1, self.points.shape[2])[order]

    def around_tiles(self, near: Basis) -> float:
        """Return the largest expected error of light from a tile and its neighbours, over the
        noise.
        """
        return WORST[0] * float(
            self._share(
                self._from_neighbours(near.missed(self.near) * self.counts[..., None]),
                self.near_light,
            ).max(initial=0.0)
        )

    def of_bright(self, near: Basis, far: Basis | None) -> float:
        """Return the largest expected error of light from bright tiles, together and single, over
        the noise.

        Parameters
        ----------
        near, far : functionals of the two parts of the kernels; far None: no error from there.
        """
        missed_light = self._missed(self.missed_near, near)
        if far is not None:
            missed_light = missed_light + self._missed(self.beyond, far)
        of_all_bright = self._share(missed_light @ self.weights.T, self.far_light)
        largest = WORST[1] * float(of_all_bright.max(initial=0.0))
        if far is None:
            return largest
        single = self._share(self._from_single(far.missed(self.single)), self.single_light)
        return max(largest, WORST[2] * float(single.max(initial=0.0)))

    def _missed(self, part: np.ndarray, basis: Basis) -> np.ndarray:
        """Return the light (target, band) from bright tiles that a part of the kernels misses.

        Parameters
        ----------
        part : (target, source, 1) whether a source sends its light through this part.
        basis : functionals of the part.
        """
        return np.einsum("tsb,sb->tb", self.kernels * part, basis.missed(self.bright))

    @property
    def sample_count(self) -> int:
        """Number of sampled values."""
        return self.near_light.size + self.far_light.size + self.single_light.size

    def _from_neighbours(self, spectra: np.ndarray) -> np.ndarray:
        """Return the photocurrent (tile, channel) of light from each tile and its neighbours."""
        return np.einsum("nub,ub->nb", spectra, self.core) @ self.weights.T

    def _from_single(self, spectra: np.ndarray) -> np.ndarray:
        """Return the photocurrent (source, point, channel) around single bright tiles."""
        return np.einsum(
            "sb,jb,pb->spj",
            spectra,
            self.weights,
            self.beyond_near,
            optimize=["einsum_path", (0, 1), (0, 1)],
        )

    def _share(self, error: np.ndarray, light: np.ndarray) -> np.ndarray:
        scale = self.response.area_exposure_m2_s
        noise = np.sqrt(max(self.response.read_noise_e, 1.0) ** 2 + scale * np.abs(light))
        return scale * np.abs(error) / noise

    def _kernels(self, offsets: np.ndarray) -> np.ndarray:
        """Return kernels (target, source, band) at the sampled points nearest to `offsets`,
        (target, source, 2) in tiles.
        """
        index = [
            np.clip(
                np.rint((offsets[..., a] + self.middle[a] - self.first[a]) / self.steps[a]).astype(
                    int
                ),
                0,
                n - 1,
            )
            for a, n in enumerate(self.points.shape[:2])
        ]
        return self.points[index[0], index[1]]
