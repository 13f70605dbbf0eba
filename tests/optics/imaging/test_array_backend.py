"""Bands convolved by another array library than NumPy, selected by an environment variable."""

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens
from isethdr_optics.imaging import array_backend
from isethdr_optics.imaging.field_optics import _kernels
from isethdr_optics.psf.kernels import KernelRequest

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build

LENS = DiffractionLimitedLens(focal_length_mm=6.0)
DIRT = (ApertureFlare(),)
OTHERS = {"array_api_strict:device1": "array_api_strict", "torch": "torch"}


@pytest.fixture(params=list(OTHERS))
def library(request, monkeypatch):
    pytest.importorskip(OTHERS[request.param])
    monkeypatch.setenv("ISETHDR_ARRAYS", request.param)
    return monkeypatch


def street(dtype=np.float32):
    light = np.random.default_rng(2).uniform(0.5, 1.5, (2, 30, 40)).astype(dtype)
    light[:, 8:10, 12:15] = 1e8
    y, x = (quantities.centres(n, n * 0.0008) for n in light.shape[1:])
    return quantities.plane(1e-6 * light, np.array([540.0, 560.0]), x, y, quantities.RADIANCE)


def test_a_lens_gives_the_same_light_there(library):
    theirs = LENS(street(), DIRT).values
    library.delenv("ISETHDR_ARRAYS")
    # either transform may err by 3e-8 of a pixel, and the light is rounded to float32, 6e-8
    np.testing.assert_allclose(theirs, LENS(street(), DIRT).values, rtol=2.4e-7)


def test_kernels_are_sent_once(library):
    sent = []
    put = array_backend.device_transfer()

    def counting(a):
        sent.append(np.size(a))
        return put(a)

    library.setattr(array_backend, "device_transfer", lambda: counting)
    # count transfers of whole kernels only; the transforms of half kernels stay in host memory
    made = _kernels(KernelRequest(LENS, (), np.array([540.0, 560.0]), (4.0, 4.0), (29, 39)))
    largest = max(k.spectrum.size for k in made.spectra.kernels)
    library.setattr("isethdr_optics.imaging.field_optics._kernels", lambda *how: made)
    for _ in range(2):
        LENS(street(), ())
    assert sent.count(largest) == 2  # two bands, and two images


def test_a_sensor_gets_irradiance_from_there(library):
    response = build("sensor", "bayer").narrow(Demand()).response
    assert LENS.photocurrent(street(), DIRT, response).dims == quantities.MIXED_DIMS


@pytest.mark.parametrize(
    ("name", "what"),
    [("no_such_library", "No module named"), ("array_api_strict:device9", "device9")],
)
def test_what_is_not_there_is_refused_when_a_lens_is_built(monkeypatch, name, what):
    pytest.importorskip("array_api_strict")
    monkeypatch.setenv("ISETHDR_ARRAYS", name)
    with pytest.raises(ConfigError, match=f"ISETHDR_ARRAYS is.*{what}.*torch:cuda"):
        DiffractionLimitedLens(focal_length_mm=6.0)
