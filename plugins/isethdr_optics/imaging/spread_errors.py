"""Spread errors: what the errors of kernels do to the light of one scene, tile by tile; and kernels
as right as a sensor needs.

Errors of different tiles of a kernel are independent but for neighbours
(`kernel_errors.deviation`), and so are those of different bands, so a tile's light is off by the
root of the sum of (L k d)^2 over the tiles and bands that it comes from. What the period of the far
field adds may have one sign: its share of L k adds up as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from isethdr_core.physics.convolution import prepare, transform
from isethdr_core.uncertainty.propagation import within

from ..psf import kernel_sampling_error
from ..psf.exact_core import kept_cores
from ..psf.wings import tile_sums
from .accuracy_shares import KERNELS
from .photoelectron_map import Counted, block_of, counted, sums

FINER = (
    0.5,
    0.25,
)  # of the lens's own error: still finer lattices outgrow memory, and little is won
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
    share, variance, wrapped, _ = _kernels(made, block, (ny, nx))
    gains = np.asarray(weights) * given.gains
    squares = np.tensordot((gains * share) ** 2, sums(mixed.values, block, 2), 1) * factor**2
    once = np.tensordot(gains, sums(mixed.values, block), 1) * factor
    out = (
        np.sqrt([_spread(c, variance) for c in squares]),
        np.array([_spread(c, wrapped) for c in once]),
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
        allowed, share = (
            KERNELS * response.noise_fraction_allowed,
            noise_share(made, seen, response),
        )
        for finer in FINER if HALVED * share <= allowed else FINER[1:]:
            if (
                share <= allowed or HALVED**2 * share > STATED * allowed
            ):  # the finest would cost several times as much, and still not be enough
                break
            other = make(replace(lens, speckle_error=finer * lens.speckle_error))
            if other.speckle.max() < made.speckle.max():
                made, share = other, noise_share(other, seen, response)
    return made, share, seen


def noise_share(made, seen: Counted, response) -> float:
    """Return what 99 % of the tiles' errors are at most, over the noise of the sensor's charge; no
    tile is taken for brighter than it is.
    """
    band_share, variance, wrapped, far = _kernels(made, seen.block, seen.frame)
    found = [0.0]
    for row, whole, least in zip(seen.weights, seen.sums, seen.least):
        deviation, bound = (
            _spread(np.tensordot((row * band_share) ** 2, seen.squares, 1), variance),
            _spread(whole, wrapped),
        )
        afar = np.maximum(transform.plain(whole, far.spectrum, far.size)[0] * far.peak, 0.0)
        least = least + afar  # what comes from near is left out
        noise, lit = (
            np.sqrt(max(response.read_noise_e, 1.0) ** 2 + least),
            least < response.full_scale_e,
        )
        if lit.any():
            found.append(within((bound / noise)[lit], (np.sqrt(deviation) / noise)[lit]))
    return max(found)


def _kernels(made, block, frame):
    """Return the error of every band over the worst one's, and what that one adds from block to
    block to variance, bound and light.
    """
    known = made.__dict__.setdefault("_error_kernels", {})  # of frozen kernels: made once
    if (block, frame) not in known:
        points, steps, first = made.sampled
        shape = made.bands[0].shape
        octave, away = (
            kernel_sampling_error.octaves(shape),
            [np.abs(np.arange(n) - n // 2) for n in shape],
        )
        cut, tiles = (
            tuple(slice(f, None, s) for f, s in zip(first, steps)),
            np.maximum(away[0][:, None], away[1]),
        )
        share = (
            points
            * np.moveaxis(made.deviation[:, octave[cut]], 0, -1)
            * (tiles[cut][..., None] > made.core)
        ).sum((0, 1))
        worst = int(share.argmax())
        kernel, beyond = (
            np.asarray(made.bands[worst], float),
            made.deviation[worst][octave] * (tiles > made.core[worst]),
        )
        edge = np.maximum(
            *np.meshgrid(
                *(a / max(n // 2, 1) for a, n in zip(away, shape)), indexing="ij", sparse=True
            )
        )
        light = kernel * (beyond > 0)
        parts = (kernel * beyond) ** 2, light * (made.wrap * edge**2), light
        blocks = [-(-n // block) for n in frame]  # kernels may end before it does
        known[block, frame] = (
            share / share[worst],
            *(prepare(tile_sums(_padded(part, block), block) / block**2, blocks) for part in parts),
        )
    return known[block, frame]


def _spread(light, kernel):
    """Return the convolution of light (y, x) not below 0, or a little more than it: the bound on a
    transform's rounding is added.

    Rounding is some 1e-16 of the lamps' light everywhere: far less than the noise of any tile, and
    no tile need be summed directly.
    """
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
