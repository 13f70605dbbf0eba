"""Far kernels: a folded wavefront against the plain product, and pupils with and without phase against each other."""

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, WavefrontLens
from isethdr_optics.kernels import kernels
from isethdr_optics.pupils import amplitude, axis_mm, folded_with_wavefront, opd_um, phase_mean, with_wavefront

from isethdr_core.errors import ConfigError
from isethdr_core.physics.diffraction import lattice_psf

ABERRATED = WavefrontLens(zernike_um={4: 0.2, 8: -0.1})


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.3, -0.4)])
def test_folded_product_equals_product_folded(offset):
    x, y, period = axis_mm(ABERRATED, 0.004), axis_mm(ABERRATED, 0.003), (150, 110)
    cells = amplitude(ABERRATED, [ApertureFlare()], x, y, 550.0)
    opd = opd_um(ABERRATED, x, y, 550.0)
    got = folded_with_wavefront(cells * phase_mean(opd / 0.55), opd, 550.0, period, offset)
    arguments = period, 4.0, (50, 40), (4.0, 4.0), 1.0, offset
    want = lattice_psf(with_wavefront(ABERRATED, cells, x, y, 550.0), 550.0, *arguments)
    np.testing.assert_allclose(lattice_psf(got, 550.0, *arguments, folded=True), want, atol=1e-5 * want.max())  # float32 phases


def test_a_pupil_with_hardly_any_phase_has_the_rings_of_one_without():
    y, x = np.indices((241, 241)) - 120
    r = np.hypot(y, x)
    plain, hardly = (
        kernels(lens, (), np.array([550.0]), (4.0, 4.0), (120, 120)).bands[0]
        for lens in (DiffractionLimitedLens(), WavefrontLens(zernike_um={4: 1e-6}))
    )
    for low, high in ((65, 80), (80, 100), (100, 120)):
        ring = (r >= low) & (r < high)
        # Sums of single points of one wavelength; and the field wraps, more where the lattice is not shared.
        assert hardly[ring].sum(dtype=float) == pytest.approx(plain[ring].sum(dtype=float), rel=0.05)


def test_a_defocused_pattern_keeps_its_light():
    # 20 waves at the rim: 350 um of geometric blur in a frame of 660 um; beyond it lies less than 1 % of a point's light
    lens = WavefrontLens(zernike_um={4: 20 * 0.55 / (2 * np.sqrt(3))})
    [band] = kernels(lens, (), np.array([550.0]), (12.0, 12.0), (27, 27)).bands
    assert 0.985 < band.sum(dtype=float) < 1.001
    [psf] = lens.psf(550.0, 12.0, 55, integrated=True).values
    assert 0.985 < psf.sum() < 1.001


def test_a_wavefront_too_steep_for_its_cells_is_refused():
    axis = axis_mm(ABERRATED, 0.05)
    with pytest.raises(ConfigError, match="per pupil sample"):
        opd_um(WavefrontLens(zernike_um={4: 2.0}), axis, axis, 550.0)
