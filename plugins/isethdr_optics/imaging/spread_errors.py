"""Spread errors: what the errors of kernels do to the light of one scene, tile by tile; and kernels
as right as a sensor needs.

Errors of different tiles of a kernel are independent except for neighbours
(`kernel_sampling_error.deviation`), and so are those of different bands. The error of a tile's
light is therefore the root of the sum of (L k d)^2 over the tiles and bands that it comes from.
What the period of the far
field adds may have one sign: its share of L k adds up as it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from isethdr_core.physics.convolution import Kernel, prepare, transform
from isethdr_core.uncertainty.propagation import within

from ..psf import kernel_sampling_error, kernels
from ..psf.exact_core import kept_cores
from ..psf.wings import tile_sums
from .accuracy_shares import KERNELS
from .photoelectron_map import Counted, block_of, counted, sums

FINER = (
    0.5,
    0.25,
)  # of the lens's own error: still finer lattices outgrow memory, and little is won
# of what is allowed, so much at most comes from outside of a wider exact core: the rest is its own
CORE_LEAVES = 0.8
# of the errors of rings, what fine ones leave (`scaled_pattern.FINE`): measured 0.02 to 0.13
FINE_LEAVES = 0.1
HALVED = 0.35  # what is left of the errors of kernels that are asked for half the error, measured
# over what is found, 1.5 to 3.7 (docs/explanation/budget.md): kernels that are stated to be so
# much too coarse may well be fine enough
STATED = 2.0


def spread_errors(mixed, given, weights) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (deviation, bound) of the light that kernels bring, each (channel, y, x), on the
    sensor's tiles; None where it is not known.

    Parameters
    ----------
    mixed : mixed radiance. `given` : `field_optics.FieldOptics` of its field.
    weights : (channel, band) what is counted of irradiance, electrons per m2 and second for
        example.

    Notes
    -----
    All bands have the shape of the worst one's errors, scaled: kernels of neighbouring wavelengths
    fall alike.
    """
    made, (ny, nx) = given.made, mixed.shape[1:]
    if given.field is not None or given.sensor.scales is not None:
        return None
    if exact(made):
        nothing = given.sensor.move(np.zeros((len(weights), ny, nx), np.float32))
        return nothing, nothing
    block = block_of((ny, nx))
    factor = 1.0 if given.relative is None else sums(given.relative, block) / block**2
    known = _kernels(made, block, (ny, nx))
    gains = np.asarray(weights) * given.gains
    squares = np.tensordot((gains * known.bands) ** 2, sums(mixed.values, block, 2), 1) * factor**2
    once = np.tensordot(gains, sums(mixed.values, block), 1) * factor
    out = (
        np.sqrt([_spread(c, known.variance) for c in squares]),
        np.array([_spread(c, known.wrapped) for c in once]),
    )
    return tuple(given.sensor.move(_tiles(a, block, (ny, nx))) for a in out)


def exact(made) -> bool:
    """Return whether kernels are right but for rounding."""
    return made is None or made.deviation is None or not made.deviation.any()


def fine_enough(make, lens, mixed, relative, response):
    """Return kernels whose errors a sensor cannot tell in this scene, or the lens's own where that
    is out of reach, and their `noise_share`; and what the sensor counts of the scene, None where
    nobody had to look.

    Parameters
    ----------
    make : function(lens) -> `kernels.Kernels`. `lens` : with `speckle_error`, the largest error
        that kernels may have.
    relative : factor of the tiles' light, (y, x) or 1. `response` : of the sensors, or None: the
        lens's own error is enough.
    """
    if response is None:
        return make(lens), 0.0, None
    with kept_cores():
        made = make(lens)
        if exact(made):
            return made, 0.0, None
        seen = counted(lens, mixed, relative, response)
        allowed = KERNELS * response.noise_fraction_allowed
        share = noise_share(made, seen, response)
        if share <= allowed:
            return made, share, seen
        if made.scaled is not None:
            made = _with_wider_core(made, seen, response, allowed)
            return made, noise_share(made, seen, response), seen
        for finer in FINER if HALVED * share <= allowed else FINER[1:]:
            if (
                share <= allowed or HALVED**2 * share > STATED * allowed
            ):  # the finest would cost several times as much, and still not be enough
                break
            other = make(replace(lens, speckle_error=finer * lens.speckle_error))
            if other.speckle.max() < made.speckle.max():
                made, share = other, noise_share(other, seen, response)
    return made, share, seen


