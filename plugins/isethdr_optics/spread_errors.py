"""Spread errors: what the errors of kernels do to the light of one scene, tile by tile; and kernels as right as a sensor needs.

Errors of different tiles of a kernel are independent but for neighbours (`kernel_errors.deviation`), and so are those of different
bands, so a tile's light is off by the root of the sum of (L k d)^2 over the tiles and bands that it comes from. What the period of
the far field adds may have one sign: its share of L k adds up as it is.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from isethdr_core.accuracy import KERNELS
from isethdr_core.noise_units import within
from isethdr_core.physics import convolution_transform
from isethdr_core.physics.convolution import prepare
from isethdr_core.physics.convolution_spectral import matrix_product
from isethdr_core.physics.radiometry import band_widths_nm, photon_energy_j

from . import kernel_errors
from .exact_core import kept_cores
from .kernels import cpus, tile_sums

MOST_TILES = 96  # along an axis: finer frames are summed over blocks, over which errors change little
ROWS = 64  # of a frame whose charge is added up at a time
FINER = (0.5, 0.25)  # of the lens's own error: still finer lattices outgrow memory, and little is won
HALVED = 0.35  # what is left of the errors of kernels that are asked for half the error, measured


def spread_errors(mixed, given, weights) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (deviation, bound) of the light that kernels bring, each (channel, y, x), on the sensor's tiles; None where it is not known.

    Parameters
    ----------
    mixed : mixed radiance. `given` : `imaging.Parts` of its field.
    weights : (channel, band) what is counted of irradiance, electrons per m2 and second for example.

    Notes
    -----
    All bands have the shape of the worst one's errors, scaled: kernels of neighbouring wavelengths fall alike.
    """
    made, (ny, nx) = given.made, mixed.shape[1:]
    if given.field is not None or given.sensor.scales is not None:
        return None
    if exact(made):
        nothing = given.sensor.move(np.zeros((len(weights), ny, nx), np.float32))
        return nothing, nothing
    block = _block((ny, nx))
    factor = 1.0 if given.relative is None else _sums(given.relative, block) / block**2
    share, variance, wrapped, _ = _kernels(made, block, (ny, nx))
    gains = np.asarray(weights) * given.gains
    squares = np.tensordot((gains * share) ** 2, np.stack([_sums(band, block, 2) for band in mixed.values]), 1) * factor**2
    once = np.tensordot(gains, np.stack([_sums(band, block) for band in mixed.values]), 1) * factor
    out = np.sqrt([_spread(c, variance) for c in squares]), np.array([_spread(c, wrapped) for c in once])
    return tuple(given.sensor.move(_tiles(a, block, (ny, nx))) for a in out)


def exact(made) -> bool:
    """Return whether kernels are right but for rounding."""
    return made is None or made.deviation is None or not made.deviation.any()


def fine_enough(make, lens, mixed, relative, response):
    """Return kernels whose errors a sensor cannot tell in this scene, or the lens's own where that is out of reach, and their `noise_share`.

    Parameters
    ----------
    make : function(lens) -> `kernels.Kernels`. `lens` : with `speckle_error`, the largest error that kernels may have.
    relative : factor of the tiles' light, (y, x) or 1. `response` : of the sensors, or None: the lens's own error is enough.
    """
    if response is None:
        return make(lens), 0.0
    with kept_cores():
        made = make(lens)
        if exact(made):
            return made, 0.0
        allowed, share = KERNELS * response.noise_fraction_allowed, noise_share(made, lens, mixed, relative, response)
        for finer in FINER if HALVED * share <= allowed else FINER[1:]:
            if share <= allowed or HALVED**2 * share > allowed:  # the finest would cost several times as much, and still not be enough
                break
            other = make(replace(lens, speckle_error=finer * lens.speckle_error))
            if other.speckle.max() < made.speckle.max():
                made, share = other, noise_share(other, lens, mixed, relative, response)
    return made, share


