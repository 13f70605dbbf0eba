"""Interpolation wavelengths: kernels of all bands from the lattices of a few wavelengths agree with
kernels from a separate lattice for each band. Where they would not, each band has its own lattice.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, WavefrontLens
from isethdr_optics.psf import interpolation_wavelengths, kernel_sampling_error, wings
from isethdr_optics.psf.kernels import BandPlan, KernelRequest
from isethdr_optics.psf.kernels.lattices import of_lattices
from isethdr_optics.pupil import pupil_energy

DIRT = ApertureFlare()
LENS = WavefrontLens(zernike_um={4: 0.05, 8: 0.03, 12: 0.02})
FRAME = ((10.0, 10.0), (30, 34))  # pitch of the tiles in um, rows and columns


@dataclass(frozen=True)
class Unknown:
    """A pupil that does not declare how its phase depends on wavelength."""

    def pupil(self, x_mm, y_mm, wavelength_nm):
        return np.ones(np.broadcast_shapes(np.shape(x_mm), np.shape(y_mm)))


def plan(lens, flares=(DIRT,), wave=455.0, width=10.0):
    """Return the plan of the kernels of one band: wavelength and width in nm."""
    return BandPlan(lens, flares, (wave, width), wings.Grid(1, *FRAME))


def ring(lens, flares, wave, width=10.0):
    """Return the kernel of one band beyond its exact core, and half the difference between the
    kernels of the two halves of its lattice points.
    """
    of_band = plan(lens, flares, wave, width)
    open_mm2 = pupil_energy.open_energy_mm2(lens, flares, wave)
    return wings.ring(of_band, of_band.reach, wave, width, open_mm2)


def lattice_step_nm(lens, flares=(DIRT,), width=10.0):
    """Return the step between the interpolation wavelengths at 455 nm; 0: the band has its own
    lattice.
    """
    return interpolation_wavelengths._cell(plan(lens, flares, width=width), 455.0, width)[1]


@pytest.mark.parametrize("wave", [440.0, pytest.param(475.0, marks=pytest.mark.slow)])
def test_interpolated_kernels_agree_with_kernels_of_their_own_lattices(monkeypatch, wave):
    stated = interpolation_wavelengths.error(plan(LENS, wave=wave), wave, 10.0)
    interpolated, _ = ring(LENS, (DIRT,), wave)
    monkeypatch.setattr(interpolation_wavelengths, "APART", 0.0)
    assert interpolation_wavelengths.error(plan(LENS, wave=wave), wave, 10.0) == 0.0
    own, own_difference = ring(LENS, (DIRT,), wave)
    beyond_core = own_difference != 0
    l1_error = np.abs(interpolated - own)[beyond_core].sum() / own[beyond_core].sum()
    # the lattices of the interpolation wavelengths have other points, so a part of the sampling
    # error also appears in the difference
    sampling = kernel_sampling_error.by_octave(own_difference, own).max()
    assert 0 < l1_error < stated + 0.3 * sampling
    assert stated < 0.007


@pytest.mark.slow
def test_a_few_lattices_serve_many_bands_and_a_band_does_not_depend_on_the_others(monkeypatch):
    computed_nm = []
    own = wings.own
    monkeypatch.setattr(
        wings,
        "own",
        lambda plan, reach, wave, *rest: computed_nm.append(wave) or own(plan, reach, wave, *rest),
    )
    bands = np.arange(600.0, 651.0, 10.0)
    together = of_lattices(KernelRequest(LENS, (), bands, *FRAME))
    # each is computed at most once for each of the three levels of fineness that bands need
    assert computed_nm and set(computed_nm) <= {540.0, 620.0, 700.0} and len(computed_nm) <= 3 * 3
    alone = of_lattices(KernelRequest(LENS, (), bands[2:5], *FRAME))
    np.testing.assert_array_equal(alone.bands[1], together.bands[3])


def test_a_band_has_its_own_lattice_where_interpolation_would_be_wrong():
    assert lattice_step_nm(LENS) in interpolation_wavelengths.STEPS_NM
    # within 20 nm the phase of this wavefront changes too much for linear interpolation
    assert lattice_step_nm(WavefrontLens(zernike_um={8: 2.0})) == 0
    # a wide band would need two lattices in place of one
    assert lattice_step_nm(LENS, width=50.0) == 0
    # it is not known how the pupil depends on wavelength
    assert lattice_step_nm(LENS, (Unknown(),)) == 0
    # dust with a delay changes its phase too fast
    assert lattice_step_nm(LENS, (ApertureFlare(dust_delay_um=5.0),)) == 0
    # the table ends before the next interpolation wavelength
    table = DiffractionLimitedLens(focal_shift_um={445.0: 0.0, 465.0: 0.1})
    assert lattice_step_nm(table) == 0
