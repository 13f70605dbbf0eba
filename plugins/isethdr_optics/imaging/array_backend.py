"""Array backend: convolution by another array library than NumPy, for example on a GPU.

The environment variable ISETHDR_ARRAYS names a library with the Python array API and, if the
library has several devices, one of them: `torch:cuda`, `cupy`. It is not part of a recipe, because
results differ only by rounding, within the bound that every convolution states.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import array_api_compat
import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.arrays import device, imported_library, namespace, on_host
from isethdr_core.physics.convolution import convolve_into

if TYPE_CHECKING:
    from isethdr_core.physics.convolution.linear import Bound, Kernel


def device_transfer() -> Callable[..., Any] | None:
    """Return a function that copies a NumPy array to the device of ISETHDR_ARRAYS; None if unset.

    Raises
    ------
    ConfigError : the library is not installed, or does not have the device.
    """
    name = os.environ.get("ISETHDR_ARRAYS", "")
    if name in ("", "numpy"):
        return None
    library, _, device_name = name.partition(":")
    try:
        xp = array_api_compat.array_namespace(imported_library(library).asarray([0.0]))
        chosen_device = (
            device(xp.asarray([0.0]))
            if not device_name
            else xp.Device(device_name)
            if hasattr(xp, "Device")
            else device_name
        )

        def to_device(a: np.ndarray) -> Any:
            return xp.asarray(np.ascontiguousarray(a), device=chosen_device)

        on_host(to_device(np.zeros(1)))
    except Exception as err:  # libraries raise different errors for a device they do not have
        raise ConfigError(
            f"ISETHDR_ARRAYS is {name!r}: {err}; expected an installed library with the Python"
            " array API, and a device of it, as torch:cuda or cupy; unset it to compute with NumPy"
        ) from err
    return to_device


def convolution_on(to_device: Callable) -> Callable:
    """Return a function like `convolve_into` that computes on another device.

    Parameters
    ----------
    to_device : function that copies a NumPy array to the device.
    """
    return partial(_convolve_on, to_device)


def _convolve_on(  # noqa: PLR0913 - the parameters of `convolve_into`, and the device
    to_device: Callable[..., Any],
    out: np.ndarray,
    image: np.ndarray,
    kernel: Kernel,
    error_allowed: float,
    factor: np.ndarray,
    gain: float,
) -> Bound:
    """Convolve on another device, write the result into the NumPy array `out`, and return the bound
    of `convolve_into`.
    """
    # the kernel never changes, so that it is copied to the device only once
    on_device = kernel.__dict__.get("_on_device")
    if on_device is None or on_device[0] is not namespace(to_device(np.zeros(1))):
        on_device = (
            namespace(to_device(np.zeros(1))),
            replace(kernel, psf=to_device(kernel.psf), spectrum=to_device(kernel.spectrum)),
        )
        kernel.__dict__["_on_device"] = on_device
    light = to_device(image)
    result = namespace(light).empty(light.shape, dtype=light.dtype, device=device(light))
    bound = convolve_into(
        result,
        light,
        on_device[1],
        error_allowed,
        None if factor is None else to_device(factor),
        float(gain),
    )
    out[...] = on_host(result)
    return bound
