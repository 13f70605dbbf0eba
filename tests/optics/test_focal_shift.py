"""Focal shift by wavelength: equals a Zernike defocus, has the right size and sign, and is refused
beyond its table.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, WavefrontLens
from isethdr_optics.psf.kernels import KernelRequest, kernels

from isethdr_core import compose
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build_from_config


def psf(lens, wave=550.0, pitch_um=1.0, size=161, flares=()):
    return lens.psf(wave, pitch_um, size, flares, integrated=True).values[0]


@dataclass(frozen=True)
class RightHalf:
    """A pupil that is open at x > 0 only."""

    def pupil(self, x_mm, y_mm, wavelength_nm):
        return (x_mm > 0) + 0.0 * y_mm


def test_a_shift_of_focus_is_a_defocus():
    """A shift dz is a path difference of dz / (8 N^2) at the rim of the pupil. The Zernike defocus
    sqrt(3) (2 rho^2 - 1) of 1 um rms has 2 sqrt(3) um there, so the coefficient is dz / (16 sqrt(3)
    N^2).
    """
    shifted = DiffractionLimitedLens(focal_shift_um={400: 80.0, 700: 80.0})
    by_hand = WavefrontLens(zernike_um={4: 80.0 / (16 * 3**0.5 * 16)})
    np.testing.assert_allclose(psf(shifted), psf(by_hand), rtol=1e-6, atol=1e-12)
    cured = WavefrontLens(
        zernike_um={4: -80.0 / (16 * 3**0.5 * 16)}, focal_shift_um={400: 80.0, 700: 80.0}
    )
    # the phases cancel to rounding, 1e-16
    np.testing.assert_allclose(psf(cured), psf(DiffractionLimitedLens()), atol=1e-9)


def test_the_blur_is_as_wide_as_geometry_says():
    """Rays from a stop of diameter f / N meet 400 um behind the sensor. On the sensor they fill a
    disc with a diameter of 400 um / N uniformly.
    """
    value = psf(DiffractionLimitedLens(focal_shift_um={400: 400.0, 700: 400.0}))
    y, x = np.indices(value.shape) - 80
    r = np.hypot(y, x)
    # the disc has a radius of 50 um; the rim of the pupil diffracts 5 % of the light out of it
    assert value[r < 52].sum() > 0.93 and value[r < 75].sum() > 0.97
    assert value[r < 25].sum() == pytest.approx(0.25, abs=0.02)  # a quarter of the area


@pytest.mark.parametrize("shift_um, side", [(400.0, 1), (-400.0, -1)])
@pytest.mark.slow
def test_rays_have_not_crossed_yet_where_the_focus_lies_beyond(shift_um, side):
    value = psf(
        DiffractionLimitedLens(focal_shift_um={400: shift_um, 700: shift_um}), flares=[RightHalf()]
    )
    right = value[:, 81:].sum()
    left = value[:, :80].sum()
    assert (right - left) * side > 0.9 * (right + left)


@pytest.mark.slow
def test_lines_between_wavelengths_and_a_sharp_colour():
    lens = DiffractionLimitedLens(focal_shift_um={450: 60.0, 550: 0.0, 650: 60.0})
    peaks = {
        wave: psf(lens, wave).max() / psf(DiffractionLimitedLens(), wave).max()
        for wave in (475.0, 500.0, 550.0, 600.0)
    }
    assert peaks[550.0] == pytest.approx(1.0, abs=1e-6) and peaks[475.0] < peaks[500.0] < 1
    half = DiffractionLimitedLens(focal_shift_um={400: 30.0, 700: 30.0})
    np.testing.assert_allclose(psf(lens, 500.0), psf(half, 500.0), rtol=1e-6, atol=1e-12)


def test_kernels_of_bands_follow_it():
    lens = DiffractionLimitedLens(focal_shift_um={400: 200.0, 550: 0.0, 700: 200.0})
    made = kernels(KernelRequest(lens, (), np.array([450.0, 550.0, 650.0]), (4.0, 4.0), (12, 12)))
    assert (
        made.bands[1].max() > 5 * made.bands[0].max()
        and made.bands[1].max() > 5 * made.bands[2].max()
    )


def test_wavelengths_beyond_the_table_are_refused():
    lens = DiffractionLimitedLens(focal_shift_um={500: 10.0, 600: 0.0})
    with pytest.raises(ConfigError, match="500 to 600 nm.*add that wavelength"):
        psf(lens, 450.0)
    with pytest.raises(ConfigError, match="focal_shift_um"):
        DiffractionLimitedLens(focal_shift_um={550: float("nan")})
    with pytest.raises(ConfigError, match="speckle_error"):
        DiffractionLimitedLens(speckle_error=0.0)


def test_other_hopeless_requests_are_refused_before_any_work(monkeypatch):
    lens = DiffractionLimitedLens()
    with pytest.raises(ConfigError, match="GiB"):
        lens.psf(550.0, 1e-4, 1_000_000)
    with pytest.raises(ConfigError, match="cells across"):
        kernels(KernelRequest(lens, (), np.array([550.0]), (4.0, 4.0), (200_000, 200_000)))
    for wave in ([], [np.nan], [-550.0], [0.0]):
        with pytest.raises(ConfigError, match="wavelength_nm"):
            lens.psf(wave, 1.0, 16)
    covered = ApertureFlare(
        blades=0,
        dust_per_mm2=3.0,
        dust_radius_um=5000.0,
        dust_spread=0.0,
        dust_opacity=(1.0, 1.0),
        scratches_per_mm2=0.0,
    )
    with pytest.raises(ConfigError, match="block all light"):
        lens.psf(550.0, 1.0, 16, [covered])
    # a lower limit, since to reach the real one takes seconds
    monkeypatch.setattr("isethdr_core.physics.optics.pupil.shape_sum.MOST_TERMS", 300)
    with pytest.raises(ConfigError, match="overlaps"):
        lens.psf(
            550.0,
            1.0,
            16,
            [ApertureFlare(dust_per_mm2=400.0, dust_radius_um=200.0, scratches_per_mm2=0.0)],
        )


@pytest.mark.parametrize(
    "typed",
    [
        "lens.focal_shift_um={450:20,550:0}",
        "+lens.focal_shift_um={450:20,550.0:0}",
        "lens.focal_shift_um={450.0:20,550.0:0}",
    ],
)
def test_whole_and_broken_numbers_are_wavelengths_on_the_command_line(typed):
    lens = build_from_config("lens", compose(["lens=diffraction_limited", typed]).lens)
    assert lens == DiffractionLimitedLens(focal_shift_um={450.0: 20.0, 550.0: 0.0})
    with pytest.raises(ConfigError, match="focal_shift_um is .*far"):
        build_from_config(
            "lens", compose(["lens=diffraction_limited", "lens.focal_shift_um={450:far}"]).lens
        )
