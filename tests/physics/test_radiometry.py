"""Radiometry: photons, bands, irradiance factors, falloff, black body."""

import numpy as np
import pytest
from scipy.constants import Stefan_Boltzmann

from isethdr_core.physics import radiometry as r


def test_photons_and_energy_are_inverse_and_a_photon_of_1240_nm_has_one_electronvolt():
    w = np.array([400.0, 555.0, 700.0])
    energy = np.random.default_rng(0).uniform(0, 1, (3, 2, 2))
    np.testing.assert_allclose(
        r.energy_from_photons(r.photons_from_energy(energy, w), w), energy, rtol=1e-14
    )
    np.testing.assert_allclose(
        r.photons_from_energy(np.moveaxis(energy, 0, 2), w, axis=2)[0, 0],
        r.photons_from_energy(energy, w)[:, 0, 0],
    )
    assert r.photon_energy_j(1239.841984) == pytest.approx(1.602176634e-19, rel=1e-9)


def test_a_joule_per_nm_is_a_band_s_width_of_photons():
    w = np.array([1229.841984, 1239.841984, 1249.841984])
    # bands of 10 nm; h c is 1239.84 eV nm
    np.testing.assert_allclose(
        r.photons_per_energy(w), 10 * w / 1239.841984 / 1.602176634e-19, rtol=1e-9
    )


def test_bands_tile_the_spectrum():
    w = np.array([400.0, 410.0, 425.0, 430.0])
    widths = r.band_widths_nm(w)
    np.testing.assert_allclose(widths, [10, 12.5, 10, 5])
    # no gap, no overlap, symmetric ends
    assert widths.sum() == pytest.approx((w[-1] + 2.5) - (w[0] - 5))
    np.testing.assert_array_equal(r.band_widths_nm([550.0]), [1.0])


@pytest.mark.parametrize("w", [[700.0, 600.0, 500.0], [500.0, 500.0], [500.0, np.nan, 600.0]])
def test_bands_without_an_order_have_no_width(w):
    with pytest.raises(ValueError, match="expected increasing"):
        r.band_widths_nm(w)


def test_irradiance_factor_is_the_integral_over_the_cone():
    for n in (1.4, 4.0, 16.0):
        angle = np.linspace(0, np.arctan(1 / (2 * n)), 20001)
        cone = np.trapezoid(2 * np.pi * np.sin(angle) * np.cos(angle), angle)
        assert r.irradiance_factor(n) == pytest.approx(cone, rel=1e-7)  # trapezoid on 20000 steps
    # f/0.5 is a hemisphere, the largest possible cone
    assert r.irradiance_factor_aplanatic(0.5) == pytest.approx(np.pi)
    assert r.irradiance_factor_aplanatic(32) == pytest.approx(
        r.irradiance_factor(32), rel=1 / (4 * 32**2)
    )
    # at magnification -1 the image is twice as far away
    assert r.irradiance_factor(4, -1) == pytest.approx(r.irradiance_factor(8))
    with pytest.raises(ValueError, match="0.4 is below 0.5"):
        r.irradiance_factor_aplanatic(0.4)


def test_falloff_is_cos4_of_the_field_angle():
    f = 4e-3
    assert r.cos4_falloff(0.0, 0.0, f) == 1
    np.testing.assert_allclose(
        r.cos4_falloff(f * np.tan(np.radians(30)), 0.0, f), np.cos(np.radians(30)) ** 4
    )
    np.testing.assert_allclose(r.cos4_falloff(3e-3, 4e-3, f), r.cos4_falloff(5e-3, 0.0, f))


def test_black_body_integrates_to_stefan_boltzmann_and_peaks_where_wien_says():
    t = 5000.0
    w = np.geomspace(50, 1e6, 200_001)
    radiance = r.planck_radiance(w, t)
    # the tail beyond 1 mm is 1e-7 of the integral
    assert np.pi * np.trapezoid(radiance, w) == pytest.approx(Stefan_Boltzmann * t**4, rel=1e-4)
    assert w[radiance.argmax()] == pytest.approx(2.897771955e6 / t, rel=1e-4)
