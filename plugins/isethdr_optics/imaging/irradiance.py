"""Imaging: mixed radiance to irradiance on the tiles of the field, band by band.

Radiance is multiplied by the throughput and by the falloff at its field angle, and then convolved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.fft as sf

from isethdr_core import quantities
from isethdr_core.physics.convolution import convolve_into
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..psf.error_parts import term
from . import array_backend
from .field_optics import FieldOptics
from .threads import threads

if TYPE_CHECKING:
    from isethdr_core.physics.convolution.linear import Bound


class Irradiance(NamedTuple):
    """Irradiance on the field's own tiles."""

    values: np.ndarray  # (band, y, x)
    terms: list[ErrorTerm]  # errors of the convolutions


def irradiance(values: np.ndarray, optics: FieldOptics, error_allowed: float = 0.0) -> Irradiance:
    """Return irradiance of mixed radiance, W m-2 nm-1, on the field's own tiles.

    Parameters
    ----------
    values : mixed radiance (band, y, x), W m-2 sr-1 nm-1. All tiles contribute. Light that leaves
        the frame does not return on the opposite side.
    optics : optics of the field of `values`.
    error_allowed : largest relative error of a convolution.
    """
    kernels = optics.kernels
    field = optics.field
    gains = optics.gains
    to_device = array_backend.device_transfer()
    out = np.empty(values.shape, np.result_type(values.dtype, np.float32))

    def one_band(b: int, apply: Callable[..., Any]) -> Bound | None:
        """Write the irradiance of band `b`; return the bound of its convolution, or None without
        one.
        """
        kernel = kernels and kernels.ready(b)
        relative = optics.relative
        gain = gains[b]
        if kernel is None:
            out[b] = values[b] * (gain if relative is None else gain * relative)
            return None
        arguments = out[b], values[b], kernel, error_allowed, relative, gain
        if to_device:
            return array_backend.convolution_on(to_device)(*arguments)
        return convolve_into(*arguments, apply=apply)

    # two bands at a time keep memory low and all threads busy
    with (
        threads() as apply,
        ThreadPoolExecutor(2) as band_pool,
        sf.set_workers(1),
    ):
        if field is None:
            bounds = list(band_pool.map(lambda b: one_band(b, apply), range(len(gains))))
        else:
            bounds = apply(
                lambda b: field.spread(
                    out[b], values[b] * (gains[b] * optics.sensor.relative), b, error_allowed
                ),
                range(len(gains)),
            )
    if kernels is None:
        return Irradiance(out, [])
    return Irradiance(out, _errors(list(bounds), float(np.finfo(out.dtype).eps) / 2))


def _errors(bounds: Sequence[Bound], rounding: float) -> list[ErrorTerm]:
    """Return the largest errors of the bands' convolutions. `rounding` is the relative rounding
    error of the result's type.
    """
    most = max(b.relative for b in bounds) + rounding
    label = "convolution with the kernel"
    relative = term(most, "relative", "bound", label, key="convolution")
    if not any(b.pixels for b in bounds):
        return [relative]
    worst = max(bounds, key=lambda b: b.absolute)
    tiles = max(b.pixels for b in bounds)
    label = (
        f"convolution, up to {tiles} dark tiles per band: too dark beside the lamps for the"
        " relative bound, too many for direct sums"
    )
    key = "convolution of dark tiles"
    return [relative, term(worst.absolute, quantities.IRRADIANCE, "bound", label, key=key)]
