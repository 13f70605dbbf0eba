"""Wavefronts of high Zernike orders: light is conserved, the pupil agrees with an independent
quadrature, and invalid terms are refused.
"""

from time import process_time
from typing import get_args

import numpy as np
import pytest
from isethdr_optics.lenses.limits import Zernikes
from isethdr_optics.psf.interpolation_wavelengths import _change
from isethdr_optics.pupil import fine_cells, pupil_grid, pupil_size, wavefronts
from scipy.special import eval_jacobi, jv

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.zernike import HIGHEST_ORDER, LAST_INDEX, order
from isethdr_core.plugins.ranges import declared
from isethdr_core.plugins.registry import build

WAVE_NM = 550.0


def lens(j: int, rms_um: float):
    return build("lens", "wavefront", zernike_um={j: rms_um})


def pupil_mean(j: int, rms_um: float) -> float:
    """Return the mean of the pupil function by an independent quadrature.

    The integral over the angle is a Bessel function; that over the squared radius uses the
    Gauss-Legendre rule.
    """
    n, m = order(j)
    node, weight = np.polynomial.legendre.leggauss(600)
    s = (node + 1) / 2
    a = abs(m)
    radial = s ** (a / 2) * eval_jacobi((n - a) // 2, 0, a, 2 * s - 1)
    phase = 2e3 * np.pi * rms_um / WAVE_NM * (n + 1 if m == 0 else 2 * (n + 1)) ** 0.5 * radial
    return weight / 2 @ (np.exp(1j * phase) if m == 0 else jv(0, phase))


def mean_of_cells(j: int, rms_um: float) -> complex:
    given = lens(j, rms_um)
    pitch = pupil_grid.core_pitch_mm(given, 90.0, WAVE_NM, pupil_grid.FEWEST_SAMPLES)
    axis = pupil_grid.axis_mm(given, pitch)
    cells = fine_cells.resolved(given, (), axis, axis, WAVE_NM)
    return cells.sum(dtype=complex) * pitch**2 / (np.pi * pupil_size.radius_mm(given) ** 2)


# 2e-4: the sum over cells errs by up to 1.1e-4 of the open pupil, measured over all orders
@pytest.mark.parametrize(
    ("j", "rms_um"), [(71, 0.05), (84, 0.02), (600, 0.002), (820, 0.02), (840, 0.001)]
)
def test_pupil_mean_of_high_orders(j, rms_um):
    assert mean_of_cells(j, rms_um) == pytest.approx(pupil_mean(j, rms_um), abs=2e-4)


@pytest.mark.slow
def test_pupil_mean_of_every_index():
    wrong = [abs(mean_of_cells(j, 0.002) - pupil_mean(j, 0.002)) for j in range(LAST_INDEX + 1)]
    assert max(wrong) < 2e-4


@pytest.mark.parametrize("j", [84, pytest.param(600, marks=pytest.mark.slow)])
def test_light_of_high_orders_is_kept(j):
    rms_um = 0.03 if order(j)[0] < 20 else 0.003
    # distance to which the steepest part of the wavefront sends light
    steepest_um = 2 * 4.0 * wavefronts.steepest_um(lens(j, rms_um), WAVE_NM)
    count = int(steepest_um / 2) + 40
    light = float(lens(j, rms_um).psf(WAVE_NM, 4.0, count, integrated=True).sum())
    clean = float(
        build("lens", "diffraction_limited").psf(WAVE_NM, 4.0, count, integrated=True).sum()
    )
    # Beyond twice that distance only the rim of the stop diffracts light: as much as without a
    # wavefront, within half, since the phase along the rim varies
    assert light <= 1 + 1e-4
    assert 1 - light == pytest.approx(1 - clean, rel=0.5, abs=1e-4)


@pytest.mark.parametrize(
    "terms",
    [
        {LAST_INDEX + 1: 0.05},
        {10**6: 0.05},
        {10**400: 0.05},
        {-1: 0.05},
        {4: float("nan")},
        {4: float("inf")},
    ],
)
def test_terms_that_cannot_be_are_refused_at_once(terms):
    start_s = process_time()
    with pytest.raises(ConfigError, match="type for example"):
        build("lens", "wavefront", zernike_um=terms)
    with pytest.raises(ConfigError, match="type for example"):
        build("lens", "wavefront", field_zernike_um={0.0: {}, 20.0: terms})
    # CPU time: milliseconds, and seconds if modules are imported for the first time
    assert process_time() - start_s < 10


def test_the_last_index_that_is_exact_is_the_last_one_declared():
    indices, _ = get_args(Zernikes)
    assert declared(indices).most == LAST_INDEX
    assert order(LAST_INDEX) == (HIGHEST_ORDER, HIGHEST_ORDER)


def test_interpolation_wavelengths_see_every_angle_of_a_wavefront():
    class Plan:
        lens = build("lens", "wavefront", zernike_um={528: 0.1})
        flares = ()

    # sin(32 theta) is 0 at 32 equally spaced angles, which must not hide it. The change of phase is
    # that of the largest value, at the rim
    want = 2e3 * np.pi * 0.1 * 66**0.5 * (1 / 540 - 1 / 560)
    assert _change(Plan, 540.0, 560.0) == pytest.approx(want, rel=0.08)
