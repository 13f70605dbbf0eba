"""Wavelengths of a band: enough of them for an exact core that averages the band without error."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, WavefrontLens
from isethdr_optics.psf import exact_core, kernel_sampling_error, kernels, wings
from isethdr_optics.psf.exact_core import Wavelengths
from isethdr_optics.psf.kernels import BandPlan, KernelRequest
from isethdr_optics.pupil import pupil_grid

from isethdr_core import build

LENS = build("lens", "diffraction_limited", f_number=4.0, focal_length_mm=4.0)
COMA = WavefrontLens(f_number=4.0, focal_length_mm=4.0, zernike_um={8: 0.05})
HEXAGON = (ApertureFlare(blades=6),)
DELAYED = (ApertureFlare(blades=6, dust_per_mm2=40.0, dust_delay_um=1.0),)
# wavelengths of bands with one from 525 to 575 nm, and the ten narrow bands that it consists of
BAND = [500.0, 550.0, 600.0]
PARTS = np.arange(527.5, 573.0, 5.0)


def tiles(wavelength_nm, reach):
    request = KernelRequest(LENS, (), wavelength_nm, (1.0, 1.0), (reach, reach))
    return [np.asarray(band, float) for band in kernels.computed(request).bands]


def errors_of_a_band(lens, flares, band_nm, pitch_um=3.0, tiles=12, many=1.5):
    """Return the errors per octave of a core, against `many` times its wavelengths, and these."""
    plan = BandPlan(lens, flares, band_nm, wings.Grid(1, (pitch_um,) * 2, (tiles, tiles)))
    centre, width = band_nm
    few = plan.wavelengths(centre, width)
    place, weight = np.polynomial.legendre.leggauss(int(many * len(few.nm)) + 2)
    more = Wavelengths(centre + place * width / 2, weight / 2)
    one, want = (exact_core.exact_core(plan, *band_nm, waves, 1.0) for waves in (few, more))
    wrong = one - want + 1e-30 * want  # an error of exactly 0 would not count
    return kernel_sampling_error.by_octave(wrong, want), few


@pytest.mark.parametrize("reach", [12, 60])
def test_a_band_is_the_mean_of_its_parts(reach):
    few = tiles(BAND, reach)[1]
    parts = np.mean(tiles(PARTS, reach), axis=0)
    # 2e-6 of a point's light, summed over all tiles, is rounding to float32. The same number of
    # midpoints of equal parts would err by 5e-4 and 1.1e-3
    assert np.abs(few - parts).sum() < 2e-6 and few.sum() == pytest.approx(parts.sum(), rel=1e-6)


@pytest.mark.parametrize(
    ("lens", "flares", "band_nm", "tiles"),
    [
        (LENS, HEXAGON, (550.0, 50.0), 12),
        (COMA, HEXAGON, (550.0, 50.0), 12),
        pytest.param(LENS, DELAYED, (550.0, 30.0), 12, marks=pytest.mark.slow),
        pytest.param(COMA, HEXAGON, (400.0, 10.0), 60, marks=pytest.mark.slow),
        pytest.param(
            WavefrontLens(zernike_um={4: 2.0}), (), (550.0, 20.0), 30, marks=pytest.mark.slow
        ),
    ],
)
def test_wavelengths_of_any_exact_core_leave_no_error(lens, flares, band_nm, tiles):
    """Compare with more wavelengths, for wavefronts, for dust with a delay, and in small frames.

    The same number of midpoints of equal parts would err by 2e-3 to 5e-3 in the outermost octave.
    """
    left, _ = errors_of_a_band(lens, flares, band_nm, tiles=tiles)
    assert 0 < left.max() < 3e-4


def test_there_are_as_many_as_the_pattern_moves_by_speckles():
    """The number of wavelengths follows from the shift of the pattern over the band, in speckles.

    At 120 um along both axes, the pattern moves by 170 um x 50 / 550 over the band, which is seven
    times f-number x wavelength. A band of 1 nm needs one wavelength for a part of a speckle and the
    two that are always added. Tiles finer than speckles do not average the finest rings, so they
    need more wavelengths.
    """
    for wave, width in ((500.0, 50.0), (550.0, 50.0), (550.0, 1.0)):
        moved = np.hypot(120, 120) * width / wave / (4e-3 * wave)
        for reach, pitch_um, dense in ((30, 4.0, 1.0), (120, 1.0, 1.75)):
            grid = wings.Grid(1, (pitch_um, pitch_um), (reach, reach))
            waves = BandPlan(LENS, (), (wave, width), grid).wavelengths(wave, width)
            assert len(waves.nm) == np.ceil(dense * moved) + 2
            assert waves.weight.sum() == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lens", "flares", "tiles"),
    [
        (LENS, DELAYED, 30),
        (COMA, (), 40),
        (COMA, HEXAGON, 60),
        (WavefrontLens(zernike_um={4: 1.0}), (), 40),
        (WavefrontLens(f_number=2.8, zernike_um={4: 0.2, 8: 0.5}), HEXAGON, 30),
    ],
)
def test_cells_of_the_pupil_leave_at_most_what_is_stated(lens, flares, tiles):
    """Compare with cells of half the width.

    Their own error is a quarter of that of the usual cells, so the difference may be up to 1.25
    times the error. It is weighted by 0.7.
    """
    centre = 450.0
    width = 10.0
    plan = BandPlan(lens, flares, (centre, width), wings.Grid(1, (3.0, 3.0), (tiles, tiles)))
    waves = plan.wavelengths(centre, width)
    energy = 1.0 if plan.energy is None else plan.energy
    usual = exact_core.exact_core(plan, centre, width, waves, energy)
    step = plan.axis[1] - plan.axis[0]
    plan.axis = pupil_grid.axis_mm(lens, step / 2)
    finer = exact_core.exact_core(plan, centre, width, waves, energy)
    stated = exact_core.core_error_by_octave(exact_core.CELLS_AT_BORDER, tiles)
    found = kernel_sampling_error.by_octave(usual - finer, finer)
    assert (0.7 * found <= stated).all()
    inner = 2.0 ** np.arange(len(stated))
    deviation = exact_core.core_error(exact_core.CELLS_DEVIATION, 2 * inner, tiles)
    assert (0.7 * kernel_sampling_error.deviation(usual - finer, finer) <= deviation).all()
