"""Kernels of a lens with a wavefront from patterns at a few wavenumbers: against direct sums at the
wavelengths of the bands, and against kernels with a lattice for each band.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, WavefrontLens
from isethdr_optics.psf import kernels, phase_patterns, scaled_pattern
from isethdr_optics.psf.kernels import KernelRequest
from isethdr_optics.psf.kernels.patterns import phase_frame

COMA = WavefrontLens(focal_length_mm=6.0, zernike_um={7: 0.05})
DIRT = (ApertureFlare(),)
BANDS = np.array([420.0, 430.0])
PITCH = (3.0, 3.0)
REACH = (88, 104)


def frame_of(lens, bands=BANDS, reach=REACH):
    return phase_frame(KernelRequest(lens, DIRT, bands, PITCH, reach))


@pytest.fixture(scope="module")
def made():
    return kernels.computed(KernelRequest(COMA, DIRT, BANDS, PITCH, REACH))


@pytest.mark.slow
def test_they_agree_with_direct_sums(made):
    """Compare with direct sums in columns that the error estimate does not use, on both sides of
    the axis.
    """
    frame = frame_of(COMA)
    assert made.speckle.max() < 0.03 and made.core[0] == min(frame.core)
    for turned in (False, True):
        kernel = made.bands[1][::-1, ::-1] if turned else made.bands[1]
        place = 80, 1, turned
        wrong, light = phase_patterns._wrong(frame, kernel, place, map)
        # 1.5: the errors of single columns vary by half
        assert np.abs(wrong).sum() < 1.5 * made.speckle.max() * light.sum()
        assert abs(wrong.sum()) < 0.003 * light.sum()


@pytest.mark.slow
def test_they_agree_with_kernels_of_lattices_of_their_own(made, monkeypatch):
    monkeypatch.setattr(phase_patterns, "serves", lambda *given: False)
    other = kernels.computed(KernelRequest(COMA, DIRT, BANDS, PITCH, REACH))
    for own, theirs, core in zip(made.bands, other.bands, made.core.astype(int)):
        y, x = (np.abs(np.arange(n) - n // 2) for n in own.shape)
        beyond = np.maximum(y[:, None], x) > core
        assert np.array_equal(own[~beyond], theirs[~beyond])
        # 0.025: the error of the lattices themselves is 0.02
        assert np.abs(own - theirs)[beyond].sum() < 0.025 * theirs[beyond].sum()
        assert own[beyond].sum() == pytest.approx(theirs[beyond].sum(), rel=2e-3)
        turned = theirs[::-1, ::-1]
        assert np.abs(own - turned)[beyond].sum() > 0.2 * theirs[beyond].sum()


def test_a_wavefront_of_nothing_gives_the_kernels_without_phase():
    """Compare patterns of a negligible wavefront with those of a lens without phase.

    Patterns at one wavenumber use the same lattices, rays and tiles, but over the whole plane
    instead of half of it.
    """
    flat = replace(COMA, zernike_um={7: 1e-9})
    plain = DiffractionLimitedLens(focal_length_mm=6.0)
    frame = frame_of(flat)
    assert len(phase_patterns.wavenumbers(frame)) == 1
    whole = np.zeros((2, 2 * REACH[0] + 1, 2 * REACH[1] + 1), np.float32)
    read = replace(scaled_pattern.USUAL, period=3.0)
    phase_patterns.wings(frame, read, whole)
    core = np.zeros((2, frame.core[0] + 1, 2 * frame.core[1] + 1), np.float32)
    without = replace(frame, request=replace(frame.request, lens=plain))
    half = scaled_pattern.halves(without, core, read)
    for own, theirs in zip(whole, half):
        lit = theirs > 0
        np.testing.assert_allclose(own[REACH[0] :][lit], theirs[lit], rtol=2e-3, atol=1e-12)
        np.testing.assert_allclose(
            own[REACH[0] :: -1, ::-1][lit], theirs[lit], rtol=2e-3, atol=1e-12
        )


def test_the_errors_are_those_of_the_band_that_is_farthest_off(monkeypatch):
    """Replace the direct sums by a known pattern. Kernels that are a constant factor brighter have
    the same relative error in every octave.
    """
    frame = frame_of(COMA)
    y, x = (np.arange(-r, r + 1.0) for r in REACH)
    pattern = np.maximum(np.hypot(y[:, None], x), 1.0) ** -3

    def columns(pupil, place, *more):
        first = REACH[1] + place.first
        return pattern[:, first : first + place.count]

    monkeypatch.setattr(phase_patterns.pattern_columns, "columns_with_phase", columns)
    found = phase_patterns.errors(frame, np.stack([1.01 * pattern, 1.02 * pattern]))
    assert found.mean == pytest.approx(0.02)
    seen = found.relative > 0
    assert seen.sum() >= 2
    np.testing.assert_allclose(found.relative[seen], 0.02)


def test_which_lenses_they_serve():
    assert frame_of(COMA) is not None
    assert frame_of(DiffractionLimitedLens(focal_length_mm=6.0)) is None
    assert frame_of(replace(COMA, focal_shift_um={380.0: 0.0, 780.0: 5.0})) is None
    assert frame_of(replace(COMA, zernike_um={7: 30.0})) is None  # too many wavenumbers
    assert (
        phase_frame(KernelRequest(COMA, (ApertureFlare(dust_delay_um=0.2),), BANDS, PITCH, REACH))
        is None
    )
    bands = np.arange(400.0, 701.0, 10.0)
    assert len(phase_patterns.wavenumbers(frame_of(COMA, bands))) == 3
