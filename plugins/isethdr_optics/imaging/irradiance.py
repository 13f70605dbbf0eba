"""Imaging: mixed radiance to irradiance on the tiles of the field, band by band.

Radiance -> times throughput -> times falloff of its own field angle -> convolution.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import scipy.fft as sf

from isethdr_core import ledger, quantities
from isethdr_core.physics.convolution import convolve_into

from . import array_backend
from .field_optics import FieldOptics
from .threads import threads


def irradiance(values, given: FieldOptics, error_allowed: float = 0.0):
    """Return irradiance (band, y, x) on the field's own tiles of mixed radiance (band, y, x).

    The whole grid takes part; nothing wraps. Convolutions are right to `error_allowed`, relative.
    The errors of the convolutions are stated in the ledger.
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
    if made is not None:
        _state_convolution(list(bounds), float(np.finfo(out.dtype).eps) / 2)
    return out


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


def _state_convolution(bounds, rounding):
    """State the error of each band's convolution as it came out, and the `rounding` of the dtype
    they are kept in.
    """
    ledger.error(
        max(b.relative for b in bounds) + rounding,
        "relative",
        "bound",
        "convolution of the given kernel",
        key="convolution",
    )
    if any(b.pixels for b in bounds):
        worst = max(bounds, key=lambda b: b.absolute)
        tiles = max(b.pixels for b in bounds)
        ledger.error(
            worst.absolute,
            quantities.IRRADIANCE,
            "bound",
            f"convolution of up to {tiles} tiles per band, too dark beside the lamps for the row"
            " above and too many to sum",
            key="convolution of dark tiles",
        )
