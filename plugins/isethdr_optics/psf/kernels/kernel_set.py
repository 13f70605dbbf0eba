"""Kernel set: the kernels of all bands of a lens, their errors, and their transforms."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np

from isethdr_core.physics import convolution
from isethdr_core.physics.convolution.mirrored import Mirrored

from .. import kernel_spectra
from ..scaled_pattern import Frame

# largest memory of the transforms of one lens's kernels that are not mapped from disk
SPECTRA_BYTES = 1 << 30
SAMPLED = 64  # number of sample points of a kernel along each axis, for estimates

T = TypeVar("T")  # type of a result that kernels keep


class Wide(NamedTuple):
    """Properties of an exact core that is wider than the usual one."""

    tiles: int  # from the axis, along y and along x
    deviation: np.ndarray  # per octave within it, as `Kernels.deviation`


@dataclass(frozen=True, eq=False)
class Kernels:
    """Kernels of all bands (float32, the axis in the middle), and their errors."""

    bands: Sequence[np.ndarray | Mirrored]
    outside: np.ndarray  # (band,) fraction of the energy beyond the kernel
    # (band, octave) relative L1 error per tile; the first octave of radius is 1 to 2 tiles
    speckle: np.ndarray
    # (band,) light through the pupil / light through the clean round stop
    transmitted: np.ndarray
    # relative error of tiles near the kernel's border, from light that the period of the lattice
    # wraps around
    wrap: float = 0.0
    # (band, octave) relative error beyond `core`, as `kernel_sampling_error.deviation`; None: exact
    deviation: np.ndarray | None = None
    # (band,) tiles from the axis, along both y and x, within which the kernel is exact
    core: np.ndarray | None = None
    # relative error at the border of that core, as `at_border` of `exact_core.core_error`; 0: only
    # rounding errors
    core_deviation: float = 0.0
    # objects that the cache's key identifies by id; kept alive, so that no id is used twice
    keep: tuple = ()
    name: str | None = None  # name of the kernels on disk; None: they are not kept there
    scaled: Frame | None = None  # frame of kernels from one pattern; None: other kernels
    wide: Wide | None = None  # wider exact core of kernels from one pattern; None: the usual core
    fine_rings: bool = False  # whether the rings have the sampling of `scaled_pattern.fine_rings`
    key: tuple = ()  # key in the cache

    @cached_property
    def profiles(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Sums over x and over y of every band's kernel."""
        # transforms hold the profiles, but are not computed only for them
        source = self.__dict__.get("spectra") or self.__dict__.get("divided")
        return source.profiles if source else [kernel_spectra.profile(b) for b in self.bands]

    @cached_property
    def sampled(self) -> tuple[np.ndarray, list[int], list[int]]:
        """Shape of the kernels on a coarse grid: samples (y, x, band), spacing of the grid (y, x)
        and its first tiles (y, x).
        """
        steps = [max(1, n // SAMPLED) for n in self.bands[0].shape]
        first = [s // 3 for s in steps]
        cut = tuple(slice(f, None, s) for f, s in zip(first, steps))
        return np.stack([np.asarray(b[cut], float) for b in self.bands], axis=-1), steps, first

    @cached_property
    def centre(self) -> np.ndarray:
        """Share of a tile's light that stays in it, per band."""
        return np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in self.bands], float)

    @cached_property
    def transforms(self) -> kernel_spectra.KeptTransforms:
        """The transforms of kernels in memory, for images of the full frame."""
        return kernel_spectra.KeptTransforms(self.bands, SPECTRA_BYTES)

    @cached_property
    def spectra(self) -> kernel_spectra.Spectra | None:
        """The kernels with their transforms, for images of the full frame. None if there is neither
        a file on disk nor enough memory.
        """
        return kernel_spectra.spectra(self.bands, self.name) if self._fits else None

    @cached_property
    def divided(self) -> kernel_spectra.Divided | None:
        """The kernels' near and far parts with their transforms, for images of the full frame. None
        in the same cases as `spectra`.
        """
        return kernel_spectra.divided(self.bands, self.name) if self._fits else None

    @cached_property
    def _fits(self) -> bool:
        return (
            bool(self.name)
            or 2 * len(self.bands) * self.bands[0].nbytes * (1 + (not _mirrored(self.bands[0])))
            <= SPECTRA_BYTES
        )

    def ready(self, band: int) -> convolution.Kernel:
        """Return one band's kernel with its transform, for images of the full frame."""
        if isinstance(self.bands[band], Mirrored):
            return self.transforms.kernel(band)
        if self.spectra:
            return self.spectra.kernels[band]
        return convolution.prepare(self.bands[band], [n // 2 + 1 for n in self.bands[band].shape])

    def kept(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return make(), or the result of an earlier call with the same key. Kernels never change,
        so that what follows from them alone is computed once.

        Parameters
        ----------
        key : name of the result.
        make : function without parameters that computes it.
        """
        if key not in self._results:
            self._results[key] = make()
        return self._results[key]

    @cached_property
    def _results(self) -> dict[Hashable, Any]:
        """Results of `kept`."""
        return {}

    @property
    def held_bytes(self) -> int:
        """Memory of this process that the kernels and their transforms take; mapped files take
        none.
        """
        holders = [self.__dict__.get(n) for n in ("spectra", "divided", "transforms")]
        return sum(b.nbytes for b in self.bands if not isinstance(b, np.memmap)) + sum(
            m.held_bytes for m in holders if m
        )


def joined(first: np.ndarray, some: Kernels, computed: Kernels) -> Kernels:
    """Return kernels of all bands, joined from two sets.

    Parameters
    ----------
    first : (band,) mask: true where `some` holds the kernel, false where `computed` does.
    some, computed : kernels of the bands of each set, in the order of the bands.
    """
    order = np.argsort(np.concatenate([np.flatnonzero(first), np.flatnonzero(~first)]))
    arrays = {
        n: np.concatenate([getattr(some, n), getattr(computed, n)])[order]
        for n in ("outside", "speckle", "transmitted", "deviation", "core")
    }
    bands = [*some.bands, *computed.bands]
    return Kernels(
        [bands[k] for k in order],
        **arrays,
        wrap=max(some.wrap, computed.wrap),
        core_deviation=max(some.core_deviation, computed.core_deviation),
        keep=some.keep,
    )


def _mirrored(kernel: Mirrored | np.ndarray) -> bool:
    return isinstance(kernel, Mirrored) or np.array_equal(kernel, kernel[::-1, ::-1])