def noise_share(made, lens, mixed, relative, response) -> float:
    """Return what 99 % of the tiles' errors are at most, over the noise of the sensor's charge; no tile is taken for brighter than it is."""
    wave = mixed.wavelength.values.astype(float)
    counted = lens.throughput_sr() * response.area_exposure_m2_s * response.efficiency(wave) * band_widths_nm(wave) / photon_energy_j(wave)
    block = _block(mixed.shape[1:])
    band_share, variance, wrapped, far = _kernels(made, block, mixed.shape[1:])
    rows, found = np.unique(counted, axis=0), [0.0]
    with ThreadPoolExecutor(min(cpus(), 8)) as pool:
        squares = np.stack(list(pool.map(lambda band: _sums(band, block, 2), mixed.values)))
        weights, values = rows.astype(mixed.dtype), mixed.values
        parts = pool.map(lambda start: matrix_product(weights, values[:, start : start + ROWS]), range(0, mixed.shape[1], ROWS))
        charges = np.concatenate(list(parts), axis=1) * relative
    for row, charge in zip(rows, charges):
        whole, squared = _sums(charge, block), np.tensordot((row * band_share) ** 2, squares, 1) * np.max(relative) ** 2
        deviation, bound = _spread(squared, variance), _spread(whole, wrapped)
        afar = np.maximum(convolution_transform.plain(whole, far.spectrum, far.size)[0] * far.peak, 0.0)
        least = afar + _least(charge, block)  # what comes from near is left out
        noise, seen = np.sqrt(max(response.read_noise_e, 1.0) ** 2 + least), least < response.full_scale_e
        if seen.any():
            found.append(within((bound / noise)[seen], (np.sqrt(deviation) / noise)[seen]))
    return max(found)


def _kernels(made, block, frame):
    """Return the error of every band over the worst one's, and what that one adds from block to block to variance, bound and light."""
    known = made.__dict__.setdefault("_error_kernels", {})  # of frozen kernels: made once
    if (block, frame) not in known:
        points, steps, first = made.sampled
        shape = made.bands[0].shape
        octave, away = kernel_errors.octaves(shape), [np.abs(np.arange(n) - n // 2) for n in shape]
        cut, tiles = tuple(slice(f, None, s) for f, s in zip(first, steps)), np.maximum(away[0][:, None], away[1])
        share = (points * np.moveaxis(made.deviation[:, octave[cut]], 0, -1) * (tiles[cut][..., None] > made.core)).sum((0, 1))
        worst = int(share.argmax())
        kernel, beyond = np.asarray(made.bands[worst], float), made.deviation[worst][octave] * (tiles > made.core[worst])
        edge = np.maximum(*np.meshgrid(*(a / max(n // 2, 1) for a, n in zip(away, shape)), indexing="ij", sparse=True))
        light = kernel * (beyond > 0)
        parts = (kernel * beyond) ** 2, light * (made.wrap * edge**2), light
        blocks = [-(-n // block) for n in frame]    # kernels may end before it does
        known[block, frame] = share / share[worst], *(prepare(tile_sums(_padded(part, block), block) / block**2, blocks) for part in parts)
    return known[block, frame]


def _spread(light, kernel):
    """Return the convolution of light (y, x) not below 0, or a little more than it: the bound on a transform's rounding is added.

    Rounding is some 1e-16 of the lamps' light everywhere: far less than the noise of any tile, and no tile need be summed directly.
    """
    out, norm = convolution_transform.plain(light, kernel.spectrum, kernel.size)
    rounding = convolution_transform.error(norm * kernel.norm, float(np.linalg.norm(out)), kernel.size)
    return (np.maximum(out, 0.0) + rounding) * kernel.peak


def _block(shape):
    return max(1, -(-max(shape) // MOST_TILES))


def _padded(kernel, block):
    """Return a kernel with as many zeros around it as whole blocks take."""
    more = [-(-(n // 2) // block) * block + block - 1 - n // 2 for n in kernel.shape]
    return np.pad(kernel, [(m, m) for m in more])


def _blocks(plane, block, mode="constant"):
    wide = np.pad(plane, [(0, -n % block) for n in plane.shape], mode=mode)
    return wide.reshape(wide.shape[0] // block, block, -1, block)


def _sums(plane, block, power: int = 1):
    """Return sums of the first or second power over blocks, (y, x) float64."""
    parts = _blocks(plane, block)
    return np.einsum("iajb,iajb->ij", parts, parts).astype(float) if power == 2 else parts.sum((1, 3), dtype=float)


def _least(plane, block):
    return _blocks(plane, block, "edge").min((1, 3))


def _tiles(blocks, block, shape):
    return blocks.repeat(block, axis=1).repeat(block, axis=2)[:, : shape[0], : shape[1]].astype(np.float32)
