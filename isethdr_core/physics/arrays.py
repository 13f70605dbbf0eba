"""Arrays of libraries other than NumPy with the Python array API, for example on a graphics
processor.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any

import array_api_compat
import numpy as np


def imported_library(name: str) -> ModuleType:
    """Import the array library with the name that a user gave, for example "torch".

    Raises
    ------
    ImportError : the library is not installed.
    """
    return import_module(name)


def namespace(a: Any) -> Any:
    """Return the array library of `a` as a namespace of the Python array API; NumPy for other
    objects.
    """
    if isinstance(a, np.ndarray) or not array_api_compat.is_array_api_obj(a):
        return np
    return array_api_compat.array_namespace(a)


def device(a: Any) -> Any:
    """Return the device that holds `a`, for new arrays on the same device."""
    return "cpu" if isinstance(a, np.ndarray) else array_api_compat.device(a)


def on_host(a: Any) -> np.ndarray:
    """Return the values of `a` as a NumPy array: `a` itself if it is one, otherwise a copy."""
    if namespace(a) is np:
        return np.asarray(a)
    try:
        return np.from_dlpack(a, device="cpu", copy=True)
    except (
        BufferError,
        RuntimeError,
        TypeError,
        ValueError,
    ):  # for libraries that cannot export an array directly from its device
        return np.array(np.from_dlpack(array_api_compat.to_device(a, "cpu")))