def _with_wider_core(made, seen: Counted, response, allowed: float):
    """Return kernels from one pattern with the smallest exact core that is enough, with fine rings
    beyond it where no core is enough by itself.

    Where fine rings would miss what is allowed too, they are not made, and the core takes no longer
    than the kernels did. Beside a lamp the nearest rings err most: a wider core costs less than
    finer rings all over the frame.
    """
    sizes = kernels.wider_cores(made)
    # of the rings outside of each
    left = _beyond_cores(made, seen, [size.tiles for size in sizes])
    shares = [_noise_share(seen, response, one) for one in left]
    ways = ((False, 1.0), (True, FINE_LEAVES)) if kernels.fine_rings_fit(made) else ((False, 1.0),)
    for fine_rings, leaves in ways:
        for size, share in zip(sizes, shares):
            if leaves * share <= CORE_LEAVES * allowed:
                return kernels.with_core(made, size.tiles, fine_rings)
        if fine_rings and sizes and leaves * shares[-1] <= STATED * allowed:
            return kernels.with_core(made, sizes[-1].tiles, fine_rings)
    quick = [size.tiles for size in sizes if size.quick]
    return kernels.with_core(made, quick[-1]) if quick else made


def noise_share(made, seen: Counted, response) -> float:
    """Return what 99 % of the tiles' errors are at most, over the noise of the sensor's charge; no
    tile is taken for brighter than it is.
    """
    return _noise_share(seen, response, _kernels(made, seen.block, seen.frame))


def _noise_share(seen: Counted, response, given: _ErrorKernels) -> float:
    found = [0.0]
    for row, whole, least in zip(seen.weights, seen.sums, seen.least):
        deviation, bound = (
            _spread(np.tensordot((row * given.bands) ** 2, seen.squares, 1), given.variance),
            _spread(whole, given.wrapped),
        )
        least = least + _light(whole, given.light)  # what comes from near is left out
        noise, lit = (
            np.sqrt(max(response.read_noise_e, 1.0) ** 2 + least),
            least < response.full_scale_e,
        )
        if lit.any():
            found.append(within((bound / noise)[lit], (np.sqrt(deviation) / noise)[lit]))
    return max(found)


class _ErrorKernels(NamedTuple):
    """What kernels are wrong by, from block to block of tiles."""

    bands: np.ndarray  # error of every band over the worst one's
    variance: Kernel  # of the worst band's light
    wrapped: Kernel  # bound on what the period of the far field adds
    light: Kernel  # that the worst band brings


