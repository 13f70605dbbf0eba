"""Materials and lamp spectra: values in their physical range, and independent computations."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.lamp_spectra import NAMES, sky_of, spectrum_of
from isethdr_scenes.materials import MATERIALS

from isethdr_core.physics.photometry import luminance

NM = np.arange(360.0, 831.0)


@pytest.mark.parametrize("name", sorted(MATERIALS))
def test_reflectance_is_possible(name):
    material = MATERIALS[name]
    assert material.name == name
    value = material.reflectance.at(NM)
    assert 0 < value.min() and value.max() < 1
    assert np.all(np.diff(material.reflectance.wavelength_nm) > 0)
    assert 0.02 <= material.roughness <= 1 or material.kind in ("thin_glass", "diffuse")


def test_materials_have_the_features_a_camera_sees():
    def at(name, nm):
        return float(MATERIALS[name].reflectance.at(nm))

    for plant in ("leaf", "grass", "meadow", "needle"):
        assert at(plant, 550) > 1.5 * at(plant, 680)  # green peak over the chlorophyll band
        assert at(plant, 760) > 5 * at(plant, 680)  # red edge
    assert at("skin", 650) > 1.5 * at("skin", 550)
    assert at("cloth_red", 640) > 10 * at("cloth_red", 540)
    # the reflectance of asphalt is that of its grains, which cover 30 % of the road: the road is
    # darker
    assert at("asphalt", 550) < 0.2 and at("road_paint", 550) > 0.4


@pytest.mark.parametrize("name", NAMES)
def test_spectra_are_positive_and_scaled_to_one(name):
    s = spectrum_of(name)
    assert min(s.value) >= 0 and max(s.value) == 1.0
    assert luminance(s.at(NM), NM) > 0


def test_halogen_is_a_black_body():
    # Wien's form is within exp(-h c / (lambda k T)) = 1e-3 of Planck's at 650 nm and 3200 K
    second_radiation_nm_k = 1.4387769e7
    ratio = (650 / 450) ** 5 * np.exp(second_radiation_nm_k / 3200 * (1 / 650 - 1 / 450))
    s = spectrum_of("halogen")
    assert s.at(450) / s.at(650) == pytest.approx(ratio, rel=2e-3)


def test_led_gaussians_have_their_centre_and_width():
    for name, centre, width in (("red", 630, 18), ("amber", 592, 16)):
        value = spectrum_of(name).at(NM)
        assert (value * NM).sum() / value.sum() == pytest.approx(centre, abs=0.5)
        # 6 %: sampled every 5 nm and linear between
        assert value.sum() == pytest.approx(width * np.sqrt(np.pi / np.log(2)) / 2, rel=0.06)


def test_sodium_is_yellow_and_led_has_a_blue_peak():
    assert spectrum_of("sodium").at(NM).argmax() == pytest.approx(590 - 360, abs=35)
    led = spectrum_of("led_white")
    assert led.at(450) > 1.5 * led.at(485)


def test_sky_has_its_luminance_by_the_photometry_of_colour_science():
    colour = pytest.importorskip("colour")
    sky = sky_of(4000.0)
    sd = colour.SpectralDistribution(sky.at(NM), NM)
    # 5e-3: V(lambda) of 1924 and another integration rule
    assert colour.luminous_flux(sd) == pytest.approx(4000.0, rel=5e-3)
    assert min(sky.value) > 0
