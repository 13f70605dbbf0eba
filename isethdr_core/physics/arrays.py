"""Arrays of other libraries than NumPy, those with the Python array API: on a graphics processor,
say.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any

import array_api_compat
import numpy as np


def imported_library(name: str) -> ModuleType:
    """Import the array library that a user has named, for example "torch".

    Raises
    ------
    ImportError : it is not installed.
    """
    return import_module(name)


def namespace(a: Any) -> Any:
    """Return the array library of `a`, by the names of the Python array API; NumPy for what is no
    array.
    """
    if isinstance(a, np.ndarray) or not array_api_compat.is_array_api_obj(a):
        return np
    return array_api_compat.array_namespace(a)


def device(a: Any) -> Any:
    """Return the device on which `a` lies, for new arrays beside it."""
    return "cpu" if isinstance(a, np.ndarray) else array_api_compat.device(a)


def on_host(a: Any) -> np.ndarray:
    """Return the values of `a` as a NumPy array: `a` itself where it is one, else a copy."""
    if namespace(a) is np:
        return np.asarray(a)
    try:
        return np.from_dlpack(a, device="cpu", copy=True)
    except (
        BufferError,
        RuntimeError,
        TypeError,
        ValueError,
    ):  # libraries that do not hand over what lies on a device
        return np.array(np.from_dlpack(array_api_compat.to_device(a, "cpu")))
