"""Lattices: all points of a frame against the closed form of a round pupil and against chirp-z
transforms.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.special import j1

from isethdr_core.physics.diffraction import sampled_psf
from isethdr_core.physics.optics import half_plane_pattern, lattice, pattern_columns
from isethdr_core.physics.optics.lattice import (
    ORDER,
    ImageSamples,
    binomial_response,
    fold_cells,
    fold_shapes,
    lattice_pitch_mm,
    lattice_psf,
    spline_response,
    spline_taps,
)
from isethdr_core.physics.optics.pupil import blades, disc, opening, raster
from isethdr_core.physics.optics.zernike import wavefront_um

WAVE = 550.0
FOCAL = 4.0
RADIUS = 0.5
OPEN = np.pi * RADIUS**2


def drawn(period, pitch, reach, offset=(0.0, 0.0), terms=None):
    cells = lattice_pitch_mm(WAVE, period, FOCAL, pitch)
    pupil = fold_shapes(terms or opening(disc(0, 0, RADIUS), []), RADIUS, cells, period, offset)
    return lattice_psf(
        pupil, ImageSamples(WAVE, FOCAL, pitch, offset), reach, OPEN, spline_response
    )


def celled(period, pitch, reach, offsets, zernike_um, rows=37):
    """Return the pattern as `drawn` does, from half cells that are passed in blocks of `rows`."""
    cells = lattice_pitch_mm(WAVE, period, FOCAL, pitch)
    count = [2 * (int(np.ceil(RADIUS / c)) + 1) for c in cells]
    y, x = ((np.arange(2 * n) + 0.5 - n) * c / 2 for n, c in zip(count, cells))
    whole = raster(opening(disc(0, 0, RADIUS), []), x, y) * np.exp(
        2j * np.pi * wavefront_um(zernike_um, x / RADIUS, y / RADIUS) / 0.55
    )
    blocks = ((s, 3, whole[s : s + rows, 3:].astype(np.complex64)) for s in range(0, len(y), rows))
    return [
        lattice_psf(p, ImageSamples(WAVE, FOCAL, pitch, o), reach, OPEN, binomial_response)
        for p, o in zip(fold_cells(blocks, period, offsets), offsets)
    ]


def airy(pitch, reach, offset=(0.0, 0.0)):
    y, x = ((np.arange(-r, r + 1) + o) * p for r, p, o in zip(reach, pitch, offset))
    v = np.pi * np.hypot(y[:, None], x) / (0.55 * 4) + 1e-12
    return (2 * j1(v) / v) ** 2 * np.pi / 4 * pitch[0] * pitch[1] / 2.2**2, v


def test_spline_taps_are_boxes_convolved():
    """Compare with a fine numerical convolution: a B-spline of degree 3 is the convolution of four
    boxes (Unser 1999).
    """
    box = np.full(400, 1 / 400)
    smooth = box
    for _ in range(3):
        smooth = np.convolve(smooth, box)
    t = (np.arange(400) + 0.5) / 400
    want = (smooth * 400)[: 4 * 400 - 3]
    for k, tap in enumerate(spline_taps(t, 3)):
        at = (3 - k) * 400 + np.arange(400)  # the first tap is the last piece
        inside = at < len(want)
        # the boxes have steps of 1/400 and are shifted by two steps
        np.testing.assert_allclose(tap[inside], want[at[inside]], atol=5e-3)
    np.testing.assert_allclose(sum(spline_taps(t, ORDER)), 1.0, atol=1e-13)  # rounding


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.5, 0.5), (0.3, -0.4)])
@pytest.mark.parametrize("way, inside, border", [("shapes", 0.02, 0.06), ("cells", 0.1, 0.2)])
def test_the_airy_pattern_to_the_border(way, inside, border, offset):
    """Compare every point of a frame with the Airy pattern.

    The frame is two thirds of the period wide, so light that wraps to its border comes from twice
    the distance.
    """
    pitch = (6.0, 7.0)
    reach = (100, 120)
    period = (300, 360)
    got = (
        drawn(period, pitch, reach, offset)
        if way == "shapes"
        else celled(period, pitch, reach, [(0.0, 0.0), offset], {})[1]
    )
    want, v = airy(pitch, reach, offset)
    # errors are relative to the envelope of the rings' amplitude, 2 sqrt(2 / pi) v^-1.5, since the
    # rings themselves have zeros
    envelope = np.minimum(1.0, 2 * np.sqrt(2 / np.pi) * v**-1.5) * np.sqrt(
        np.pi / 4 * pitch[0] * pitch[1] / 2.2**2
    )
    error = np.abs(np.sqrt(got) - np.sqrt(want)) / envelope
    # Remaining errors: light that wraps, (1 / 2)^1.5 times the response of the cells there, and the
    # rim drawn by lines at a finite distance, which has the same sign everywhere in a round pupil.
    # Both are largest at single points; their mean is a fourth of that.
    middle = (slice(45, -45), slice(54, -54))
    assert error[middle].max() < inside and error[middle].mean() < inside / 4
    assert error.max() < border and error.mean() < border / 4


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.3, -0.4)])
def test_cells_with_a_wavefront_equal_chirp_z(offset):
    pitch = (2.0, 1.7)
    reach = (60, 80)
    period = (240, 300)
    zernike_um = {4: 0.15, 8: 0.1, 2: 1.0}
    got = celled(period, pitch, reach, [offset], zernike_um)[0]
    step = 2 * RADIUS / 900
    x = (np.arange(902) - 450.5) * step
    a = raster(opening(disc(0, 0, RADIUS), []), x, x)
    k = np.exp(
        -2j
        * np.pi
        / (0.55 * FOCAL)
        * x[:, None]
        * np.array([offset[0] * pitch[0], offset[1] * pitch[1]])
    )
    a = (
        a
        * np.exp(2j * np.pi * wavefront_um(zernike_um, x / RADIUS, x / RADIUS) / 0.55)
        * k[:, :1]
        * k[:, 1]
    )
    want = sampled_psf(
        a, WAVE, (step, step), FOCAL, [2 * r + 1 for r in reach], pitch, OPEN, cell_means=True
    )
    inner = (slice(25, -25), slice(30, -30))
    # 8e-4: half cells of 3 um at the rim
    np.testing.assert_allclose(
        np.sqrt(got[inner]), np.sqrt(want[inner]), atol=8e-4 * np.sqrt(want.max())
    )


def test_a_pupil_wider_than_the_period_is_folded_and_points_move_with_the_offset():
    terms = opening(disc(0.05, 0.02, 0.4), [(disc(0.1, -0.2, 0.05), 0.7)])
    # cells of 5 um: the pupil spans more than one period
    pitch = (4.0, 3.5)
    reach = (40, 50)
    period = (120, 150)
    base, moved = (drawn(period, pitch, reach, o, terms) for o in ((0.0, 0.0), (1.0, 1.0)))
    # tolerance for light that wraps
    np.testing.assert_allclose(
        moved[10:-11, 10:-11], base[11:-10, 11:-10], rtol=0.05, atol=2e-5 * base.max()
    )
    x = (np.arange(902) - 450.5) / 900
    want = sampled_psf(
        raster(terms, x, x), WAVE, (1 / 900, 1 / 900), FOCAL, (41, 51), pitch, OPEN, cell_means=True
    )
    np.testing.assert_allclose(base[20:-20, 25:-25], want, atol=2e-4 * want.max())


def test_pupils_drawn_in_blocks_of_chords_are_the_same(monkeypatch):
    """Draw the same pupil in blocks of a few hundred chords and in a single block.

    Blocks keep memory independent of the amount of dirt. Only the order of sums differs.
    """
    terms = opening(blades(0.5, 5), [(disc(0.1, 0.2, 0.05), 0.5), (disc(-0.2, -0.1, 0.1), 1.0)])
    pupil = half_plane_pattern.RealPupil(terms, 0.5, FOCAL, OPEN)
    place = pattern_columns.Place(20, 2, 12, (3.0, 3.0), (540.0, 560.0))

    def drawn_now():
        cells = 0.004, 0.003
        return (
            fold_shapes(terms, 0.5, cells, (120, 150), (0.5, 0.5)),
            half_plane_pattern.draw(pupil, cells, (120, 150)),
            pattern_columns.columns(pupil, place),
        )

    together = drawn_now()
    for module in (lattice, half_plane_pattern, pattern_columns):
        monkeypatch.setattr(module, "CHORDS", 300)
    # 1e-5: a few thousand values of 1 are summed along a row in float32
    for found, expected in zip(drawn_now(), together):
        np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_threads_change_no_bit_of_a_pupil_and_of_columns(monkeypatch):
    """Blocks of chords are added in a fixed order, whichever thread has drawn them."""
    terms = opening(blades(0.5, 5), [(disc(0.1, 0.2, 0.05), 0.5)])
    real = half_plane_pattern.RealPupil(terms, 0.5, FOCAL, OPEN)
    place = pattern_columns.Place(20, 2, 12, (3.0, 3.0), (540.0, 560.0))
    for module in (half_plane_pattern, pattern_columns):
        monkeypatch.setattr(module, "CHORDS", 100)

    def made(apply):
        drawn = half_plane_pattern.draw(real, (0.004, 0.003), (120, 150), apply=apply)
        return drawn, pattern_columns.columns(real, place, apply)

    with ThreadPoolExecutor(3) as pool:
        for one, other in zip(made(map), made(pool.map)):
            np.testing.assert_array_equal(one, other)
