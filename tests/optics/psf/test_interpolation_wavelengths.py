"""Interpolation wavelengths: lattices of a few wavelengths for all bands, against lattices of each
band's own; when they are not used.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, WavefrontLens
from isethdr_optics.psf import interpolation_wavelengths, kernel_sampling_error, wings
from isethdr_optics.psf.kernels import _computed, _Plan
from isethdr_optics.pupil import sampled_pupil

DIRT = ApertureFlare()
LENS = WavefrontLens(zernike_um={4: 0.05, 8: 0.03, 12: 0.02})
AT = ((10.0, 10.0), (30, 34))


@dataclass(frozen=True)
class Unknown:
    """A pupil of which nobody knows how its phase goes with wavelength."""

    def pupil(self, x_mm, y_mm, wavelength_nm):
        return np.ones(np.broadcast_shapes(np.shape(x_mm), np.shape(y_mm)))


def plan(lens, flares=(DIRT,), wave=455.0, width=10.0):
    return _Plan(lens, flares, (wave, width), wings.Grid(1, *AT))


def ring(lens, flares, wave, width=10.0):
    given = plan(lens, flares, wave, width)
    return wings.ring(
        given,
        given.reach,
        wave,
        width,
        sampled_pupil.open_energy_mm2(lens, flares, wave),
    )


@pytest.mark.parametrize("wave", [440.0, pytest.param(475.0, marks=pytest.mark.slow)])
def test_between_interpolation_wavelengths_kernels_are_those_of_lattices_of_their_own(
    monkeypatch, wave
):
    straight = interpolation_wavelengths.error(plan(LENS, wave=wave), wave, 10.0)
    kernel, wrong = ring(LENS, (DIRT,), wave)
    monkeypatch.setattr(interpolation_wavelengths, "APART", 0.0)
    assert interpolation_wavelengths.error(plan(LENS, wave=wave), wave, 10.0) == 0.0
    own, own_wrong = ring(LENS, (DIRT,), wave)
    seen = own_wrong != 0
    found = np.abs(kernel - own)[seen].sum() / own[seen].sum()
    # the lattices of two wavelengths have other points: that is part of what both halves differ by
    assert (
        0 < found < straight + 0.3 * kernel_sampling_error.by_octave(own_wrong, own).max()
        and straight < 0.007
    )


@pytest.mark.slow
def test_a_few_lattices_serve_many_bands_and_a_band_does_not_depend_on_the_others(monkeypatch):
    made = []
    own = wings.own
    monkeypatch.setattr(
        wings,
        "own",
        lambda plan, reach, wave, *rest: made.append(wave) or own(plan, reach, wave, *rest),
    )
    bands = np.arange(600.0, 651.0, 10.0)
    together = _computed(LENS, (), bands, *AT)
    # at most once for each fineness that bands ask for
    assert set(made) <= {540.0, 620.0, 700.0} and len(made) <= 3 * 3
    alone = _computed(LENS, (), bands[2:5], *AT)
    np.testing.assert_array_equal(alone.bands[1], together.bands[3])


def test_what_is_not_known_there_or_changes_too_fast_has_its_own():
    assert (
        interpolation_wavelengths._cell(plan(LENS), 455.0, 10.0)[1]
        in interpolation_wavelengths.STEPS_NM
    )
    # 20 nm change it by more than a line follows
    assert (
        interpolation_wavelengths._cell(plan(WavefrontLens(zernike_um={8: 2.0})), 455.0, 10.0)[1]
        == 0
    )
    # two lattices in place of one
    assert interpolation_wavelengths._cell(plan(LENS, width=50.0), 455.0, 50.0)[1] == 0
    assert interpolation_wavelengths._cell(plan(LENS, (Unknown(),)), 455.0, 10.0)[1] == 0
    assert (
        interpolation_wavelengths._cell(
            plan(LENS, (ApertureFlare(dust_delay_um=5.0),)), 455.0, 10.0
        )[1]
        == 0
    )
    table = DiffractionLimitedLens(focal_shift_um={445.0: 0.0, 465.0: 0.1})
    # the table ends before the next interpolation wavelength
    assert interpolation_wavelengths._cell(plan(table), 455.0, 10.0)[1] == 0
