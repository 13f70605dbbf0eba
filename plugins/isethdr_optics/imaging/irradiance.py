"""Imaging: mixed radiance to irradiance on the tiles of the field, band by band.

Radiance -> times throughput -> times falloff of its own field angle -> convolution.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import scipy.fft as sf

from isethdr_core import quantities
from isethdr_core.physics.convolution import convolve_into
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..psf.error_parts import term
from . import array_backend
from .field_optics import FieldOptics
from .threads import threads


class Irradiance(NamedTuple):
    """Irradiance on the field's own tiles."""

    values: np.ndarray  # (band, y, x)
    terms: list[ErrorTerm]  # of the convolutions


def irradiance(values, given: FieldOptics, error_allowed: float = 0.0) -> Irradiance:
    """Return irradiance of mixed radiance (band, y, x).

    The whole grid takes part; nothing wraps. Convolutions are right to `error_allowed`, relative.
    """
    made, field, gains = given.made, given.field, given.gains
    put = array_backend.place()
    out = np.empty(values.shape, np.result_type(values.dtype, np.float32))
    with (
        threads() as apply,
        ThreadPoolExecutor(2) as two,
        sf.set_workers(1),
    ):  # two bands at a time: little memory, and no thread waits
        if field is None:
            bounds = list(
                two.map(
                    lambda b: _band(
                        out[b],
                        values[b],
                        made and made.ready(b),
                        given.relative,
                        gains[b],
                        apply,
                        error_allowed,
                        put,
                    ),
                    range(len(gains)),
                )
            )
        else:
            bounds = apply(
                lambda b: field.spread(
                    out[b], values[b] * (gains[b] * given.sensor.relative), b, error_allowed
                ),
                range(len(gains)),
            )
    if made is None:
        return Irradiance(out, [])
    return Irradiance(out, _errors(list(bounds), float(np.finfo(out.dtype).eps) / 2))


def _band(out, light, kernel, relative, gain, apply, error_allowed, put):
    """Write one band's irradiance into `out`; return the bound of its convolution, None where there
    is none.
    """
    if kernel is None:
        out[...] = light * (gain if relative is None else gain * relative)
        return None
    if put:
        return array_backend.convolve_there(put, out, light, kernel, error_allowed, relative, gain)
    return convolve_into(out, light, kernel, error_allowed, factor=relative, gain=gain, apply=apply)


def _errors(bounds, rounding) -> list[ErrorTerm]:
    """Return the errors of the bands' convolutions as they came out, and the `rounding` of the
    dtype they are kept in.
    """
    most = max(b.relative for b in bounds) + rounding
    label = "convolution of the given kernel"
    relative = term(most, "relative", "bound", label, key="convolution")
    if not any(b.pixels for b in bounds):
        return [relative]
    worst = max(bounds, key=lambda b: b.absolute)
    tiles = max(b.pixels for b in bounds)
    label = (
        f"convolution of up to {tiles} tiles per band, too dark beside the lamps for the row"
        " above and too many to sum"
    )
    key = "convolution of dark tiles"
    return [relative, term(worst.absolute, quantities.IRRADIANCE, "bound", label, key=key)]
