"""Kernels of a field: kernels of the axis, and one core for each field point."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from isethdr_core.physics.convolution import Bound

from ..imaging.overlap_add import overlaid
from ..psf import kernels


@dataclass(frozen=True, eq=False)
class FieldKernels:
    """Kernels of a lens with a varying point spread: kernels of the axis, one core per field
    point.
    """

    axis: kernels.Kernels
    half: tuple[int, int]  # (y, x) tiles from the middle to the border of a core
    # per field point: a window of the frame, and the share of the light of each tile in the window
    shares: list[tuple[tuple[slice, slice], np.ndarray]]
    cores: list[kernels.Kernels]  # per field point, the axis first
    # (octave,) largest difference between kernels of field points and that of the axis, defined as
    # `kernel_sampling_error.deviation`
    unlike: np.ndarray

    def far_scale(self, band: int) -> np.ndarray:
        """Return the factor (y, x) on the light of each tile that the kernel of the axis spreads
        beyond the core. The factor conserves the energy.

        All cores, including that of the axis, have the same sampling. Their sums are close to 1,
        and another sampling would change the small remainder.
        """
        rows, columns = (n // 2 + 1 for n in self.axis.bands[band].shape)
        out = np.zeros((rows, columns))
        remaining = [1 - core.bands[band].sum(dtype=float) for core in self.cores]
        for (window, share), beyond in zip(self.shares, remaining):
            out[window] += share * (beyond / remaining[0] if remaining[0] > 0 else 1.0)
        return out

    @cached_property
    def far(self) -> kernels.Kernels | None:
        """The kernels of the light beyond the cores; None if they are exact, or if the cores hold
        all light.
        """
        return None if self.axis.deviation is None else self._beyond(self.axis.deviation)

    @cached_property
    def unlike_far(self) -> kernels.Kernels | None:
        """The kernels of the axis, with their difference to the outermost field point as error."""
        # the bound that `wrap` states is not used here
        return self._beyond(
            np.broadcast_to(self.unlike, (len(self.axis.bands), len(self.unlike))), wrap=1.0
        )

    def _beyond(self, deviation: np.ndarray, **more: Any) -> kernels.Kernels | None:
        if all(np.array_equal(self.half, [n // 2 for n in band.shape]) for band in self.axis.bands):
            return None
        return replace(
            self.axis,
            core=np.full(len(self.axis.bands), float(min(self.half))),
            core_deviation=0.0,
            deviation=np.array(deviation),
            **more,
        )

    def _middle(self, band: int) -> tuple[slice, ...]:
        return tuple(
            slice(n // 2 - h, n // 2 + h + 1)
            for n, h in zip(self.axis.bands[band].shape, self.half)
        )

    def spread(
        self, out: np.ndarray, light: np.ndarray, band: int, error_allowed: float = 0.0
    ) -> Bound:
        """Write the image of one band's light, and return the bound of its convolutions.

        Parameters
        ----------
        out : (y, x) array that receives the image.
        light : (y, x) light of the band on the field's tiles.
        band : index of the band.
        error_allowed : largest relative error of the convolutions; 0: exact computation.
        """
        axis = np.array(self.axis.bands[band], float)
        axis[self._middle(band)] = 0.0
        parts = [(wide, part, core.bands[band]) for wide, part, core in self.parts(light)]
        if axis.any():
            parts.append(((slice(None), slice(None)), self.far_scale(band) * light, axis))
        total, bound = overlaid(parts, light.shape, error_allowed)
        out[...] = total
        return bound

    def parts(
        self, light: np.ndarray, power: float = 1.0
    ) -> Iterator[tuple[tuple[slice, ...], np.ndarray, kernels.Kernels]]:
        """Yield (window, part of the light, kernels) of every field point that has some light.

        The window extends beyond the light by the reach of the core.

        Parameters
        ----------
        light : (..., y, x) light on the field's tiles.
        power : exponent of the shares before the light is multiplied by them.
        """
        for (window, share), core in zip(self.shares, self.cores):
            part = share**power * light[(..., *window)]
            if part.any():
                wide = tuple(
                    slice(max(w.start - h, 0), min(w.stop + h, n))
                    for w, h, n in zip(window, self.half, light.shape[-2:])
                )
                more = [(0, 0)] * (light.ndim - 2) + [
                    (w.start - v.start, v.stop - w.stop) for w, v in zip(window, wide)
                ]
                yield wide, np.pad(part, more), core
