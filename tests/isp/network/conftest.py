"""Fixtures of the tests of `isp=network`: models, and captures with the classical colour matrix."""

import importlib.util
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr
from isethdr_isp.develop import floor_e2, solve_matrix
from isethdr_isp.merge import charges


@pytest.fixture(scope="session")
def models():
    """Return the module that writes models."""
    spec = importlib.util.spec_from_file_location(
        "network_models", Path(__file__).with_name("models.py")
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Taken(NamedTuple):
    """Captures, and the matrix from their electrons to XYZ in units of electrons of green."""

    captures: xr.Dataset
    matrix: np.ndarray


@pytest.fixture(scope="session")
def taken(bench):
    """Return a function that makes captures of random light, with the classical matrix."""

    def make(shape=(37, 51), specs=bench.ONE, seed=1, top_e=3000.0, **settings):
        generator = np.random.default_rng(seed)
        mean = generator.uniform(5.0, top_e, shape)
        captures = bench.make(mean, specs, rng=generator, **settings)
        groups, _ = charges(captures, "daylight")
        [read, *_] = groups[-1]
        nm = captures.wavelength.values
        matrix = solve_matrix(read.response, nm, "daylight", 20.0, floor_e2(groups[-1]))
        return Taken(captures, matrix * read.sensitivity[1])

    return make
