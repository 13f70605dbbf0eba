"""Kernel spectra: Fourier transforms of a lens's kernels. They are computed once, and every process
that forms images maps them from disk.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from threading import Lock
from typing import Any

import numpy as np

from isethdr_core.physics.convolution import Kernel, prepare
from isethdr_core.physics.convolution.mirrored import Mirrored
from isethdr_core.physics.convolution.transform import sizes

from . import kernel_store

# reach of the near part of a kernel, tiles: so little light falls farther from a lamp that single
# precision is enough there
NEAR = 96
# Kernels are divided only if the near part's transforms have at most this share of the size of the
# full frame's transforms.
WORTH_DIVIDING = 0.5


@dataclass(frozen=True, eq=False)
class Spectra:
    """Kernels of all bands with their transforms, for images of the full frame."""

    kernels: list[Kernel]
    profiles: list[tuple[np.ndarray, np.ndarray]]  # sums over x and over y of every band's kernel
    # (band, block, sy, columns): transforms of all kernels, each divided by its peak
    blocks: np.ndarray

    @property
    def held_bytes(self) -> int:
        """Memory of this process that the transforms take; mapped files take none."""
        return _held_bytes(self.blocks)


@dataclass(frozen=True, eq=False)
class Part:
    """The transforms of a part of every band's kernel, for images of the full frame."""

    blocks: np.ndarray  # (band, block, sy, columns): transforms of the part, divided by its peak
    peaks: np.ndarray  # (band,) largest magnitude of the part
    norms: np.ndarray  # (band,) root of the sum of squares of the part divided by its peak
    size: tuple[int, int]  # (y, x) size of the transforms

    @property
    def single(self) -> bool:
        """Whether the transforms are kept in single precision."""
        return self.blocks.dtype in (np.float32, np.complex64)


@dataclass(frozen=True, eq=False)
class Divided:
    """Kernels of all bands, each the sum of two parts: near a lamp, and far from it."""

    near: Part
    far: Part | None  # None: the near part is the whole kernel
    profiles: list[tuple[np.ndarray, np.ndarray]]  # sums over x and over y of every band's kernel

    @property
    def held_bytes(self) -> int:
        """Memory of this process that the transforms take; mapped files take none."""
        return sum(_held_bytes(p.blocks) for p in (self.near, self.far) if p)


class KeptTransforms:
    """Transforms of kernels, computed when an image needs them.

    A transform that is needed a second time is kept from then on, as long as all kept transforms
    take at most `most_bytes`.
    """

    def __init__(self, bands: Sequence[Mirrored], most_bytes: float) -> None:
        self._bands = bands
        self._left = most_bytes
        self._asked: set[int] = set()
        self._kept: dict[int, Kernel] = {}
        self._lock = Lock()

    @property
    def held_bytes(self) -> int:
        """Memory of this process that the transforms take."""
        return sum(k.spectrum.nbytes for k in self._kept.values())

    def kernel(self, band: int) -> Kernel:
        """Return one band's kernel with its transform, for images of the full frame."""
        stored = self._kept.get(band)
        if stored is not None:
            return stored
        prepared = prepare(self._bands[band], _shape(self._bands))
        with self._lock:
            if band in self._asked and prepared.spectrum.nbytes <= self._left:
                self._left -= prepared.spectrum.nbytes
                self._kept[band] = prepared
            self._asked.add(band)
        return prepared


def spectra(bands: Sequence[np.ndarray], name: str | None) -> Spectra:
    """Return the transforms of kernels. They are read from disk, or else computed.

    Parameters
    ----------
    bands : kernels (y, x) of all bands, each of the full frame.
    name : name of the transforms on disk; None: they are not kept there.
    """
    shape = _shape(bands)
    size = sizes(_shape(bands), bands[0].shape)

    def one(values: np.ndarray) -> tuple[list[float], np.ndarray]:
        kernel = prepare(values, shape)
        return [
            kernel.peak,
            kernel.norm,
            kernel.positive,
            *np.concatenate(profile(values)),
        ], kernel.spectrum

    facts, blocks = _stored_spectra(f"{name}-spectra" if name else None, one, bands)
    kernels = [
        Kernel(v, shape, size, s, *f[:2].tolist(), bool(f[2]))
        for v, s, f in zip(bands, blocks, facts.T)
    ]
    return Spectra(kernels, _profiles(facts[3:], bands), blocks)


