"""Means over tiles and bands of a pattern that scales with wavelength, and columns of tiles
computed
directly from chords: both against the closed form of a clean round stop.
"""

import numpy as np
import pytest

from isethdr_core.physics.optics import half_plane_pattern as patterns
from isethdr_core.physics.optics import pattern_columns, ray_sums
from isethdr_core.physics.optics.diffraction import integrated_airy
from isethdr_core.physics.optics.pupil import disc

RADIUS_MM = 0.5
DISTANCE_MM = 4.0
PITCH_UM = 3.0
ROUND = patterns.RealPupil(
    [(disc(0.0, 0.0, RADIUS_MM), 1.0)], RADIUS_MM, DISTANCE_MM, np.pi * RADIUS_MM**2
)
REACH = 60


def airy(band_nm, count):
    """Return the kernel of a clean round stop, averaged over `count` wavelengths of a band."""
    low, high = band_nm
    waves = low + (np.arange(count) + 0.5) / count * (high - low)
    size = (2 * REACH + 1,) * 2
    return sum(
        integrated_airy(RADIUS_MM, w, DISTANCE_MM, size, (PITCH_UM,) * 2, boxes=2) for w in waves
    ) / len(waves)


@pytest.mark.parametrize("band_nm", [(549.9, 550.1), (540.0, 560.0)])
def test_columns_of_a_round_stop_are_those_of_its_closed_form(band_nm):
    place = pattern_columns.Place(30, 8, REACH, (PITCH_UM,) * 2, band_nm)
    found = pattern_columns.columns(ROUND, place)
    want = airy(band_nm, 1 if band_nm[0] > 549 else 12)[:, REACH + 30 : REACH + 38]
    # 0.5 %: samples at 0.42 wavelength x f-number, weighted by triangles, which have kinks
    assert np.abs(found - want).sum() < 0.005 * want.sum()


def test_columns_beside_the_axis_hold_the_pattern_on_it():
    """Include samples on the axis: at frequency 0 the integral of a chord is its length.

    The general formula would be 0 / 0 there.
    """
    pitch_um = 1.0  # at f/4 the tiles of the first columns take samples on the axis
    place = pattern_columns.Place(1, 2, 12, (pitch_um,) * 2, (549.9, 550.1), step=0.1)
    with np.errstate(all="raise"):
        found = pattern_columns.columns(ROUND, place)
    airy = integrated_airy(RADIUS_MM, 550.0, DISTANCE_MM, (25, 25), (pitch_um,) * 2, boxes=2)
    want = airy[:, 13:15]
    # 1 %: samples at 0.1 wavelength x f-number, weighted by triangles, which have kinks
    assert np.abs(found - want).sum() < 0.01 * want.sum()


def test_rays_give_the_means_of_every_band():
    edges = np.array([[400.0, 420.0], [540.0, 560.0], [690.0, 710.0]])
    blur_um = 0.4 * DISTANCE_MM / (2 * RADIUS_MM)
    lattice = patterns.half_lattice([(REACH + 2) * PITCH_UM] * 2, 0.4 * blur_um)
    pattern = patterns.half_pattern(ROUND, 400.0, lattice)
    across, along = ray_sums.sectors(pattern, (PITCH_UM, PITCH_UM), edges)
    low = 30
    blocks = []
    for less, sector in enumerate((across, along)):
        for ring in ray_sums.rings(low, REACH):
            ring = ray_sums.Ring(*ring, REACH, less)
            ray_sums.band_means([sector], ring, 3.0, 4, lambda b, s=less: blocks.append((s, b)))
    for number, band in enumerate(edges):
        want = airy(band, 12)
        wrong = 0.0
        light = 0.0
        for less, block in blocks:
            for k, values in enumerate(block.values[number]):
                major = block.first + k
                i = np.arange(less - major, major - less + 1)
                own = values[len(values) // 2 + i]
                true = (
                    want[REACH + i, REACH + major] if not less else want[REACH + major, REACH + i]
                )
                wrong = wrong + np.abs(own - true).sum()
                light = light + true.sum()
        assert wrong < 0.02 * light  # the error for which lattices of this step are meant


def test_a_wide_pupil_is_summed_modulo_the_period():
    """The pattern at samples farther apart than wavelength x f-number equals that at finer ones."""
    step = 0.35 * 0.55 * DISTANCE_MM / (2 * RADIUS_MM)
    fine = patterns.half_pattern(ROUND, 550.0, patterns.half_lattice((150.0, 150.0), step))
    coarse = patterns.half_pattern(ROUND, 550.0, patterns.half_lattice((150.0, 150.0), 4 * step))
    far = 25  # number of samples of the coarse pattern
    some = fine.density[: 4 * far : 4, fine.middle - 4 * far : fine.middle + 4 * far + 1 : 4]
    same = coarse.density[:far, coarse.middle - far : coarse.middle + far + 1]
    # float32 sums of cells of order 1 err by 1e-7 of the peak's amplitude
    np.testing.assert_allclose(same, some, rtol=0.02, atol=3e-7 * some.max())
