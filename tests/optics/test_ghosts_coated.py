"""Ghosts of coated surfaces against an independent ray trace; the ghosts of a headlamp with modern
coatings.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from isethdr_optics import GhostFlare, IdealLens
from isethdr_optics.flare.ghosts.trace import rank
from isethdr_optics.prescription.coatings import Powers, layers
from isethdr_optics.prescription.prescription import load
from isethdr_scenes.lamp_spectra import spectrum_of

from isethdr_core.physics.optics.thin_film import reflect_unpolarised

from .lamp_ghosts import flux, lamp


def airy_reflectance(
    cosine, n_from, n_to, layer=1.38233, thickness_nm=550.0 / 4 / 1.37851, wavelength_nm=430.0
):
    """Return the unpolarised reflectance of one layer by Airy's sum over its two borders.

    `cosine` is that of the angle of incidence.
    """
    sine = n_from * np.sqrt(1 - cosine**2)  # n sin is the same everywhere
    c1, c2, c3 = (np.sqrt(1 - (sine / n) ** 2) for n in (n_from, layer, n_to))
    turn = np.exp(4j * np.pi * layer * thickness_nm * c2 / wavelength_nm)
    total = 0.0
    for first, second in (
        (
            (n_from * c1 - layer * c2) / (n_from * c1 + layer * c2),
            (layer * c2 - n_to * c3) / (layer * c2 + n_to * c3),
        ),
        (
            (layer * c1 - n_from * c2) / (layer * c1 + n_from * c2),
            (n_to * c2 - layer * c3) / (n_to * c2 + layer * c3),
        ),
    ):
        total = total + np.abs((first + second * turn) / (1 + first * second * turn)) ** 2 / 2
    return total


def weighted_monte_carlo(lens, tangent, count, seed=2):
    """Trace photons along the only ghost of a singlet, weighted by Airy's reflectances.

    Return their positions (x, y) on the sensor, mm, their weights, and the area from which they
    start, mm2.
    """
    rng = np.random.default_rng(seed)
    stop, first, second, sensor = lens.surfaces
    r = stop.semi_diameter_mm
    polar = r * np.sqrt(rng.random(count))
    turn = 2 * np.pi * rng.random(count)
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
        normal = normal * np.sign(cosine)[:, None]
        cosine = np.abs(cosine)
        reflectance = airy_reflectance(cosine, n1, n2)
        weight *= reflectance if reflects else 1 - reflectance
        if reflects:
            way = way - 2 * cosine[:, None] * normal
        else:
            way = (way - cosine[:, None] * normal) * (n1 / n2) + np.sqrt(
                1 - (n1 / n2) ** 2 * (1 - cosine**2)
            )[:, None] * normal
    pos = pos + ((sensor.z_mm - pos[:, 2]) / way[:, 2])[:, None] * way
    return pos[:, :2], weight, np.pi * r**2


@pytest.mark.parametrize("column", [100, 130])
@pytest.mark.slow
def test_coated_surfaces_against_an_independent_monte_carlo_trace(bare, column):
    """Compare ghosts by transfer matrices of layers with those by Airy's sum.

    The trace here is independent: it intersects spheres by their centres.
    """
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    flare = GhostFlare(bare, coating="mgf2", error_allowed=0.0, sensor_reflectance_percent=0.0)
    # at 430 nm, since a quarter wave of MgF2 at 550 nm reflects almost nothing on glass of index
    # 1.9
    scene = lamp(201, 0.008, 100, column, bands=(430.0,))
    light = flare.irradiance(lens, scene)
    tangent = float(scene.x[column])
    count = 200_000
    spots, weight, area_mm2 = weighted_monte_carlo(flare.of_lens(lens), tangent, count)
    power = 1e3 * 0.008**2 * (1 + tangent**2) ** -2 * area_mm2 * 1e-6
    spread = weight.std() / weight.mean() / np.sqrt(count)
    # 0.006: 0.4 % for the borders of the pupil grid, as for the uncoated lens, and the rounded
    # index of MgF2 here
    assert flux(light)[0] / (power * weight.mean()) == pytest.approx(1.0, abs=3 * spread + 0.006)
    share = light.values[0] / light.values[0].sum()
    x_mm = light.x.values * 1e3
    mean = weight @ spots[:, 0] / weight.sum()
    size = np.sqrt(weight @ (spots[:, 0] - mean) ** 2 / weight.sum())
    # 0.025: rays are interpolated linearly over a radial bin of the field
    assert share.sum(0) @ x_mm == pytest.approx(mean, abs=0.025 * size)
    assert (
        flux(light)[0]
        < 0.5
        * flux(
            GhostFlare(bare, error_allowed=0.0, sensor_reflectance_percent=0.0).irradiance(
                lens, scene
            )
        )[0]
    )


VISIBLE = np.arange(400.0, 701.0, 10.0)
SENSOR = 0.02  # share of the light that the sensor reflects specularly
LENSES = [("double_gauss", 4.0, 14.0), ("cooke_triplet", 5.6, 20.0)]


def pairs(name, f_number, half_field_deg, coating):
    """Return the share of the light of every ghost pair in each visible band.

    Pairs of a surface and the sensor are included.
    """
    powers = Powers(load(name).stopped(f_number).with_coating(coating), VISIBLE, SENSOR)
    found = []
    for pair in rank(powers, float(np.tan(np.radians(half_field_deg)))):
        product = powers.at_normal(pair.front) * powers.at_normal(pair.back)
        # the rank uses the largest reflectance of each surface over all bands
        largest = powers.at_normal(pair.front).max() * powers.at_normal(pair.back).max()
        found.append(pair.share * product / largest)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("lamp_light", ["led_white", "halogen"])
@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: lens[0])
def test_three_layers_keep_a_headlamp_s_flux_in_any_pair_below_a_ten_thousandth(lens, lamp_light):
    light = spectrum_of(lamp_light).at(VISIBLE)
    shares = {
        c: max(float(p @ light) / light.sum() for p in pairs(*lens, c))
        for c in ("none", "mgf2", "multilayer", "broadband")
    }
    assert shares["multilayer"] < 1e-4 and shares["broadband"] < 5e-5
    assert shares["none"] > 3e-3 and shares["mgf2"] > 3 * shares["multilayer"]
    # this does not hold at 400 nm, where a headlamp emits almost no light
    assert max(p.max() for p in pairs(*lens, "multilayer")) > 1e-4


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: lens[0])
def test_the_broadband_coating_keeps_every_pair_below_a_ten_thousandth_in_every_band(lens):
    found = pairs(*lens, "broadband")
    assert len(found) > 10 and max(p.max() for p in found) < 1e-4
    ranked = rank(Powers(load(lens[0]).stopped(lens[1]), VISIBLE), 0.2)
    assert any(p.magnification < 0 for p in ranked[:10])  # a ghost on the other side of the axis


@pytest.mark.parametrize("index", [1.5, 1.52, 1.58, 1.63])
def test_the_broadband_coating_reflects_what_it_says(index):
    for wave in np.arange(400.0, 701.0, 5.0):
        found = reflect_unpolarised(
            1.0, index, layers("broadband", wave), np.cos(np.radians([0.0, 10.0, 20.0])), wave
        )[0]
        assert found.max() < 0.0055


@dataclass(frozen=True)
class StrongestPair(GhostFlare):
    """The ghost of the one pair that reflects most."""

    def pairs(self, lens, wavelength_nm, largest_tangent):
        """Return only the strongest pair as traced."""
        traced, left = super().pairs(lens, wavelength_nm, largest_tangent)
        return traced[:1], traced[1:] + left


def test_rays_agree_that_the_strongest_pair_takes_less_than_a_ten_thousandth():
    """Sum all light of the ghost on a frame that is much wider than the camera's field."""
    lens = IdealLens(f_number=4.0, falloff="none", focal_length_mm=4.0)
    wave = np.arange(400.0, 701.0, 25.0)
    light = spectrum_of("led_white").at(wave)
    for coating, worst in (("multilayer", 1e-3), ("broadband", 1e-4)):
        flare = StrongestPair(
            "double_gauss", coating=coating, error_allowed=0.0, sensor_reflectance_percent=0.0
        )
        scene = lamp(95, 0.02, 47, 47, wave)
        share = flux(flare.irradiance(lens, scene)) / flux(lens(scene))
        assert 0 < share.max() < worst and float(share @ light) / light.sum() < 1e-4
