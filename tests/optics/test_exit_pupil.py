"""Exit pupil off the axis: point spreads of the lens `prescription` against direct sums over traced
rays.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, PrescribedLens
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.prescription.exit_pupil import exit_pupil
from isethdr_optics.pupil import pupil_cells, pupil_energy, pupil_grid

from isethdr_core.data import quantities
from isethdr_core.error_terms import ErrorTerm
from isethdr_core.physics.diffraction import energy_of

from .traced_rays import chief_mm, direct_sum, exit_sphere_mm, traced

CLOSE = 0.02  # largest relative error of the widths and of the peak
FOCAL_MM = 6.0
REFERENCE_NM = 587.56


class Figures(NamedTuple):
    """Figures of a point spread within a square window; lengths in um."""

    rms_x: float
    rms_y: float
    half_light_radius: float
    peak: float
    light: float


def figures(density, at_um) -> Figures:
    x, y = np.meshgrid(at_um, at_um)
    light = density.sum()
    off_x = x - (density * x).sum() / light
    off_y = y - (density * y).sum() / light
    radius = np.hypot(off_x, off_y).ravel()
    order = np.argsort(radius)
    within = np.cumsum(density.ravel()[order])
    half = float(np.interp(light / 2, within, radius[order]))
    rms_x, rms_y = (float(np.sqrt((density * off**2).sum() / light)) for off in (off_x, off_y))
    return Figures(rms_x, rms_y, half, float(density.max()), float(light))


def place_at(name, f_number, angle_deg, azimuth_rad=0.0):
    lens = PrescribedLens(prescription=name, f_number=f_number, focal_length_mm=FOCAL_MM)
    angle = np.radians(angle_deg)
    return lens, node_lens(lens, lens.wavefront_at(angle), azimuth_rad, angle)


def both(name, f_number, angle_deg, wavelength_nm=REFERENCE_NM, count=110, size=43):
    """Return the point spread (y, x) of the lens, that of the direct sum, and the positions of
    their
    samples, um. The field point lies on +x.
    """
    lens, place = place_at(name, f_number, angle_deg)
    tangent = float(np.tan(np.radians(angle_deg)))
    pitch_um = 0.15 * f_number
    at_um = (np.arange(size) - size // 2) * pitch_um
    fan = traced(lens.real(), tangent, wavelength_nm, count, 1.3 * FOCAL_MM / f_number / 2)
    chief = chief_mm(lens.real(), tangent, wavelength_nm)
    wanted = direct_sum(
        fan, chief, exit_sphere_mm(lens.real(), chief, wavelength_nm), wavelength_nm, at_um, at_um
    )
    found = place.psf(wavelength_nm, pitch_um, size, integrated=False).values[0]
    return found, wanted.density * pitch_um**2, at_um


def slow(*case):
    return pytest.param(*case, marks=pytest.mark.slow)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "f_number", "angle_deg", "wavelength_nm", "cut"),
    [
        ("double_gauss", 4.0, 14.0, REFERENCE_NM, CLOSE),
        ("cooke_triplet", 5.6, 20.0, REFERENCE_NM, CLOSE),
        ("singlet", 8.0, 0.0, 450.0, CLOSE),
        slow("double_gauss", 4.0, 0.0, REFERENCE_NM, CLOSE),
        slow("double_gauss", 4.0, 7.0, REFERENCE_NM, CLOSE),
        slow("double_gauss", 4.0, 20.0, REFERENCE_NM, CLOSE),
        slow("double_gauss", 4.0, 7.0, 450.0, CLOSE),
        slow("double_gauss", 3.0, 14.0, REFERENCE_NM, CLOSE),
        slow("cooke_triplet", 5.6, 0.0, REFERENCE_NM, CLOSE),
        slow("cooke_triplet", 5.6, 7.0, REFERENCE_NM, CLOSE),
        slow("cooke_triplet", 5.6, 14.0, REFERENCE_NM, CLOSE),
        slow("cooke_triplet", 5.6, 20.0, 450.0, CLOSE),
        slow("singlet", 8.0, 0.0, REFERENCE_NM, CLOSE),
        slow("singlet", 8.0, 7.0, REFERENCE_NM, CLOSE),
        slow("singlet", 8.0, 14.0, REFERENCE_NM, 0.045),  # fringes of a blur 50 um wide
        slow("singlet", 8.0, 14.0, 650.0, 0.045),
    ],
)
def test_the_point_spread_is_the_direct_sum_over_traced_rays(
    name, f_number, angle_deg, wavelength_nm, cut
):
    found, wanted, at_um = both(name, f_number, angle_deg, wavelength_nm)
    # 85 rays across the pupil determine a width to 0.6 %; the ellipse as border of the exit pupil
    # errs by 0.5 %
    np.testing.assert_allclose(figures(found, at_um), figures(wanted, at_um), rtol=CLOSE)
    middle = len(at_um) // 2
    for line in (np.s_[middle], np.s_[:, middle]):
        assert np.abs(found - wanted)[line].sum() < cut * wanted[line].sum()
    assert np.abs(found - wanted).sum() < CLOSE  # share of the point's light


def test_the_point_spread_turns_with_the_azimuth():
    def moments(azimuth_rad):
        _, place = place_at("cooke_triplet", 5.6, 20.0, azimuth_rad)
        density = place.psf(REFERENCE_NM, 0.4, 65).values[0]
        at = (np.arange(65) - 32) * 0.4
        x, y = np.meshgrid(at, at)
        density = np.where(np.hypot(x, y) < 12, density, 0.0) / density[np.hypot(x, y) < 12].sum()
        along = x * np.cos(azimuth_rad) - y * np.sin(azimuth_rad)
        across = x * np.sin(azimuth_rad) + y * np.cos(azimuth_rad)
        return [
            float((density * a * b).sum())
            for a, b in ((along, along), (across, across), (along, across))
        ]

    right, skew, up = (moments(azimuth_rad) for azimuth_rad in (0.0, 0.7, np.pi / 2))
    # 1 %: samples of 0.4 um within a circle of 12 um
    np.testing.assert_allclose(skew, right, rtol=0.01, atol=0.01 * right[0])
    np.testing.assert_allclose(up, right, rtol=0.01, atol=0.01 * right[0])
    assert right[0] > 1.1 * right[1]  # wide where the pupil is narrow


@pytest.mark.slow
def test_with_many_waves_of_aberration_the_width_is_that_of_the_ray_spot():
    lens, place = place_at("singlet", 4.0, 14.0)
    tangent = float(np.tan(np.radians(14.0)))
    fan = traced(lens.real(), tangent, REFERENCE_NM, 120, 1.3 * FOCAL_MM / 8.0)
    spot = 1e3 * fan.position[:2, fan.inside > 0.5]
    spot = spot - spot.mean(axis=1)[:, None]
    density = place.psf(REFERENCE_NM, 2.5, 145).values[0]
    half = figures(density, 2.5 * (np.arange(145) - 72.0)).half_light_radius
    # 3 %: diffraction of 588 nm x 4 = 2.4 um, with its wings, widens a spot of 48 um
    assert half == pytest.approx(float(np.median(np.hypot(*spot))), rel=0.03)


@pytest.mark.parametrize(
    ("name", "f_number"),
    [
        pytest.param("double_gauss", 4.0, marks=pytest.mark.slow),
        ("cooke_triplet", 5.6),
        pytest.param("singlet", 8.0, marks=pytest.mark.slow),
    ],
)
def test_on_the_axis_the_exit_pupil_is_round_and_as_wide_as_the_f_number_says(name, f_number):
    lens, place = place_at(name, f_number, 0.0)
    meridional, sagittal = lens.exit_pupil_at(0.0)
    assert meridional == pytest.approx(sagittal, abs=1e-6)
    # 0.004: the f-number is paraxial, the rays at the border of the pupil are not
    assert meridional == pytest.approx(1.0, abs=0.004)
    assert exit_pupil(lens.real(), 0.0, REFERENCE_NM).off_ellipse < 1e-6
    plain = replace(place, pupil_matrix=None, f_number=f_number / meridional)
    found, wanted = (
        one.psf(REFERENCE_NM, 0.5, 65, integrated=False).values for one in (place, plain)
    )
    # both pupils have the same shape, but are sampled by cells of different sizes
    np.testing.assert_allclose(found, wanted, atol=2e-4 * wanted.max())


@dataclass(frozen=True)
class Ramp:
    """A pupil of another plugin, without shapes: its transmission rises across the stop."""

    def pupil(self, x_mm, y_mm, wavelength_nm):
        return 0.5 + 0.3 * x_mm + 0.2 * y_mm


def test_flares_in_the_stop_are_seen_through_the_exit_pupil():
    _, place = place_at("cooke_triplet", 5.6, 20.0, 0.7)
    axis = pupil_grid.axis_mm(place, 0.02)
    inside = np.s_[len(axis) // 2 - 5 : len(axis) // 2 + 5]
    stop_x, stop_y = np.einsum(
        "ij,jyx->iyx", np.linalg.inv(place.pupil_matrix), np.stack(np.meshgrid(axis, axis))
    )
    cells = pupil_cells.amplitude(place, [Ramp()], axis, axis, 550.0)
    np.testing.assert_allclose(
        cells[inside, inside], (0.5 + 0.3 * stop_x + 0.2 * stop_y)[inside, inside], rtol=1e-6
    )
    dirty = [ApertureFlare(blades=6, dust_per_mm2=40.0)]
    axis = pupil_grid.axis_mm(place, 0.004)
    for flares in ((), dirty):  # compare the energy from areas with that of the sampled cells
        drawn = energy_of(
            pupil_cells.amplitude(place, flares, axis, axis, 550.0), 0.004, cell_means=True
        )
        even = replace(place, uneven=())
        # 2e-3: cells on the border
        assert drawn == pytest.approx(pupil_energy.open_energy_mm2(even, flares, 550.0), rel=2e-3)


def test_a_point_keeps_its_light_whatever_the_shape_of_its_pupil():
    """Compare the light in a window for an elliptical and a round pupil.

    In both cases the window holds all light but the outer rings.
    """
    _, place = place_at("double_gauss", 4.0, 14.0)
    light = float(place.psf(550.0, 2.0, 65).sum())
    round_one = float(replace(place, pupil_matrix=None).psf(550.0, 2.0, 65).sum())
    # the pupil is 6 % narrower, so 6 % more of the 2 % of light lies outside the window
    assert light == pytest.approx(round_one, abs=1.5e-3) and 0.97 < light < 1


@pytest.mark.slow
def test_the_ledger_states_what_the_ellipse_leaves():
    found, wanted, _ = both("double_gauss", 3.0, 14.0)
    lens = PrescribedLens(f_number=3.0, focal_length_mm=FOCAL_MM, distortion="none", falloff="none")
    x = quantities.centres(9, 2 * np.tan(np.radians(14.0)))
    notes = lens.limits(float(np.arctan(x.max())), [REFERENCE_NM])
    errors = [note for note in notes if isinstance(note, ErrorTerm)]
    [stated] = [e for e in errors if e.source.key == "exit pupil"]
    assert stated.unit == "relative" and np.abs(found - wanted).sum() < stated.value < 0.04
    assert not any("foreshortened" in e.label for e in errors)
