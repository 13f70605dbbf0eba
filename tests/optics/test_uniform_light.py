"""Uniform light through a prescription, against rays traced back from the sensor by independent
formulas, and the errors stated in the ledger.
"""

import numpy as np
import pytest
from isethdr_optics import PrescribedLens
from isethdr_optics.imaging.sensor_plane import sensor_plane
from isethdr_optics.prescription.figures import seen_sr

from isethdr_core.data import quantities
from isethdr_core.data.camera_geometry import distortion_map, table_values
from isethdr_core.error_terms import ErrorTerm

# (prescription, f-number, relative error): the size of an entrance pupil changes with wavelength a
# little differently off the axis
LENSES = [
    pytest.param("double_gauss", 4.0, 1.5e-3, marks=pytest.mark.slow),
    ("cooke_triplet", 8.0, 4e-3),
]


def counted_sr(real, height_mm, wavelength_nm, side=200, times=5):
    """Return irradiance / radiance, sr, and its standard error at a point of the sensor.

    Random rays go backwards through spheres, which they meet by their centres. Each of the `times`
    repeats has one ray in each cell of a square around the last surface. A ray counts if it leaves
    the front of the lens.
    """
    found = [
        _once(real, height_mm, wavelength_nm, side, np.random.default_rng(k)) for k in range(times)
    ]
    return float(np.mean(found)), float(np.std(found, ddof=1) / np.sqrt(times))


def _once(real, height_mm, wavelength_nm, side, draw):
    surfaces = real.surfaces
    indices = real.indices(wavelength_nm)
    half = 1.1 * surfaces[-2].semi_diameter_mm
    x, y = (
        (g + draw.random(g.shape)).ravel() * 2 * half / side - half
        for g in np.meshgrid(np.arange(side), np.arange(side))
    )
    at = np.stack([np.full(x.shape, height_mm), 0 * x, np.full(x.shape, surfaces[-1].z_mm)])
    way = np.stack([x, y, np.full(x.shape, surfaces[-2].z_mm)]) - at
    distance = np.sqrt((way**2).sum(0))
    way /= distance
    share = (way[2] / distance) ** 2 * (2 * half / side) ** 2
    alive = np.ones(x.shape, bool)
    for k in range(len(surfaces) - 2, -1, -1):
        surface = surfaces[k]
        with np.errstate(invalid="ignore"):
            if surface.curvature_per_mm == 0:
                at = at + way * ((surface.z_mm - at[2]) / way[2])
                normal = np.array([[0.0], [0.0], [1.0]])
            else:
                radius = 1 / surface.curvature_per_mm
                centre = np.array([[0.0], [0.0], [surface.z_mm + radius]])
                foot = ((centre - at) * way).sum(0)
                chord = np.sqrt(radius**2 - ((centre - at) ** 2).sum(0) + foot**2)
                # a ray that travels backwards meets the vertex side of a surface with R > 0 where
                # it leaves the sphere
                at = at + way * (foot + np.sign(radius) * chord)
                normal = (centre - at) / radius  # towards the sensor
            alive &= np.hypot(at[0], at[1]) <= surface.semi_diameter_mm
            comes = np.arccos(np.clip(-(normal * way).sum(0), -1, 1))
            leaves = np.arcsin(indices[k + 1] / indices[k] * np.sin(comes))
            along = way + np.cos(comes) * normal
            way = (
                np.sin(leaves) * along / np.maximum(np.sqrt((along**2).sum(0)), 1e-300)
                - np.cos(leaves) * normal
            )
    return float((share * (alive & np.isfinite(way[0]))).sum())


@pytest.mark.slow
@pytest.mark.parametrize(("name", "f_number", "close"), LENSES)
def test_uniform_light_is_what_rays_counted_from_the_sensor_say(name, f_number, close):
    """Compare irradiance of uniform light with that of independent rays, in two bands.

    The points are on the axis, half way and at 0.9 of the field. The comparison covers throughput,
    relative illumination, distortion, lateral colour and the pupils of the bands.
    """
    lens = PrescribedLens(prescription=name, f_number=f_number, wavefront="none")
    waves = (450.0, 650.0)
    real = lens.real()
    x = quantities.centres(1201, 2 * np.tan(np.radians(real.half_field_deg)))
    y = quantities.centres(5, 1e-3)
    light = quantities.plane(np.ones((2, 5, 1201)), waves, x, y, quantities.RADIANCE)
    plane = sensor_plane(lens, light)
    found = (
        plane.move(np.broadcast_to(plane.relative, light.shape))
        * lens.gains_sr(waves)[:, None, None]
    )
    widest = float(np.arctan(np.hypot(x.max(), y.max())))
    notes = lens.limits(widest, light.wavelength.values)
    [allowed] = [
        e.value for e in notes if isinstance(e, ErrorTerm) and e.source.key == "traced illumination"
    ]
    for part in (0.0, 0.5, 0.9):
        at = int(np.argmin(np.abs(plane.x - part * plane.x[-1])))
        for band, wave in enumerate(waves):
            height = 4.0 * plane.x[at]
            want, off = counted_sr(real, height, wave)
            assert off < 1.2e-3 * want
            # 3e-4: 160 cells across the beam
            assert seen_sr(real, height, wave) == pytest.approx(want, abs=4 * off + 3e-4 * want)
            assert found[band, 2, at] == pytest.approx(want, abs=4 * off + close * want)
            attributes = lens.throughput_sr() * table_values(
                plane.attrs["falloff_table"], np.degrees(np.arctan(plane_tangent(plane, at)))
            )
            assert abs(attributes - want) < allowed * lens.throughput_sr() + 4 * off + 3e-4 * want


def plane_tangent(plane, at):
    return float(distortion_map(plane.attrs["distortion"]).inverse(plane.x[at], 0.0)[0])
