"""Spread errors: the effect of kernel errors on the light of each tile of a scene, and kernels that
are accurate enough for a sensor.

Errors of different tiles of a kernel are independent except for neighbours
(`kernel_sampling_error.deviation`). Errors of different bands are independent too. The error of a
tile's light is therefore the root of the sum of (L k d)^2 over all tiles and bands that send light
to it, with their light L, the kernel k and its relative error d. The error from the period of the
computed pattern can have the same sign everywhere, and is summed linearly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.physics.convolution import Kernel, prepare, transform
from isethdr_core.uncertainty.propagation import within

from ..psf import kernel_sampling_error, kernels
from ..psf.exact_core import core_error, kept_cores
from ..psf.scaled_pattern import CoreSize
from ..psf.wings import tile_sums
from .accuracy_shares import KERNELS
from .photoelectron_map import PhotoelectronMap, block_of, map_photoelectrons, sums

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Response

    from ..abilities import LensOptics
    from ..psf.kernels import Kernels
    from .field_optics import FieldOptics

# factors on the error that the lens states, tried for finer kernels; smaller factors need too much
# memory and gain little
FINER_FACTORS = (0.5, 0.25)
# largest share of the allowed error for the rings beyond a wider exact core
CORE_SHARE = 0.8
# share of the allowed error that is aimed at with fine rings. Next to lamps that need fine rings,
# functionals of the spectrum need most of the lens's error: 0.06 of the noise.
FINE_AIM = 0.5
# error of fine rings (`scaled_pattern.FINE`) over that of usual rings: measured 0.02 to 0.13
FINE_RINGS_LEAVE = 0.1
# measured error of kernels that are computed for half the error, over that before
ERROR_LEFT_BY_HALVING = 0.35
# stated error over true error, measured 1.5 to 3.7 (docs/explanation/budget.md): kernels with a
# stated error above the limit by this factor may still be accurate enough
STATED_OVER_TRUE = 2.0


def spread_errors(
    mixed: xr.DataArray, optics: FieldOptics, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (deviation, bound) of the light on the sensor's tiles; None if the kernels vary over
    the field or the lens has lateral colour.

    Both are arrays (channel, y, x), in the unit of `weights` times irradiance.

    Parameters
    ----------
    mixed : mixed radiance (wavelength, y, x).
    optics : `field_optics.FieldOptics` of its field.
    weights : (channel, band) factors on irradiance, for example electrons per m2 and second.

    Notes
    -----
    The errors of all bands are taken to be those of the worst band, scaled, because kernels of
    neighbouring wavelengths have similar wings.
    """
    kernels_of_field = optics.kernels
    ny, nx = mixed.shape[1:]
    if optics.field is not None or optics.sensor.scales is not None:
        return None
    if are_exact(kernels_of_field):
        nothing = optics.sensor.move(np.zeros((len(weights), ny, nx), np.float32))
        return nothing, nothing
    block = block_of((ny, nx))
    factor = 1.0
    if optics.relative is not None:  # mean over a block; the frame's border cuts the last blocks
        factor = sums(optics.relative, block) / sums(np.ones((ny, nx)), block)
    error_kernels = _error_kernels(kernels_of_field, block, (ny, nx))
    gains = np.asarray(weights) * optics.gains
    sums_of_squares = (
        np.tensordot((gains * error_kernels.bands) ** 2, sums(mixed.values, block, 2), 1)
        * factor**2
    )
    sums_of_light = np.tensordot(gains, sums(mixed.values, block), 1) * factor
    out = (
        np.sqrt([_convolved_with_bound(c, error_kernels.variance) for c in sums_of_squares]),
        np.array([_convolved_with_bound(c, error_kernels.wrapped) for c in sums_of_light]),
    )
    return tuple(optics.sensor.move(_tiles(a, block, (ny, nx))) for a in out)


def are_exact(kernels_of_field: Kernels | None) -> bool:
    """Return whether kernels have only rounding errors."""
    return (
        kernels_of_field is None
        or kernels_of_field.deviation is None
        or not (kernels_of_field.deviation.any() or kernels_of_field.core_deviation)
    )


