"""Elsewhere: bands convolved by another array library than NumPy, on a graphics processor say,
where the environment asks for it.

ISETHDR_ARRAYS names a library with the Python array API, and a device where it has several:
`torch:cuda`, `cupy`. It is no part of a recipe: results differ by rounding only, within the bound
that every convolution states.
"""

from __future__ import annotations

import os
from dataclasses import replace

import array_api_compat
import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.arrays import device, imported_library, namespace, on_host
from isethdr_core.physics.convolution import convolve_into


def place():
    """Return the function that puts a NumPy array where ISETHDR_ARRAYS says; None where it says
    nothing.

    Raises
    ------
    ConfigError : a library that is not installed, or a device that it does not have.
    """
    name = os.environ.get("ISETHDR_ARRAYS", "")
    if name in ("", "numpy"):
        return None
    library, _, where = name.partition(":")
    try:
        xp = array_api_compat.array_namespace(imported_library(library).asarray([0.0]))
        on = (
            device(xp.asarray([0.0]))
            if not where
            else xp.Device(where)
            if hasattr(xp, "Device")
            else where
        )

        def put(a):
            return xp.asarray(np.ascontiguousarray(a), device=on)

        on_host(put(np.zeros(1)))
    except Exception as err:  # whatever a library raises for a device that it does not have
        raise ConfigError(
            f"ISETHDR_ARRAYS is {name!r}: {err}; expected an installed library with the Python"
            " array API, and a device of it, as torch:cuda or cupy; unset it to compute with NumPy"
        ) from err
    return put


def convolve_there(put, out, image, kernel, error_allowed, factor, gain):
    """Write a convolution made where `put` puts arrays into the NumPy array `out`; other arguments
    and result as `convolve_into`.
    """
    there = kernel.__dict__.get("_there")  # of a frozen kernel: it is sent once
    if there is None or there[0] is not namespace(put(np.zeros(1))):
        there = (
            namespace(put(np.zeros(1))),
            replace(kernel, psf=put(kernel.psf), spectrum=put(kernel.spectrum)),
        )
        kernel.__dict__["_there"] = there
    light = put(image)
    result = namespace(light).empty(light.shape, dtype=light.dtype, device=device(light))
    bound = convolve_into(
        result, light, there[1], error_allowed, None if factor is None else put(factor), float(gain)
    )
    out[...] = on_host(result)
    return bound
