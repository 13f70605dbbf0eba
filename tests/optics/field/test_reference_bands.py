"""Reference bands: the image of a band does not depend on the other bands."""

import numpy as np
import pytest
from isethdr_optics import WavefrontLens
from isethdr_optics.field import field_point_psf
from isethdr_optics.field.field_point_psf import knots
from isethdr_optics.field.reference_bands import references_nm
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.psf import kernels
from isethdr_optics.psf.kernels import KernelRequest

from isethdr_core.conformance.inputs import pattern
from isethdr_core.data import quantities
from isethdr_core.testing import check


@pytest.mark.slow
def test_fewer_bands_leave_the_others_as_they_are():
    """Adjacent bands keep their widths. Field points, reach of cores and interpolation wavelengths
    do not change.
    """
    lens = WavefrontLens(
        f_number=8.0,
        field_zernike_um={0: {}, 15: {8: 0.12, 5: 0.06}},
        focal_shift_um={380.0: -80.0, 720.0: 80.0},
        error_allowed=0.1,
    )
    waves = np.arange(440.0, 641.0, 40.0)
    x = quantities.centres(14, 0.3)
    y = quantities.centres(12, 0.25)
    scene = quantities.plane(pattern((len(waves), 12, 14)), waves, x, y, quantities.RADIANCE)
    every = lens(scene).values
    some = lens(scene.isel(wavelength=slice(3, 5))).values
    np.testing.assert_array_equal(some, every[3:5])


def test_reference_wavelengths_lie_in_the_spectral_range_of_the_bands():
    lens = node_lens(WavefrontLens(field_zernike_um={0: {}, 20: {8: 0.1}}), {}, 0.0)
    assert (
        references_nm(lens, [550.0])
        == references_nm(lens, np.arange(380.0, 781.0, 10.0)[:-1])
        == [400.0, 550.0, 700.0]
    )
    assert references_nm(lens, [940.0]) == [800.0, 1000.0] and references_nm(
        lens, [550.0, 940.0]
    ) == [400.0, 550.0, 700.0, 800.0, 1000.0]
    table = node_lens(WavefrontLens(focal_shift_um={450.0: 9.0, 650.0: 0.0}), {}, 0.0)
    # the reference wavelengths stay within the table
    assert references_nm(table, [500.0, 600.0]) == [460.0, 550.0, 640.0]
    narrow = node_lens(WavefrontLens(focal_shift_um={548.0: 9.0, 552.0: 0.0}), {}, 0.0)
    assert references_nm(narrow, [550.0]) == [550.0]


@pytest.mark.slow
def test_bands_with_too_much_change_for_linear_interpolation_are_exact():
    lens = node_lens(
        WavefrontLens(focal_shift_um={300.0: 0.0, 500.0: 0.0, 540.0: 400.0, 700.0: 400.0}), {}, 0.0
    )
    waves = np.array([440.0, 460.0, 480.0, 500.0, 520.0])
    all_bands, fewer_bands = (
        field_point_psf.field_point_kernels(KernelRequest(lens, (), w, (6.0, 6.0), (6, 6)))
        for w in (waves, waves[1:])
    )
    interpolated = knots.by_interpolation(knots.readings(lens, (), waves, (6, 6)), np.full(5, 20.0))
    assert interpolated.tolist() == [True, True, True, False, False]
    for band, other in zip(all_bands.bands[1:], fewer_bands.bands):
        np.testing.assert_array_equal(band, other)
    exact = kernels.computed(KernelRequest(lens, (), waves, (6.0, 6.0), (6, 6)))
    for k, line in enumerate(interpolated):
        off = np.abs(all_bands.bands[k] - exact.bands[k].astype(float)).sum()
        assert off < 0.02 if line else off == 0  # half a radian between interpolation wavelengths
    np.testing.assert_allclose(all_bands.outside, exact.outside, atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "f_number"), [("singlet", 8.0), ("cooke_triplet", 8.0), ("double_gauss", 8.0)]
)
def test_every_prescription_keeps_the_promises_of_a_lens(name, f_number):
    check("lens", "prescription", prescription=name, f_number=f_number, error_allowed=0.3)