def fine_enough(
    make_kernels: Callable[..., Any],
    lens: LensOptics,
    mixed: xr.DataArray,
    relative: float | np.ndarray,
    response: Response | None,
    can_be_finer: Callable[[float], bool] = lambda factor: True,
) -> tuple[Kernels | None, float, PhotoelectronMap | None]:
    """Return (kernels, their `noise_share`, photoelectron map).

    The errors of the kernels are below the sensor's noise in this scene, as far as this can be
    reached. The map is None if it was not needed.

    Parameters
    ----------
    make_kernels : function(lens) -> `kernels.Kernels`.
    lens : lens with `speckle_error`, the largest allowed error of kernels.
    mixed : mixed radiance (wavelength, y, x).
    relative : relative illumination of the tiles, (y, x) or 1.
    response : `isethdr_core.demand.Response` of the sensors; None: the error that the lens states
        is enough.
    can_be_finer : function(factor), which tells whether kernels that are not from one pattern would
        be more accurate with that factor on the allowed error.
    """
    if response is None:
        return make_kernels(lens), 0.0, None
    with kept_cores():
        best = make_kernels(lens)
        if are_exact(best):
            return best, 0.0, None
        electron_map = map_photoelectrons(lens, mixed, relative, response)
        allowed = KERNELS * response.noise_fraction_allowed
        share = noise_share(best, electron_map, response)
        if share <= allowed:
            return best, share, electron_map
        if best.scaled is not None:
            sizes = kernels.wider_cores(best)
            finer = _finer_rings(best, share, electron_map, response, sizes)
            if finer is not None:
                finer_kernels = make_kernels(
                    replace(lens, speckle_error=finer * lens.speckle_error)
                )
                finer_share = noise_share(finer_kernels, electron_map, response)
                if finer_share <= allowed:
                    return finer_kernels, finer_share, electron_map
            best, share = _with_wider_core(best, electron_map, response, allowed, sizes)
            return best, share, electron_map
        for finer in (
            FINER_FACTORS if ERROR_LEFT_BY_HALVING * share <= allowed else FINER_FACTORS[1:]
        ):
            # stop if the kernels are accurate enough, or if even the finest would not be
            if share <= allowed or ERROR_LEFT_BY_HALVING**2 * share > STATED_OVER_TRUE * allowed:
                break
            if not can_be_finer(finer):
                continue
            finer_kernels = make_kernels(replace(lens, speckle_error=finer * lens.speckle_error))
            if finer_kernels.speckle.max() < best.speckle.max():
                best = finer_kernels
                share = noise_share(finer_kernels, electron_map, response)
    return best, share, electron_map


def _finer_rings(
    kernels_of_field: Kernels,
    share: float,
    electron_map: PhotoelectronMap,
    response: Response,
    sizes: Sequence[CoreSize],
) -> float | None:
    """Return the factor on the allowed error with which the rings of the whole frame are accurate
    enough. Return None if there are no rings, if a wider exact core takes less time, or if no
    factor is expected to be enough.

    Computing all rings again takes about as long as the first kernels did. An exact core takes less
    time only if it is small: with tiles of 10 um, a core of 50 tiles takes six times as long.

    Parameters
    ----------
    kernels_of_field : kernels from one pattern.
    share : `noise_share` of these kernels.
    electron_map : photoelectron map of the scene, for that sensor.
    response : `isethdr_core.demand.Response` of the sensor.
    sizes : possible sizes of a wider exact core.
    """
    if not kernels_of_field.deviation.any():
        return None
    aim = CORE_SHARE * KERNELS * response.noise_fraction_allowed
    quick = [size for size in sizes if size.quick]
    shares = _shares_beyond_cores(kernels_of_field, electron_map, response, quick)
    if any(left <= aim for left in shares):
        return None
    return next((factor for factor in FINER_FACTORS if factor * share <= aim), None)


