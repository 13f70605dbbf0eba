import numpy as np
import pytest

from isethdr_core.data import quantities


def make_light(values, pitch_um=3.0, wavelength_nm=None, field=None):
    """Return irradiance from a (wavelength, y, x) array on square tiles. `field` is the width and
    height of the nominal field in metres; None means the whole array.
    """
    values = np.asarray(values, float)
    bands, height, width = values.shape
    wavelength = np.linspace(400, 700, bands) if wavelength_nm is None else wavelength_nm
    pitch = pitch_um * 1e-6
    field_width, field_height = field or (width * pitch, height * pitch)
    return quantities.plane(
        values,
        wavelength,
        quantities.centres(width, width * pitch),
        quantities.centres(height, height * pitch),
        quantities.IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=np.pi / 65,
        falloff="none",
        field_width=field_width,
        field_height=field_height,
    )


@pytest.fixture(name="make_light")
def _make_light():
    return make_light


@pytest.fixture
def flat():
    """Return a function that makes uniform light of `level` W m-2 nm-1 in 31 bands."""

    def make(level, height=64, width=64, pitch_um=3.0):
        return make_light(np.full((31, height, width), float(level)), pitch_um)

    return make