def divided(bands: Sequence[Mirrored | np.ndarray], name: str | None) -> Divided:
    """Return the transforms of the kernels within `NEAR` tiles and, in single precision, of the
    kernels beyond.

    Near a lamp, light is bright and must be accurate to many digits; a kernel that ends there has
    small transforms. Far from a lamp, the transforms cover the full frame, but hardly any light
    arrives. In a small frame, the near part is the whole kernel.

    Parameters
    ----------
    bands, name : as in `spectra`.
    """
    shape = _shape(bands)
    full = sizes(_shape(bands), bands[0].shape)
    cut = tuple(slice(max(0, n // 2 - NEAR), n // 2 + NEAR + 1) for n in bands[0].shape)
    single_part = np.prod(sizes(shape, bands[0][cut].shape)) > WORTH_DIVIDING * np.prod(full)
    if single_part:
        cut = (slice(None), slice(None))

    half = (
        [c.stop - c.start >> 1 for c in cut]
        if not single_part
        else [n // 2 for n in bands[0].shape]
    )

    def near(values: Mirrored) -> tuple[list[float], np.ndarray]:
        inner = values.within(*half) if isinstance(values, Mirrored) else values[cut]
        kernel = prepare(inner, shape)
        return [kernel.peak, kernel.norm, *np.concatenate(profile(values))], kernel.spectrum

    def far(values: np.ndarray) -> tuple[list[float], np.ndarray]:
        if isinstance(values, Mirrored):
            rest = values.beyond(*half)
        else:
            rest = np.array(values)
            rest[cut] = 0.0
        kernel = prepare(rest, shape)
        return [kernel.peak, kernel.norm], kernel.spectrum.astype(
            np.complex64 if np.iscomplexobj(kernel.spectrum) else np.float32
        )

    def part(
        label: str, divided_part: Callable[..., Any], extent: tuple[int, int]
    ) -> tuple[Part, np.ndarray]:
        facts, blocks = _stored_spectra(f"{name}-{label}" if name else None, divided_part, bands)
        return Part(blocks, *facts[:2], sizes(shape, extent)), facts[2:]

    first, sums = part("near", near, bands[0][cut].shape)
    return Divided(
        first, None if single_part else part("far", far, bands[0].shape)[0], _profiles(sums, bands)
    )


def profile(values: Mirrored | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sums of a kernel over x and over y."""
    return values.sum(axis=1, dtype=float), values.sum(axis=0, dtype=float)


def _stored_spectra(
    name: str | None,
    divided_part: Callable[..., Any],
    bands: Sequence[Mirrored | np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Return facts (fact, band) and arrays (band, ...) of all kernels.

    They are read from disk, or else computed. Without a name or a store they are held in memory.

    Parameters
    ----------
    name : name of the arrays on disk; None: they are not kept there.
    divided_part : function(kernel) -> (facts, array).
    bands : kernels (y, x) of all bands.
    """
    stored = kernel_store.load(name) if name else None
    facts = []

    def arrays() -> Iterator[np.ndarray]:
        facts.clear()
        for values in bands:
            now, array = divided_part(values)
            facts.append(now)
            yield array

    def known() -> np.ndarray:
        return np.array(facts, float).T

    if stored is None and name:
        parts = arrays()
        first = next(parts)
        # the transform of a kernel that equals its mirror image is real, of any other complex
        mirrored = all(isinstance(b, Mirrored) or np.array_equal(b, b[::-1, ::-1]) for b in bands)
        dtype = first.dtype if mirrored else np.result_type(first.dtype, np.complex64)
        kernel_store.save(name, (len(bands), *first.shape), dtype, chain([first], parts), known)
        stored = kernel_store.load(name)
    if stored is None:
        arrays_now = np.stack(list(arrays()))
        stored = known(), arrays_now
    return stored


def _profiles(
    sums: np.ndarray, bands: Sequence[Mirrored | np.ndarray]
) -> list[tuple[np.ndarray, np.ndarray]]:
    rows = bands[0].shape[0]
    return [(s[:rows], s[rows:]) for s in sums.T]


def _shape(bands: Sequence[Mirrored | np.ndarray]) -> tuple[int, int]:
    return tuple(n // 2 + 1 for n in bands[0].shape)


def _held_bytes(blocks: np.ndarray) -> int:
    return 0 if isinstance(blocks, np.memmap) else blocks.nbytes
