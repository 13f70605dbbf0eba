"""Direct sums over the pupil: right for a round pupil, and within the errors that kernels state."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_measured import lens_kernels
from isethdr_measured.lens_kernels import PITCH_UM, SIDE, WIDTH_NM, Patch, Pupil
from scipy.special import j1

from isethdr_core.plugins.registry import build


def airy_per_um2(radius_um, wave_nm, f_number):
    """Return the share of the light per um2 behind a round pupil (Born and Wolf 1999, 8.5.14)."""
    blur_um = 1e-3 * wave_nm * f_number
    turn = np.pi * radius_um / blur_um
    return np.pi / (4 * blur_um**2) * (2 * j1(turn) / turn) ** 2


def test_direct_sums_of_a_round_pupil_are_those_of_airys_pattern():
    lens = build("lens", "diffraction_limited", f_number=4.0, focal_length_mm=6.0)
    found = Pupil.of(lens, ()).light(Patch(5, -3, 550.0))
    # 24 midpoints across a tile have an error of 2.6e-4, 24 wavelengths one of 3e-6
    parts = 24
    at = (np.arange(-parts, SIDE * parts) + 0.5) / parts
    tents = np.maximum(0.0, 1 - np.abs(at - np.arange(SIDE)[:, None])) / parts
    x_um, y_um = ((first + at) * PITCH_UM for first in (5, -3))
    radius_um = np.hypot(x_um, y_um[:, None])
    waves = 550.0 + WIDTH_NM * ((np.arange(parts) + 0.5) / parts - 0.5)
    density = np.mean([airy_per_um2(radius_um, wave, 4.0) for wave in waves], axis=0)
    wanted = tents @ density @ tents.T * PITCH_UM**2
    # 4e-4: the error of the midpoints above, with a margin
    np.testing.assert_allclose(found, wanted, rtol=4e-4)


@pytest.mark.slow
def test_kernels_are_as_right_as_they_say(monkeypatch):
    monkeypatch.setattr(lens_kernels, "WINGS", ((20, 12), (90, -20)))
    monkeypatch.setattr(lens_kernels, "WINGS_NM", (550.0,))
    near, far = lens_kernels.kernel_wings(100, 120)
    # the core is exact but for its samples: it differs from the direct sums by 4e-5
    assert near["l1_error"] < near["stated"] < 1e-4
    # a patch of 16 tiles may have twice the mean error of its octave
    assert far["l1_error"] < 2 * far["stated"] + 3e-3
