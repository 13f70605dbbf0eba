"""The allowed error of a lens: irradiance and photocurrent keep it, and 0 means exact."""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, WavefrontLens
from isethdr_optics.field import kernels_of_field, point_choice
from isethdr_optics.imaging.overlap_add import overlaid

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.plugins.registry import build

BANDS = np.arange(400.0, 701.0, 20.0)
SHAPE = (24, 32)
FIELD = 0.016
LENS = DiffractionLimitedLens(focal_length_mm=6.0)


def night():
    """Return mixed radiance of a dark road with random light and lamps 1e9 times as bright."""
    cube = np.random.default_rng(0).uniform(1, 2, (len(BANDS), *SHAPE)) * 4e-6
    cube[:, 5, 6] = cube[:, 18, 25] = 4e3
    y, x = (quantities.centres(n, FIELD * n / SHAPE[1]) for n in SHAPE)
    return quantities.plane(cube.astype(np.float32), BANDS, x, y, quantities.RADIANCE)


@pytest.mark.parametrize("allowed", [1e-2, 1e-4])
def test_irradiance_is_within_what_is_allowed(allowed):
    exact = LENS(night()).values
    light = LENS(night(), error_allowed=allowed).values
    assert (light >= 0).all()
    assert np.abs(light / exact - 1).max() <= allowed + 2e-7  # both are rounded to float32


@pytest.mark.slow
def test_a_lens_that_varies_over_the_field_is_told_too(monkeypatch):
    told = []
    monkeypatch.setattr(
        kernels_of_field,
        "overlaid",
        lambda parts, shape, allowed: told.append(allowed) or overlaid(parts, shape, allowed),
    )
    lens = WavefrontLens(
        focal_length_mm=6.0, field_zernike_um={0: {}, 8: {4: 0.06}}, error_allowed=0.5
    )
    monkeypatch.setattr(point_choice, "RINGS", (1,))
    scene = night().isel(wavelength=slice(0, 16, 8))
    exact = lens(scene).values
    light = lens(scene, error_allowed=1e-3).values
    assert told == [0.0, 0.0, 1e-3, 1e-3]
    assert (light >= 0).all() and np.abs(light / exact - 1).max() <= 1e-3
    sensor = build("sensor", "bayer", pitch_um=3.0)
    response = replace(sensor.narrow(Demand()).response, noise_fraction_allowed=0.5)
    lens.photocurrent(scene, (), response)  # two bands only, so it returns irradiance
    assert 0 < told[-1] <= response.error_allowed


@pytest.mark.parametrize("fraction", [1.0, 0.01])
def test_photocurrent_is_within_its_share_of_the_noise(fraction):
    sensor = build("sensor", "bayer", pitch_um=3.0)
    response = replace(sensor.narrow(Demand()).response, noise_fraction_allowed=fraction)
    found, exact = (
        sensor.expected(light).values
        for light in (LENS.photocurrent(night(), (), response), LENS(night()))
    )
    dark = exact < response.full_scale_e
    noise = np.sqrt(exact + response.read_noise_e**2)
    assert dark.any() and (np.abs(found - exact) / noise)[dark].max() < fraction
    np.testing.assert_allclose(
        found[~dark], exact[~dark], rtol=2 * fraction / np.sqrt(response.full_scale_e)
    )
