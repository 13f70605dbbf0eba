"""Diffraction: Airy pattern, annulus, transfer function, tilt, energy, integration over pixels."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import j0, j1

from isethdr_core.physics.diffraction import (
    diffraction_mtf,
    energy_of,
    integrated_airy,
    integrated_psf,
    psf_from_pupil,
)
from isethdr_core.physics.optics.pupil import disc, opening, raster
from isethdr_core.physics.optics.zernike import wavefront_um

N = 400
FOCAL = 4.0
RADIUS = 0.5


def pupil(n=N, obscured=0.0):
    pitch = 2 * RADIUS / n
    x = (np.arange(n + 2) - (n + 1) / 2) * pitch
    losses = [(disc(0, 0, RADIUS * obscured), 1.0)] if obscured else []
    return raster(opening(disc(0, 0, RADIUS), losses), x, x).astype(float), pitch, x


def psf(wavelength, pitch_um, size, obscured=0.0, opd=None, **kw):
    a, pitch, _ = pupil(obscured=obscured)
    return psf_from_pupil(
        a,
        opd,
        wavelength,
        pitch,
        FOCAL,
        pitch_um,
        size,
        np.pi * RADIUS**2 * (1 - obscured**2),
        True,
        **kw,
    )


def encircled(values, pitch_um, radius_um):
    i = (np.arange(len(values)) - len(values) // 2) * pitch_um
    return values[np.hypot(i[:, None], i[None, :]) <= radius_um].sum()


def test_airy_encircled_energy_at_the_dark_rings():
    p = psf(550, 0.05, 256)
    for x, want in ((3.8317, 0.8378), (7.0156, 0.9099)):  # 1 - J0^2 - J1^2 at zeros of J1
        assert want == pytest.approx(1 - j0(x) ** 2 - j1(x) ** 2, abs=1e-4)
        assert encircled(p, 0.05, x / np.pi * 0.55 * 4) == pytest.approx(want, abs=1e-3)


def test_airy_profile_absolute():
    p = psf(550, 0.25, 65)
    r = np.abs(np.arange(65) - 32) * 0.25
    v = np.pi * r / (0.55 * 4) + 1e-12
    # peak: area of the pupil / (wavelength f)^2
    want = (2 * j1(v) / v) ** 2 * np.pi / 4 * (0.25 / (0.55 * 4)) ** 2
    np.testing.assert_allclose(p[32], want, atol=2e-4 * want.max())  # 400 pupil samples


def test_annulus():
    e = 0.5
    p = psf(550, 0.05, 256, obscured=0.5)
    r = (np.arange(256) - 128) * 0.05
    v = np.pi * np.hypot(r[:, None], r[None, :]) / (0.55 * 4) + 1e-12
    want = (2 * j1(v) / v - e * e * 2 * j1(e * v) / (e * v)) ** 2
    np.testing.assert_allclose(p / p.max(), want / want.max(), atol=5e-4)  # 400 pupil samples
    assert encircled(p, 0.05, FIRST_DARK / np.pi * 0.55 * 4) == pytest.approx(ENCIRCLED, abs=1e-5)


# first dark ring of an annulus with an obscuration of 0.5, and its encircled energy
FIRST_DARK = brentq(lambda v: j1(v) - 0.5 * j1(0.5 * v), 2.5, 3.6)
ENCIRCLED = quad(lambda v: (2 * j1(v) / v - j1(0.5 * v) / v) ** 2 * v, 1e-9, FIRST_DARK)[0] / (
    2 * 0.75
)


@pytest.mark.parametrize("n", [200, 400, 401])
def test_encircled_energy_of_an_annulus_whose_energy_nobody_gives(n):
    """Find the encircled energy of an annulus without being given the energy of its pupil.

    Partly covered cells at both borders lack 3e-3 of the energy at 400 cells across. With
    `cell_means`, the error is 2e-4.
    """
    assert ENCIRCLED == pytest.approx(0.4786, abs=1e-4)  # Mahajan 1991
    a, pitch, _ = pupil(n, 0.5)
    found = [
        encircled(
            psf_from_pupil(a, None, 550, pitch, FOCAL, 0.05, 256, cell_means=m),
            0.05,
            FIRST_DARK / np.pi * 2.2,
        )
        for m in (True, False)
    ]
    assert found[0] == pytest.approx(ENCIRCLED, abs=3e-4)
    assert found[1] > ENCIRCLED + 1e-3  # as samples, they are a dimmer pupil


def test_energy_of_means_over_cells_of_any_transmission():
    """Compare with areas in closed form: a pupil with grey dirt and a phase, at three
    resolutions."""
    rows = []
    for n in (300, 301, 900):
        pitch = 1.0 / n
        x = (np.arange(n + 2) - (n + 1) / 2) * pitch
        shapes = opening(
            disc(0, 0, RADIUS),
            [(disc(0.1, 0.05, 0.2), 0.4), (disc(-0.2, -0.1, 0.1), 1 - 0.7 * np.exp(0.8j))],
        )
        rows.append(energy_of(raster(shapes, x, x), pitch, True))
    want = np.pi * (0.25 - 0.04 * (1 - 0.6**2) - 0.01 * (1 - 0.7**2))
    np.testing.assert_allclose(rows, want, rtol=5e-4)
    assert energy_of(np.ones((3, 5)), 0.5) == pytest.approx(15 * 0.25)


def test_mtf_is_the_closed_form():
    p = psf(550, 0.5, 512)
    otf = np.abs(np.fft.fft(p.sum(axis=0)))[:100]
    want = diffraction_mtf(np.fft.fftfreq(512, 0.5)[:100], 550, 4.0)
    np.testing.assert_allclose(otf, want, atol=4e-3)  # 0.3 % of the light is beyond 128 um


def test_sum_below_one_and_the_rest_lies_outside():
    small = psf(550, 0.5, 64)
    large = psf(550, 0.5, 512)
    assert small.sum() < large.sum() < 1
    # Airy pattern: a share of 2 lambda N / (pi^2 r) lies beyond a radius; 25 % since the samples
    # cover a square, not a disc
    assert 1 - large.sum() == pytest.approx(2 / (np.pi**2) * 0.55 * 4 / 128, rel=0.25)


@pytest.mark.parametrize("axis_, j", [(1, 2), (0, 1)])
def test_tilt_moves_the_image_along_plus(axis_, j):
    _, _, x = pupil()
    c = 0.25  # um: OPD 2 c x / R, image shift f dW/dx = 4 N c = 4 um
    p = psf(550, 0.25, 128, opd=wavefront_um({j: c}, x / RADIUS, x / RADIUS))
    at = np.unravel_index(p.argmax(), p.shape)
    assert (at[axis_] - 64) * 0.25 == pytest.approx(4.0, abs=0.125)
    assert at[1 - axis_] == 64


def test_array_of_wavelengths_and_centre_of_even_and_odd_sizes():
    p = psf([450, 650], 0.5, 31)
    assert p.shape == (2, 31, 31) and p[0, 15, 15] == p[0].max()
    np.testing.assert_array_equal(p[1], psf(650, 0.5, 31))
    even = psf(550, 0.5, 32)
    assert np.unravel_index(even.argmax(), even.shape) == (16, 16)


def test_integrated_is_the_fine_sum_and_splits_consistently():
    fine = psf(550, 0.1, 455)  # Nyquist is 1.1 um: sums of an 11 x 11 midpoint rule
    centre = 227
    want = (
        fine[centre - 192 : centre + 193, centre - 192 : centre + 193]
        .reshape(35, 11, 35, 11)
        .sum((1, 3))
    )
    got = psf(550, 1.1, 35, integrated=True)
    # a midpoint rule of 11 points errs by 1e-3
    np.testing.assert_allclose(got, want, atol=2e-3 * want.max())
    assert got.min() >= 0


def test_complex_pupil_is_asymmetric_and_keeps_its_energy():
    a, pitch, x = pupil()
    coma = wavefront_um({8: 0.15}, x / RADIUS, x / RADIUS)
    p = psf_from_pupil(a, coma, 550, pitch, FOCAL, 0.5, 401)
    assert p.sum() == pytest.approx(1, abs=0.01)  # Parseval, less light outside of the samples
    assert np.abs(p - p[::-1, ::-1]).max() > 0.1 * p.max()


def test_two_boxes_equal_one_box_averaged_over_the_source():
    a, pitch, _ = pupil()
    args = (550.0, (pitch, pitch), FOCAL)
    two = integrated_psf(a, *args, (9, 9), (3.0, 3.0), np.pi / 4, True, boxes=2)
    fine = integrated_psf(a, *args, (91, 91), (0.3, 0.3), np.pi / 4, True)
    w = np.convolve(np.ones(10), np.ones(10)) / 10
    direct = sum(w[i] * w[j] * fine[45 + i - 9, 45 + j - 9] for i in range(19) for j in range(19))
    assert two[4, 4] == pytest.approx(direct, rel=3e-3)  # source summed over 10 x 10 points


@pytest.mark.parametrize("boxes", [1, 2])
def test_the_closed_form_of_the_round_stop_is_what_finer_and_finer_cells_come_to(boxes):
    grid = (FOCAL, (25, 20), (7.0, 5.0))
    off = []
    exact = integrated_airy(RADIUS, 550.0, *grid, boxes)
    for cells in (400, 1600):
        a, pitch, _ = pupil(cells)
        off.append(
            np.abs(
                integrated_psf(a, 550.0, (pitch, pitch), *grid, np.pi * RADIUS**2, True, boxes)
                - exact
            ).max()
            / exact.max()
        )
    # the error of cells at the rim falls with their width to the power 1.5 or more
    assert off[1] < 3e-7 and off[1] < off[0] / 4, off


def test_the_closed_form_of_the_round_stop_by_quadrature():
    """Compare rectangles on the axis, near it and in the outer rings with a quadrature of 80 x 80
    Gauss-Legendre points each.
    """
    pitch = (7.0, 5.0)
    found = integrated_airy(RADIUS, 550.0, FOCAL, (41, 51), (7.0, 5.0))
    at, weight = np.polynomial.legendre.leggauss(80)
    for row, column in ((20, 25), (21, 25), (20, 28), (3, 40), (40, 1)):
        y, x = ((k - n) * p + at * p / 2 for k, n, p in zip((row, column), (20, 25), pitch))
        v = np.pi * np.hypot(y[:, None], x) / (0.55 * 4) + 1e-12
        want = (
            weight
            @ ((2 * j1(v) / v) ** 2)
            @ weight
            * pitch[0]
            * pitch[1]
            / 4
            * np.pi
            / 4
            / (0.55 * 4) ** 2
        )
        # 2e-9 of the peak: the summed spectrum ends at a circular border, which errs by 1e-9 of the
        # peak next to it
        assert found[row, column] == pytest.approx(want, rel=1e-6, abs=2e-9 * found.max())


def test_coarse_pupils_are_refused():
    a, pitch, x = pupil(40)
    with pytest.raises(ValueError, match="wider than"):
        psf_from_pupil(a, None, 550, pitch, FOCAL, 1.0, 512)
    with pytest.raises(ValueError, match="wavefront changes"):
        psf_from_pupil(
            a, wavefront_um({4: 2.0}, x / RADIUS, x / RADIUS), 550, pitch, FOCAL, 0.5, 64
        )
    with pytest.raises(ValueError, match="no light"):
        psf_from_pupil(0 * a, None, 550, pitch, FOCAL, 0.5, 64)
