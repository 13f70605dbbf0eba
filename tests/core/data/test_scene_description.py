"""Descriptions of scenes: spectra."""

import numpy as np
import pytest

from isethdr_core.data.scene_description import Spectrum
from isethdr_core.errors import ConfigError


def test_a_spectrum_is_linear_between_its_values_and_constant_beyond():
    spectrum = Spectrum((400.0, 500.0, 700.0), (1.0, 3.0, 2.0))
    assert spectrum.at(np.array([300.0, 450.0, 600.0, 800.0])).tolist() == [1.0, 2.0, 2.5, 2.0]


@pytest.mark.parametrize(
    ("wavelength_nm", "value", "match"),
    [
        ((700.0, 400.0), (1.0, 2.0), "has 400 nm after 700 nm; expected wavelengths that rise"),
        ((400.0, 400.0), (1.0, 2.0), "has 400 nm after 400 nm; expected wavelengths that rise"),
        ((400.0, float("nan")), (1.0, 2.0), "has nan nm after 400 nm; expected wavelengths"),
        ((400.0, 500.0), (1.0,), "the lengths 2 and 1; expected equal lengths"),
        ((), (), "the lengths 0 and 0; expected equal lengths of at least 1"),
    ],
)
def test_wavelengths_that_do_not_rise_and_missing_values_are_refused(wavelength_nm, value, match):
    with pytest.raises(ConfigError, match=match):
        Spectrum(wavelength_nm, value)