def _kernels(made, block, frame) -> _ErrorKernels:
    """Return what kernels are wrong by; of frozen kernels: made once."""
    known = made.__dict__.setdefault("_error_kernels", {})
    if (block, frame) not in known:
        worst, bands = _worst(made)
        kernel = np.asarray(made.bands[worst], np.float32)
        variance = _squares(made, kernel, worst)
        light = np.where(variance > 0, kernel, np.float32(0.0))
        y, x = ((np.arange(n) - n // 2) / max(n // 2, 1) for n in kernel.shape)
        wrapped = light * np.maximum(y[:, None] ** 2, x**2).astype(np.float32)
        wrapped *= np.float32(made.wrap)
        parts = (_in_blocks(part, block, frame) for part in (variance, wrapped, light))
        known[block, frame] = _ErrorKernels(bands, *parts)
    return known[block, frame]


def _beyond_cores(made, seen: Counted, sizes) -> Iterator[_ErrorKernels]:
    """Yield what kernels would be wrong by if exact within so many tiles; `sizes` rise."""
    known, (worst, _) = _kernels(made, seen.block, seen.frame), _worst(made)
    variance = _squares(made, np.asarray(made.bands[worst], np.float32), worst)
    for tiles in sizes:
        middle = [n // 2 for n in variance.shape]
        variance[tuple(slice(max(m - tiles, 0), m + tiles + 1) for m in middle)] = 0.0
        yield known._replace(variance=_in_blocks(variance, seen.block, seen.frame))


def _worst(made) -> tuple[int, np.ndarray]:
    """Return the band whose errors are largest, and the error of every band over its own."""
    points, steps, first = made.sampled
    away = [np.arange(n) - n // 2 for n in made.bands[0].shape]
    y, x = (a[f::s] for a, f, s in zip(away, first, steps))
    share = np.array(
        [
            (points[..., band] * _deviation(made, band, y, x)).sum()
            for band in range(points.shape[-1])
        ]
    )
    worst = int(share.argmax())
    if not share[worst] > 0:  # nothing is wrong in any band
        return worst, np.ones(len(share))
    return worst, share / share[worst]


def _deviation(made, band, y, x) -> np.ndarray:
    """Return the relative error of a band's kernel at tiles `y` from the axis, and `x`."""
    octave = kernel_sampling_error.octave_of(y[:, None], x)
    tiles = np.maximum(np.abs(y)[:, None], np.abs(x))
    out = made.deviation[band].astype(np.float32)[octave]
    out[tiles <= made.core[band]] = 0.0
    if made.wide is not None:
        inside = tiles <= made.wide.tiles
        out[inside] = made.wide.deviation.astype(np.float32)[octave[inside]]
    return out


def _squares(made, kernel, band) -> np.ndarray:
    """Return the squares of a band's errors."""
    y, x = (np.arange(n) - n // 2 for n in kernel.shape)
    out = _deviation(made, band, y, x)
    out *= kernel
    return np.square(out, out=out)


def _in_blocks(part, block, frame) -> Kernel:
    """Return a kernel of tiles as one of blocks, ready for images of the frame."""
    blocks = [-(-n // block) for n in frame]  # kernels may end before the frame does
    return prepare(tile_sums(_padded(part, block), block).astype(float) / block**2, blocks)


def _light(light, kernel) -> np.ndarray:
    """Return the convolution of light (y, x) where it is above 0, 0 elsewhere."""
    if not kernel.spectrum.size:  # nothing is spread anywhere
        return np.zeros(light.shape)
    out, _ = transform.plain(light, kernel.spectrum, kernel.size)
    return np.maximum(out * kernel.peak, 0.0)


def _spread(light, kernel):
    """Return the convolution of light (y, x) not below 0, or a little more than it: the bound on a
    transform's rounding is added.

    Rounding is some 1e-16 of the lamps' light everywhere: far less than the noise of any tile, and
    no tile need be summed directly.
    """
    if not kernel.spectrum.size:  # nothing is wrong anywhere
        return np.zeros(light.shape)
    out, norm = transform.plain(light, kernel.spectrum, kernel.size)
    rounding = transform.error(norm * kernel.norm, float(np.linalg.norm(out)), kernel.size)
    return (np.maximum(out, 0.0) + rounding) * kernel.peak


def _padded(kernel, block):
    """Return a kernel with as many zeros around it as whole blocks take."""
    more = [-(-(n // 2) // block) * block + block - 1 - n // 2 for n in kernel.shape]
    return np.pad(kernel, [(m, m) for m in more])


def _tiles(blocks, block, shape):
    return (
        blocks.repeat(block, axis=1)
        .repeat(block, axis=2)[:, : shape[0], : shape[1]]
        .astype(np.float32)
    )
