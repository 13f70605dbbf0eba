"""Fixtures of the isp tests: captures that keep the contract, and reference numbers of ISETCam."""

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="session")
def bench():
    """Return the module that makes captures from known radiance."""
    spec = importlib.util.spec_from_file_location(
        "make_captures", Path(__file__).with_name("make_captures.py")
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def reference():
    """Return a function that loads one file of reference numbers; skip the test without them."""
    folder = os.environ.get("ISETHDR_REFERENCE")
    if not folder:
        pytest.skip("ISETHDR_REFERENCE is not set: no reference numbers to compare with")
    return lambda name: np.load(Path(folder) / "isetcam" / f"{name}.npz")
