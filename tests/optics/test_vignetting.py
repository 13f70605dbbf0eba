"""Vignetted pupils: closed forms, areas and shapes by counted rays, relative illumination, and
lenses without vignetting.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import PrescribedLens, WavefrontLens
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.prescription.amplitude import amplitude
from isethdr_optics.prescription.exit_pupil import exit_pupil
from isethdr_optics.prescription.figures import pupil_area_mm2
from isethdr_optics.prescription.prescription import load, parse
from isethdr_optics.prescription.rims import rims
from isethdr_optics.psf import kernels
from isethdr_optics.psf.kernels import KernelRequest
from isethdr_optics.pupil import apodization, pupil_cells, pupil_energy, pupil_grid, pupil_size

from isethdr_core.data import quantities
from isethdr_core.error_terms import ErrorTerm
from isethdr_core.physics.optics import paraxial
from isethdr_core.physics.optics.pupil import disc, energy
from isethdr_core.physics.optics.ray_trace import collimated, follow, sequential

# Error of the light as a share of it: the border of the exit pupil deviates from an ellipse by up
# to 0.009 of its radius over a part of the border; beams are counted on 320 cells.
SHAPE = 3e-3

TUBE = {
    "name": "tube",
    "f_number": 4.0,
    "surfaces": [
        {"stop": True, "thickness_mm": 20.0, "semi_diameter_mm": 5.0},
        {"radius_mm": 60.0, "thickness_mm": 1e-3, "glass": "1.5", "semi_diameter_mm": 5.0},
        {"radius_mm": -60.0},
    ],
}


def light(lens, tangent, discs):
    """Return the share of the light through the exit pupil that discs (x, radius) transmit."""
    opening = disc(0.0, 0.0, 1.0)
    for x, radius in discs:
        opening = opening & disc(x, 0.0, radius)
    terms, _ = amplitude(lens, tangent, lens.reference_nm)
    return energy(opening, []) / np.pi * apodization.share(terms, opening, (), 1.0)


def test_a_rim_behind_a_stop_is_a_disc_moved_against_the_light():
    """Compare with a closed form: of two apertures of radius r at a distance d, the second one
    limits the first, at tangent t, as a disc shifted by -d t / r.
    """
    for t in (0.05, 0.1, 0.2):
        [(x, radius)], off = rims(parse(TUBE), t)
        # 3.5 %: 1 % since the sag r^2 / 2R = 0.2 mm brings the rim closer to the stop; the rest
        # since coma of the lens shifts the exit pupil
        assert (
            x == pytest.approx(-20 * t / 5, rel=0.035)
            and radius == pytest.approx(1.0, rel=0.02)
            and off < 2e-3
        )
    assert rims(parse(TUBE), 0.0) == ((), 0.0)
    counted = pupil_area_mm2(parse(TUBE), [0.47], grid=320)[0] / (25 * np.pi)
    found = light(parse(TUBE), 0.47, rims(parse(TUBE), 0.47)[0])
    # the open part is a narrow strip at the border, where the exit pupil deviates from an ellipse
    assert found == pytest.approx(counted, abs=SHAPE) and counted < 0.02
    assert rims(parse(TUBE), 0.6) == ((), 0.0)  # no light passes, so no rim is needed


def test_the_pupil_s_area_is_the_relative_illumination_without_cos4():
    """Compare the light through the rims with rays counted in front of the lens.

    With the stop in front, the beam in front of the lens is the stop itself, so both count the same
    rays.
    """
    lens = parse(TUBE)
    for t in (0.05, 0.1, 0.2):
        counted = pupil_area_mm2(lens, [0.0, t], grid=320)
        assert light(lens, t, rims(lens, t)[0]) == pytest.approx(counted[1] / counted[0], abs=SHAPE)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "f_number"), [("double_gauss", 3.0), ("cooke_triplet", 5.0)])
def test_the_pupil_s_area_is_what_rims_leave_of_the_beam(name, f_number):
    """Compare with rays counted in front of the lens: the number with rims over that without."""
    lens = load(name).stopped(f_number)
    bare = replace(
        lens,
        surfaces=tuple(
            s if s.is_stop else replace(s, semi_diameter_mm=np.inf) for s in lens.surfaces
        ),
    )
    for part in (0.8, 1.0):
        t = part * np.tan(np.radians(lens.half_field_deg))
        left, whole = (float(pupil_area_mm2(one, [t], grid=320)[0]) for one in (lens, bare))
        found = light(lens, float(t), rims(lens, float(t))[0])
        assert left < 0.999 * whole and found == pytest.approx(left / whole, abs=SHAPE)


def test_a_place_s_pupil_is_open_where_its_rays_get_through():
    """Compare the open cells of a field point's pupil with skew rays traced to the sensor.

    The field point is off both axes. The direction of a ray behind the lens selects its cell.
    """
    lens = PrescribedLens(prescription="cooke_triplet", f_number=5.0, focal_length_mm=50.0)
    real = lens.real()
    angle = np.radians(19.0)
    azimuth = 0.8
    place = node_lens(lens, lens.wavefront_at(angle), azimuth, angle)
    # y points down
    indices = real.indices(real.reference_nm)
    tx = np.tan(angle) * np.cos(azimuth)
    ty = -np.tan(angle) * np.sin(azimuth)
    pupil_z, radius = paraxial.entrance_pupil(real.surfaces[:-1], indices)
    front = real.surfaces[0].z_mm
    across = np.linspace(-1.3, 1.3, 120) * radius
    x, y = np.meshgrid(across + (front - pupil_z) * tx, across + (front - pupil_z) * ty)
    rays = follow(
        real.surfaces,
        indices,
        sequential(len(real.surfaces)),
        collimated(x, y, front, tx, ty),
        keep_hits=True,
    )
    u, v = (h / real.surfaces[real.stop].semi_diameter_mm for h in rays.hits_mm[real.stop])
    inside = np.isfinite(rays.position_mm[0]) & (np.hypot(u, v) < 0.98)
    axis = pupil_grid.axis_mm(place, 0.02 * pupil_size.radius_mm(place))
    cells = pupil_cells.amplitude(place, (), axis, axis, 550.0)
    centre = exit_pupil(real, float(np.tan(angle)), real.reference_nm).centre
    middle = (centre * np.cos(azimuth), -centre * np.sin(azimuth))
    crossed = [-lens.focal_length_mm * (d[inside] - c) for d, c in zip(rays.direction, middle)]
    at = [
        np.clip(np.rint((h - axis[0]) / (axis[1] - axis[0])).astype(int), 0, len(axis) - 1)
        for h in crossed
    ]
    lit = rays.margin[inside] > 0
    seen = cells[at[1], at[0]]
    assert 0.1 < np.mean(~lit) < 0.4
    clear = (seen < 1e-3) | (seen > 1 - 1e-3)
    # cells have a width of a hundredth of the stop; those on the rim are excluded
    assert clear.mean() > 0.9 and np.mean((seen > 0.5)[clear] != lit[clear]) < 5e-3
    mirrored = cells[::-1]
    # the mirrored pupil disagrees, so the test is sensitive to the side of the rims
    assert np.mean((mirrored[at[1], at[0]] > 0.5) != lit) > 0.02


def test_energy_of_a_cut_pupil_is_its_area_and_its_point_spread_keeps_it():
    whole = WavefrontLens()
    cut = replace(node_lens(whole, {}, 0.0), rims=((-0.5, 1.0, 1.0),))
    assert pupil_energy.open_energy_mm2(cut, (), 550.0) == pytest.approx(
        np.pi * 0.25 * energy(disc(0, 0, 1.0) & disc(-0.5, 1.0, 1.0), []) / np.pi
    )
    sharp, wide = (lens.psf(550.0, 2.0, 129).values[0] for lens in (whole, cut))
    # a smaller pupil spreads more light beyond the samples
    assert wide.sum() == pytest.approx(sharp.sum(), abs=6e-3) and wide.max() < 0.6 * sharp.max()
    # the narrow direction of the pupil is the wide one of its point spread
    y, x = np.indices(wide.shape) - 64
    near = np.hypot(y, x) < 8
    along = (x * 0.5 - y) / np.hypot(0.5, 1.0)
    across = (x + y * 0.5) / np.hypot(0.5, 1.0)
    assert (wide * along**2)[near].sum() > 1.2 * (wide * across**2)[near].sum()


def test_a_stop_that_nothing_cuts_is_unchanged_to_the_bit(monkeypatch):
    lens = PrescribedLens(prescription="singlet", f_number=8.0, error_allowed=0.5)
    angle = np.radians(10.0)
    assert lens.rims_at(angle) == () and lens.rims_at(0.0) == ()
    place = node_lens(lens, lens.wavefront_at(angle), 0.3, angle)
    found = place.psf([450.0, 600.0], 1.0, 64).values
    monkeypatch.setattr(PrescribedLens, "rims_at", lambda self, angle_rad: ())
    np.testing.assert_array_equal(
        node_lens(lens, lens.wavefront_at(angle), 0.3, angle).psf([450.0, 600.0], 1.0, 64).values,
        found,
    )


@pytest.mark.slow
def test_a_vignetted_kernel_keeps_its_light_and_the_ledger_says_how_well_rims_are_known():
    """A vignetted kernel is normalised to the light that passes.

    At f/3 the double Gauss vignettes beyond 10 degrees. Relative illumination accounts for the lost
    light.
    """
    lens = PrescribedLens(f_number=3.0)
    cut = node_lens(lens, lens.wavefront_at(0.24), 0.4, 0.24)
    sums = [
        kernels.kernels(KernelRequest(one, (), np.array([550.0]), (6.0, 6.0), (12, 12)))
        .bands[0]
        .sum()
        for one in (cut, replace(cut, rims=()))
    ]
    assert cut.rims and sums[0] == pytest.approx(sums[1], abs=5e-3) and 0.9 < sums[0] < 1
    notes = lens.limits(float(np.arctan(quantities.centres(9, 0.5).max())), [587.56])
    [drawn] = [e for e in notes if isinstance(e, ErrorTerm) and e.source.key == "rims"]
    assert 0 < drawn.value < 1e-3