def _with_wider_core(
    kernels_of_field: Kernels,
    electron_map: PhotoelectronMap,
    response: Response,
    allowed: float,
    sizes: Sequence[CoreSize],
) -> tuple[Kernels, float]:
    """Return kernels from one pattern with the smallest exact core that is accurate enough, and
    their `noise_share`.

    If no core is enough by itself, it gets fine rings. If these are not enough either, they are
    left out, and the core is the widest that takes no more time than the kernels did. Next to a
    lamp, the innermost rings have the largest errors, so that a wider core costs less than finer
    rings in the whole frame. The errors of fine rings are known only after they were computed. If
    they are larger than expected, the core is widened again.

    Parameters
    ----------
    kernels_of_field : kernels from one pattern.
    electron_map : photoelectron map of the scene, for that sensor.
    response : `isethdr_core.demand.Response` of the sensor.
    allowed : allowed `noise_share`.
    sizes : possible sizes of a wider exact core.
    """
    found = _with_expected_core(kernels_of_field, electron_map, response, allowed, sizes)
    share = noise_share(found, electron_map, response)
    aim = FINE_AIM * allowed
    if share <= aim or found.wide is None or not found.fine_rings:
        return found, share
    wider = [size for size in sizes if size.tiles > found.wide.tiles]
    shares = _shares_beyond_cores(found, electron_map, response, wider)
    enough = [size for size, left in zip(wider, shares) if left <= CORE_SHARE * aim]
    if wider:
        found = kernels.with_core(found, (enough or wider[-1:])[0].tiles)
        share = noise_share(found, electron_map, response)
    return found, share


def _with_expected_core(
    kernels_of_field: Kernels,
    electron_map: PhotoelectronMap,
    response: Response,
    allowed: float,
    sizes: Sequence[CoreSize],
) -> Kernels:
    """Return kernels with the size of the core that follows from the errors of usual rings;
    arguments as in `_with_wider_core`.
    """
    shares = _shares_beyond_cores(kernels_of_field, electron_map, response, sizes)
    for size, share in zip(sizes, shares):
        if share <= CORE_SHARE * allowed:
            return kernels.with_core(kernels_of_field, size.tiles)
    if kernels.fine_rings_fit(kernels_of_field):
        for size, share in zip(sizes, shares):
            if FINE_RINGS_LEAVE * share <= CORE_SHARE * FINE_AIM * allowed:
                return kernels.with_core(kernels_of_field, size.tiles, fine_rings=True)
        if sizes and FINE_RINGS_LEAVE * shares[-1] <= STATED_OVER_TRUE * allowed:
            return kernels.with_core(kernels_of_field, sizes[-1].tiles, fine_rings=True)
    quick = [size.tiles for size in sizes if size.quick]
    return kernels.with_core(kernels_of_field, quick[-1]) if quick else kernels_of_field


def _shares_beyond_cores(
    kernels_of_field: Kernels,
    electron_map: PhotoelectronMap,
    response: Response,
    sizes: Sequence[CoreSize],
) -> list[float]:
    """Return, for each size of the core, the error of the rings beyond it over the noise."""
    if not sizes:
        return []
    error_kernels = _error_kernels(kernels_of_field, electron_map.block, electron_map.frame)
    noise = _noise(electron_map, response, error_kernels)
    variances = _beyond_cores(kernels_of_field, electron_map, [size.tiles for size in sizes])
    return [
        _share_of_noise(electron_map, error_kernels._replace(variance=one), noise)
        for one in variances
    ]


def noise_share(
    kernels_of_field: Kernels, electron_map: PhotoelectronMap, response: Response
) -> float:
    """Return the 99th percentile of the tiles' errors over the noise of the sensor's charge.

    The noise of a tile is computed from a lower bound on its light.

    Parameters
    ----------
    kernels_of_field : `kernels.Kernels` of the axis.
    electron_map : photoelectron map of the scene, for that sensor.
    response : `isethdr_core.demand.Response` of the sensor.
    """
    error_kernels = _error_kernels(kernels_of_field, electron_map.block, electron_map.frame)
    return _share_of_noise(
        electron_map, error_kernels, _noise(electron_map, response, error_kernels)
    )


class _Noise(NamedTuple):
    """Noise of the blocks of one channel that are not saturated."""

    lit: np.ndarray  # (y, x) mask of blocks that are not saturated
    noise_e: np.ndarray  # (block,) a lower bound
    bound: np.ndarray  # (block,) error from the period of the computed pattern, over the noise


