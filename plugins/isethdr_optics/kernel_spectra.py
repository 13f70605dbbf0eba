"""Kernel spectra: the transforms of a lens's kernels, taken once and mapped from disk by every process that forms images."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from isethdr_core.physics.convolution import Kernel, prepare
from isethdr_core.physics.convolution_transform import sizes

from . import kernel_store


@dataclass(frozen=True, eq=False)
class Spectra:
    """Kernels of all bands with their transforms, for images of the full frame."""

    kernels: list[Kernel]
    profiles: list[tuple[np.ndarray, np.ndarray]]  # sums over x and over y of every band's kernel
    blocks: np.ndarray  # (band, block, sy, columns): the transforms of all kernels, each of psf / its peak

    @property
    def held_bytes(self) -> int:
        """Memory of this process that the transforms take; mapped files take none."""
        return 0 if isinstance(self.blocks, np.memmap) else self.blocks.nbytes


def spectra(bands, name: str | None) -> Spectra:
    """Return the transforms of kernels (y, x), each of the full frame.

    Parameters
    ----------
    name : under which the transforms are kept on disk; None: nowhere. They are read from there, or taken now.
    """
    shape = tuple(n // 2 + 1 for n in bands[0].shape)
    made = []

    def each():
        for values in bands:
            kernel = prepare(values, shape)
            made.append((replace(kernel, spectrum=None), profile(values)))
            yield kernel.spectrum

    found = kernel_store.load(f"{name}-spectra") if name else None
    if found is None and name:
        parts = each()
        first = next(parts)
        kernel_store.save(f"{name}-spectra", (len(bands), *first.shape), first.dtype, chain([first], parts), lambda: _facts(made))
        found = kernel_store.load(f"{name}-spectra")
        made.clear()
    if found is None:
        blocks = np.stack(list(each()))
        return Spectra([replace(k, spectrum=b) for (k, _), b in zip(made, blocks)], [p for _, p in made], blocks)
    facts, blocks = found
    size, rows = sizes(shape, bands[0].shape), bands[0].shape[0]
    kernels = [Kernel(v, shape, size, s, *f[:2].tolist(), bool(f[2])) for v, s, f in zip(bands, blocks, facts.T)]
    return Spectra(kernels, [(f[3 : 3 + rows], f[3 + rows :]) for f in facts.T], blocks)


def profile(values) -> tuple[np.ndarray, np.ndarray]:
    """Return the sums of a kernel over x and over y."""
    return values.sum(axis=1, dtype=float), values.sum(axis=0, dtype=float)


def _facts(made):
    """Return (fact, band): peak, norm, whether positive, and both profiles."""
    return np.stack([np.concatenate([[k.peak, k.norm, k.positive], *profiles]) for k, profiles in made], axis=1)
