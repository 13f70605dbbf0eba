"""Ghosts of coated surfaces against a trace and reflectances that share nothing with the product."""

import numpy as np
import pytest
import yaml
from isethdr_optics import GhostFlare, IdealLens

from isethdr_core import quantities

SINGLET = {
    "name": "bare",
    "f_number": 4.0,
    "surfaces": [
        {"stop": True, "thickness_mm": 0.5, "semi_diameter_mm": 12.0},
        {"radius_mm": 150.0, "thickness_mm": 6.0, "glass": "1.9", "semi_diameter_mm": 14.0},
        {"radius_mm": -220.0, "semi_diameter_mm": 14.0},
    ],
}


@pytest.fixture
def bare(tmp_path):
    path = tmp_path / "bare.yaml"
    path.write_text(yaml.safe_dump(SINGLET))
    return str(path)


def lamp(n, pitch, row, column, bands=(550.0,)):
    x = quantities.centres(n, n * pitch)
    values = np.zeros((len(bands), n, n))
    values[:, row, column] = 1e3
    return quantities.plane(values, list(bands), x, x, quantities.RADIANCE)


def flux(light):
    """Return the flux on the sensor, W/nm per band."""
    return light.values.sum(axis=(1, 2)) * quantities.tile_pitch(light, "x") * quantities.tile_pitch(light, "y")


def airy_reflectance(cosine, n_from, n_to, layer=1.38233, thickness_nm=550.0 / 4 / 1.37851, wavelength_nm=430.0):
    """Return the unpolarised reflectance of one layer by Airy's sum over its two borders, at incidence of `cosine`."""
    sine = n_from * np.sqrt(1 - cosine**2)  # n sin is the same everywhere
    c1, c2, c3 = (np.sqrt(1 - (sine / n) ** 2) for n in (n_from, layer, n_to))
    turn = np.exp(4j * np.pi * layer * thickness_nm * c2 / wavelength_nm)
    total = 0.0
    for first, second in (
        ((n_from * c1 - layer * c2) / (n_from * c1 + layer * c2), (layer * c2 - n_to * c3) / (layer * c2 + n_to * c3)),
        ((layer * c1 - n_from * c2) / (layer * c1 + n_from * c2), (n_to * c2 - layer * c3) / (n_to * c2 + layer * c3)),
    ):
        total = total + np.abs((first + second * turn) / (1 + first * second * turn)) ** 2 / 2
    return total


def weighted_monte_carlo(lens, tangent, count, seed=2):
    """Trace photons along the one ghost of a singlet, weighted by Airy's reflectances; return (x, y), weights, start area."""
    rng = np.random.default_rng(seed)
    stop, first, second, sensor = lens.surfaces
    r = stop.semi_diameter_mm
    polar, turn = r * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    pos = np.stack([polar * np.cos(turn), polar * np.sin(turn), np.full(count, stop.z_mm)], axis=1)
    way = np.tile(np.array([tangent, 0.0, 1.0]) / np.hypot(1, tangent), (count, 1))
    weight = np.ones(count)
    for surface, n1, n2, reflects in (
        (first, 1.0, 1.9, False),
        (second, 1.9, 1.0, True),
        (first, 1.9, 1.0, True),
        (second, 1.9, 1.0, False),
    ):
        centre = np.array([0, 0, surface.z_mm + 1 / surface.curvature_per_mm])
        to = pos - centre
        b = (to * way).sum(1)
        root = np.sqrt(b**2 - (to**2).sum(1) + surface.curvature_per_mm**-2)
        both = pos[:, None] + np.stack([-b - root, -b + root], 1)[..., None] * way[:, None]
        pos = both[np.arange(len(pos)), np.abs(both[..., 2] - surface.z_mm).argmin(1)]
        weight[np.hypot(pos[:, 0], pos[:, 1]) > surface.semi_diameter_mm] = 0.0
        normal = (pos - centre) / np.linalg.norm(pos - centre, axis=1)[:, None]
        cosine = (way * normal).sum(1)
        normal, cosine = normal * np.sign(cosine)[:, None], np.abs(cosine)
        reflectance = airy_reflectance(cosine, n1, n2)
        weight *= reflectance if reflects else 1 - reflectance
        if reflects:
            way = way - 2 * cosine[:, None] * normal
        else:
            way = (way - cosine[:, None] * normal) * (n1 / n2) + np.sqrt(1 - (n1 / n2) ** 2 * (1 - cosine**2))[:, None] * normal
    pos = pos + ((sensor.z_mm - pos[:, 2]) / way[:, 2])[:, None] * way
    return pos[:, :2], weight, np.pi * r**2


@pytest.mark.parametrize("column", [100, 130])
def test_coated_surfaces_against_an_independent_monte_carlo_trace(bare, column):
    """Stacks by matrices, angle by angle, in the product; Airy's sum and spheres by their centres here."""
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    flare = GhostFlare(bare, coating="mgf2", error_allowed=0.0, sensor_reflectance_percent=0.0)
    # at 430 nm: at 550 a quarter wave of MgF2 leaves next to nothing on glass of 1.9
    scene = lamp(201, 0.008, 100, column, bands=(430.0,))
    light, tangent, count = flare.irradiance(lens, scene), float(scene.x[column]), 200_000
    spots, weight, area_mm2 = weighted_monte_carlo(flare.of_lens(lens), tangent, count)
    power = 1e3 * 0.008**2 * (1 + tangent**2) ** -2 * area_mm2 * 1e-6
    spread = weight.std() / weight.mean() / np.sqrt(count)
    # 0.4 %: borders of the pupil grid, as for the bare lens; MgF2's index is rounded here
    assert flux(light)[0] / (power * weight.mean()) == pytest.approx(1.0, abs=3 * spread + 0.006)
    share = light.values[0] / light.values[0].sum()
    x_mm = light.x.values * 1e3
    mean = weight @ spots[:, 0] / weight.sum()
    size = np.sqrt(weight @ (spots[:, 0] - mean) ** 2 / weight.sum())
    assert share.sum(0) @ x_mm == pytest.approx(mean, abs=0.025 * size)  # rays go linearly over a radial bin of the field
    assert (
        flux(light)[0]
        < 0.5 * flux(GhostFlare(bare, error_allowed=0.0, sensor_reflectance_percent=0.0).irradiance(lens, scene))[0]
    )