def _noise(
    electron_map: PhotoelectronMap, response: Response, error_kernels: _ErrorKernels
) -> list[_Noise]:
    """Return the noise of each row of the map."""
    found = []
    for total, least in zip(electron_map.sums, electron_map.least):
        bound = _convolved_with_bound(total, error_kernels.wrapped)
        # a lower bound on the light, because `light` leaves out the kernel near its axis
        least = least + _convolved(total, error_kernels.light)
        lit = least < response.full_scale_e
        noise_e = np.sqrt(max(response.read_noise_e, 1.0) ** 2 + least)[lit]
        found.append(_Noise(lit, noise_e, bound[lit] / noise_e))
    return found


def _share_of_noise(
    electron_map: PhotoelectronMap, error_kernels: _ErrorKernels, noise: Sequence[_Noise]
) -> float:
    """Return the 99th percentile of the blocks' errors over their noise, the largest of all rows.

    Parameters
    ----------
    electron_map : photoelectron map of the scene.
    error_kernels : kernels of the errors.
    noise : noise of each row of the map.
    """
    shares = [0.0]
    for row, row_noise in zip(electron_map.weights, noise):
        if not row_noise.lit.any():
            continue
        deviation = _convolved_with_bound(
            np.tensordot((row * error_kernels.bands) ** 2, electron_map.squares, 1),
            error_kernels.variance,
        )
        deviation_share = np.sqrt(deviation[row_noise.lit]) / row_noise.noise_e
        shares.append(within(row_noise.bound, deviation_share))
    return max(shares)


class _ErrorKernels(NamedTuple):
    """Kernels between blocks of tiles, for the errors and for the light."""

    bands: np.ndarray  # (band,) error of every band over that of the worst band
    variance: Kernel  # variance of the error of the worst band
    wrapped: Kernel  # bound on the error from the period of the computed pattern
    light: Kernel  # light of the worst band, without the part near the axis


