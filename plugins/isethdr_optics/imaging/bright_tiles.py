"""Bright tiles: what a spectral fit misses of their light, added around them band by band."""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.convolution.spectral import matrix_product

RADII = (
    96,
    64,
    32,
    16,
    8,
    4,
)  # tiles that are corrected around a bright one: no more than `kernel_spectra.NEAR`
MOST_WORK = 3e7  # values written per channel, at most
TOGETHER = 64  # bright tiles
STRIPS = 2  # of rows: work for as many threads as there are, whatever the number of channels


def radii(rate) -> np.ndarray:
    """Return how far around each bright tile to correct: in the skirt of a kernel, r^-3, to where
    all fall to the same light.
    """
    wanted = RADII[0] * np.cbrt(rate / max(float(rate.max(initial=0.0)), np.finfo(float).tiny))
    steps = np.array(RADII)[::-1]
    chosen = steps[np.searchsorted(steps, wanted)]
    for largest in RADII:
        chosen = np.minimum(chosen, largest)
        if np.sum((2.0 * chosen + 1) ** 2) <= MOST_WORK:
            break
    return chosen


def correct(out, cube, relative, weights, fit, made, apply=map) -> None:
    """Add to `out` (channel, y, x) what `fit` misses of the light of its bright tiles, as far as it
    falls near them.

    Parameters
    ----------
    cube : (band, y, x); relative : None or (y, x); weights : (channel, band). `made` :
        `kernels.Kernels`.
    apply : how to call a function for every channel: `map`, or that of a pool of threads.
    """
    groups = []
    for radius in np.unique(fit.radii):
        half = [min(int(radius), n // 2) for n in made.bands[0].shape]
        cut = tuple(slice(n // 2 - h, n // 2 + h + 1) for n, h in zip(made.bands[0].shape, half))
        cores = np.stack([b[cut].ravel() for b in made.bands])
        tiles = fit.bright[fit.radii == radius]
        light = cube.reshape(len(cube), -1)[:, tiles]
        missed = light - fit.near.predict @ (fit.near.project.astype(cube.dtype) @ light).astype(
            float
        )
        groups.append(
            (tiles, missed if relative is None else missed * relative.ravel()[tiles], cores, half)
        )

    def strip(task):
        number, first = task
        for group in groups:
            _spread(out[number, first : first + height], first, weights[number], *group)

    height = -(-out.shape[1] // STRIPS)
    list(
        apply(
            strip,
            [
                (number, first)
                for first in range(0, out.shape[1], height)
                for number in range(len(out))
            ],
        )
    )


def _spread(out, first, weights, tiles, missed, cores, half):
    """Add to rows of one channel, `out` from the row `first` on, what tiles of the whole frame
    bring.
    """
    (ny, nx), shape = out.shape, tuple(2 * h + 1 for h in half)
    rows, columns = tiles // nx - first, tiles % nx
    reaches = (rows + half[0] >= 0) & (rows - half[0] < ny)
    rows, columns, missed = rows[reaches], columns[reaches], missed[:, reaches]
    for start in range(0, len(rows), TOGETHER):
        some = slice(start, start + TOGETHER)
        seen = (missed[:, some] * weights[:, None]).T.astype(
            cores.dtype
        )  # single precision: it is what is missed, and that of one tile
        spread = matrix_product(np.ascontiguousarray(seen), cores).reshape(-1, *shape)
        for part, y, x in zip(spread, rows[some], columns[some]):
            top, left, bottom, right = (
                max(y - half[0], 0),
                max(x - half[1], 0),
                min(y + half[0] + 1, ny),
                min(x + half[1] + 1, nx),
            )
            inside = (
                slice(top - y + half[0], bottom - y + half[0]),
                slice(left - x + half[1], right - x + half[1]),
            )
            out[top:bottom, left:right] += part[inside]
