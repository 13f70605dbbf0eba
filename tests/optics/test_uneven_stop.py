"""Pupil apodization of a traced lens: against rays counted by direction, the sine condition, the
limit of a uniform pupil, energy.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, PrescribedLens
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.prescription.amplitude import amplitude
from isethdr_optics.prescription.exit_pupil import exit_pupil
from isethdr_optics.prescription.prescription import load
from isethdr_optics.pupil import apodization, pupil_shapes, pupil_size

from isethdr_core.physics.optics import paraxial
from isethdr_core.physics.optics.ray_trace import collimated, follow, sequential
from isethdr_core.physics.optics.zernike import zernike

from .traced_rays import chief_mm, exit_sphere_mm


def counted(name, f_number, angle_deg, count=800):
    """Trace a uniform beam: one ray at a random point in each of count x count squares.

    Return the lens, the field tangent, and the points where rays cross the stop (in radii of the
    stop) and the exit sphere (in direction cosines).
    """
    lens = load(name).stopped(f_number).scaled(8.0)
    tangent = float(np.tan(np.radians(angle_deg)))
    indices = lens.indices(lens.reference_nm)
    pupil_z, radius = paraxial.entrance_pupil(lens.surfaces[:-1], indices)
    across = ((np.arange(count) + 0.5) / count * 2.4 - 1.2) * radius
    x, y = np.meshgrid(across + (lens.surfaces[0].z_mm - pupil_z) * tangent, across)
    x, y = (
        a + (np.random.default_rng(n).random(a.shape) - 0.5) * 2.4 / count * radius
        for n, a in enumerate((x, y))
    )
    rays = follow(
        lens.surfaces,
        indices,
        sequential(len(lens.surfaces)),
        collimated(x, y, lens.surfaces[0].z_mm, tangent, 0.0),
        keep_hits=True,
    )
    stop = np.stack(rays.hits_mm[lens.stop]) / lens.surfaces[lens.stop].semi_diameter_mm
    inside = np.isfinite(rays.position_mm[0]) & (np.hypot(*stop) <= 1)
    return (
        lens,
        tangent,
        stop[:, inside],
        seen_from_image(lens, tangent, rays.position_mm[:, inside], rays.direction[:, inside]),
    )


def seen_from_image(lens, tangent, position, direction):
    """Return the direction cosines (x, y) from the points where rays cross the exit sphere to the
    image of the chief ray.
    """
    chief = chief_mm(lens, tangent, lens.reference_nm)
    radius = exit_sphere_mm(lens, chief, lens.reference_nm)
    away = np.stack([position[0] - chief, position[1], 0 * position[2]])
    along = np.sum(away * direction, axis=0)
    back = -along - np.sqrt(along**2 - np.sum(away**2, axis=0) + radius**2)
    return -(away + back * direction)[:2] / radius


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "f_number", "angle_deg"), [("cooke_triplet", 5.6, 20.0), ("singlet", 4.0, 0.0)]
)
def test_the_power_is_that_of_rays_counted_by_direction(name, f_number, angle_deg):
    lens, tangent, stop, leaves = counted(name, f_number, angle_deg)
    terms, rms = amplitude(lens, tangent, lens.reference_nm)
    low = leaves.min(axis=1)
    high = leaves.max(axis=1)
    pupil = exit_pupil(lens, tangent, lens.reference_nm)
    places = np.stack([(leaves[0] - pupil.centre) / pupil.meridional, leaves[1] / pupil.sagittal])
    cell = np.minimum(np.floor((leaves - low[:, None]) / (high - low)[:, None] * 9).astype(int), 8)
    # only cells that lie wholly within the rim
    inner = [(i, j) for i in range(9) for j in range(9) if np.hypot(i - 4, j - 4) < 3.3]
    count = []
    modelled = []
    for i, j in inner:
        seen = (cell[0] == i) & (cell[1] == j)
        count.append(seen.sum())
        modelled.append(np.mean(sum(c * zernike(k, *places[:, seen]) for k, c in terms) ** 2))
    count, modelled = (np.array(a) / np.mean(a) for a in (count, modelled))
    # 0.2 %: a cell has about 4000 squares, and the rays of the 240 on its border fall on either
    # side. Surfaces absorb 0.2 % more at the rim
    np.testing.assert_allclose(modelled, count, atol=6e-3)
    assert (
        np.ptp(count) > 0.015 and np.corrcoef(count, modelled)[0, 1] > 0.95 and 0.003 < rms < 0.012
    )


def test_a_lens_that_keeps_the_sine_condition_is_even_however_its_stop_is_filled():
    lens, tangent, stop, _ = counted("double_gauss", 4.0, 14.0, 400)
    right = (stop[0] > 0).mean()
    assert abs(right - 0.5) > 0.01  # more rays cross one side of the stop
    assert amplitude(lens, tangent, lens.reference_nm)[1] < 0.0015
    whole = PrescribedLens(f_number=4.0, focal_length_mm=8.0)
    assert (
        whole.amplitude_at(np.radians(14.0)) == {}
        and node_lens(whole, {}, 0.0, np.radians(14.0)).uneven == ()
    )


@pytest.mark.slow
def test_even_light_changes_nothing_and_uneven_light_keeps_its_energy():
    lens = PrescribedLens(prescription="cooke_triplet", f_number=5.6, focal_length_mm=6.0)
    angle = np.radians(20.0)
    place = node_lens(lens, lens.wavefront_at(angle), 0.4, angle)
    even = replace(place, uneven=())
    assert np.abs(place.psf(550.0, 1.0, 64) - even.psf(550.0, 1.0, 64)).sum() > 1e-3
    np.testing.assert_allclose(
        replace(place, uneven=((0, 1.0),)).psf(550.0, 1.0, 32), even.psf(550.0, 1.0, 32), rtol=1e-5
    )
    for flares in ((), [ApertureFlare(blades=6, dust_per_mm2=300.0)]):
        sums = [float(one.psf(550.0, 1.0, 128, flares).sum()) for one in (place, even)]
        # the total light is the same, and so are the wings, except for the rim of the pupil: it is
        # brighter by 1 % on one side and darker on the other
        assert sums[0] == pytest.approx(sums[1], abs=3e-4) and sums[0] < 1
    whole = pupil_shapes.opening_and_dirt(replace(even, rims=()), ())[0]
    share = apodization.share(place.uneven, whole, (), pupil_size.radius_mm(place))
    assert share == pytest.approx(1.0, abs=1e-4)