def _error_kernels(kernels_of_field: Kernels, block: int, frame: tuple[int, int]) -> _ErrorKernels:
    """Return the error kernels between blocks of a frame."""

    def make() -> _ErrorKernels:
        worst, bands = _worst(kernels_of_field)
        kernel = np.asarray(kernels_of_field.bands[worst], np.float32)
        variance = _squares(kernels_of_field, kernel, worst)
        y, x = (np.arange(n) - n // 2 for n in kernel.shape)
        light = np.where(variance > 0, kernel, np.float32(0.0))
        if kernels_of_field.core_deviation and kernels_of_field.wide is None:
            tiles = np.maximum(np.abs(y)[:, None], np.abs(x))
            light[tiles <= kernels_of_field.core[worst]] = 0.0
        border = [max(n // 2, 1) for n in kernel.shape]
        wrapped = light * np.maximum((y[:, None] / border[0]) ** 2, (x / border[1]) ** 2).astype(
            np.float32
        )
        wrapped *= np.float32(kernels_of_field.wrap)
        if kernels_of_field.wide is not None:  # a wider core does not come from the rings' pattern
            tiles = np.maximum(np.abs(y)[:, None], np.abs(x))
            wrapped[tiles <= kernels_of_field.wide.tiles] = 0.0
        parts = (_in_blocks(part, block, frame) for part in (variance, wrapped, light))
        return _ErrorKernels(bands, *parts)

    return kernels_of_field.kept(("errors", block, frame), make)


def _beyond_cores(
    kernels_of_field: Kernels, electron_map: PhotoelectronMap, sizes: Sequence[int]
) -> list[Kernel]:
    """Return the variances of the errors beyond an exact core of each of `sizes` tiles, in rising
    order.
    """

    def make() -> list[Kernel]:
        worst, _ = _worst(kernels_of_field)
        variance = _squares(
            kernels_of_field, np.asarray(kernels_of_field.bands[worst], np.float32), worst
        )
        found = []
        for tiles in sizes:
            middle = [n // 2 for n in variance.shape]
            variance[tuple(slice(max(m - tiles, 0), m + tiles + 1) for m in middle)] = 0.0
            found.append(_in_blocks(variance, electron_map.block, electron_map.frame))
        return found

    key = "beyond cores", electron_map.block, electron_map.frame, tuple(sizes)
    return kernels_of_field.kept(key, make)


def _worst(kernels_of_field: Kernels) -> tuple[int, np.ndarray]:
    """Return the index of the band with the largest errors, and the error of every band relative to
    it.
    """
    return kernels_of_field.kept("worst band", lambda: _compared_bands(kernels_of_field))


def _compared_bands(kernels_of_field: Kernels) -> tuple[int, np.ndarray]:
    """Compute the result of `_worst`."""
    points, steps, first = kernels_of_field.sampled
    offsets = [np.arange(n) - n // 2 for n in kernels_of_field.bands[0].shape]
    y, x = (a[f::s] for a, f, s in zip(offsets, first, steps))
    share = np.array(
        [
            (points[..., band] * _deviation(kernels_of_field, band, y, x)).sum()
            for band in range(points.shape[-1])
        ]
    )
    worst = int(share.argmax())
    if not share[worst] > 0:  # no band has an error
        return worst, np.ones(len(share))
    return worst, share / share[worst]


def _deviation(kernels_of_field: Kernels, band: int, y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the relative error (y, x) of a band's kernel at the offsets `y` and `x` in tiles."""
    octave = kernel_sampling_error.octave_of(y[:, None], x)
    tiles = np.maximum(np.abs(y)[:, None], np.abs(x))
    out = kernels_of_field.deviation[band].astype(np.float32)[octave]
    core = kernels_of_field.core[band]
    inside = tiles <= core
    distance = np.hypot(y[:, None], x, dtype=np.float32)
    out[inside] = core_error(kernels_of_field.core_deviation, distance[inside], core)
    if kernels_of_field.wide is not None:
        inside = tiles <= kernels_of_field.wide.tiles
        out[inside] = kernels_of_field.wide.deviation.astype(np.float32)[octave[inside]]
    return out


def _squares(kernels_of_field: Kernels, kernel: np.ndarray, band: int) -> np.ndarray:
    """Return the squares (y, x) of the errors of a band's kernel."""
    y, x = (np.arange(n) - n // 2 for n in kernel.shape)
    out = _deviation(kernels_of_field, band, y, x)
    out *= kernel
    return np.square(out, out=out)


def _in_blocks(part: np.ndarray, block: int, frame: tuple[int, int]) -> Kernel:
    """Return a kernel of tiles as a kernel of blocks, prepared for images of the frame."""
    blocks = [-(-n // block) for n in frame]  # blocks of the frame; kernels may be smaller
    return prepare(tile_sums(_padded(part, block), block).astype(float) / block**2, blocks)


def _convolved(light: np.ndarray, kernel: Kernel) -> np.ndarray:
    """Return the convolution of light (y, x), with negative values set to 0."""
    if not kernel.spectrum.size:  # the kernel is 0 everywhere
        return np.zeros(light.shape)
    out, _ = transform.convolved(light, kernel.spectrum, kernel.size)
    return np.maximum(out * kernel.peak, 0.0)


def _convolved_with_bound(light: np.ndarray, kernel: Kernel) -> np.ndarray:
    """Return an upper bound on the convolution of light (y, x); it includes a bound on rounding.

    Rounding errors are about 1e-16 of the lamps' light in every tile, far below the noise, so that
    direct sums are not needed.
    """
    if not kernel.spectrum.size:  # the kernel is 0 everywhere
        return np.zeros(light.shape)
    out, norm = transform.convolved(light, kernel.spectrum, kernel.size)
    rounding = transform.error(norm * kernel.norm, float(np.linalg.norm(out)), kernel.size)
    return (np.maximum(out, 0.0) + rounding) * kernel.peak


def _padded(kernel: np.ndarray, block: int) -> np.ndarray:
    """Return a kernel padded with zeros to whole blocks."""
    padding = [-(-(n // 2) // block) * block + block - 1 - n // 2 for n in kernel.shape]
    return np.pad(kernel, [(m, m) for m in padding])


def _tiles(blocks: np.ndarray, block: int, shape: tuple[int, int]) -> np.ndarray:
    return (
        blocks.repeat(block, axis=1)
        .repeat(block, axis=2)[:, : shape[0], : shape[1]]
        .astype(np.float32)
    )
