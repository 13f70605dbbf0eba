"""Retro-reflectors as Mitsuba evaluates them: published R_A, energy, sampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_scenes.geometry.surroundings.road import STUD_FACE_M
from isethdr_scenes.materials import MATERIALS, RETRO
from isethdr_scenes.retro_reflectors import luminous_mean, retro_reflection

from isethdr_core.errors import ConfigError
from isethdr_core.scene import Material, RetroReflection, flat

from .bsdf_probe import albedo, chi_square_p, reciprocity, samples_agree, towards, value

# R_A, cd lx-1 m-2, at (observation angle, entrance angle) in degrees; `retro_reflectors` names the
# sources
R_A = {
    "ra1": {(0.2, 5): 70, (0.2, 30): 30, (0.333, 5): 50, (0.333, 40): 9, (2, 5): 5, (2, 30): 2.5},
    "ra2": {(0.2, 5): 250, (0.2, 30): 150, (0.333, 5): 180, (0.333, 40): 95, (2, 5): 5},
    "clothing": {(0.2, 5): 330, (0.2, 30): 180, (0.333, 5): 250, (1, 5): 25, (1.5, 5): 10},
    "stud": {(0.3, 5): 184.9, (1, 10): 21.0, (2, 15): 2.10},
    "vehicle_red": {(0.333, 0): 100, (0.333, 10): 67, (0.333, 20): 33, (1.5, 0): 1.67},
    "animal_eye": {(0.333, 0): 60, (1, 0): 33, (2, 0): 9},
}
BLACK = 1e-6  # reflectance of the base; with 0, the retro-reflector would reflect nothing


@pytest.fixture(autouse=True)
def llvm():
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def loaded(material):
    from isethdr_mitsuba.world.materials import surface

    return mi.load_dict(surface(material, 400.0, 700.0))


def geometry(observation_deg, entrance_deg):
    """Return unit vectors to light and observer in one plane with the normal."""
    at = lambda deg: np.stack([np.sin(np.radians(deg)), 0 * deg, np.cos(np.radians(deg))], -1)
    return at(entrance_deg), at(entrance_deg - observation_deg)


@pytest.mark.parametrize("name", sorted(R_A))
def test_r_a_is_that_of_the_source(name):
    bsdf = loaded(Material("s", "diffuse", flat(BLACK), retro=retro_reflection(name, flat(BLACK))))
    angles = np.array(list(R_A[name]))
    light, observer = geometry(angles[:, 0], angles[:, 1])
    found = value(bsdf, light, observer) * light[:, 2] * observer[:, 2]
    # 30 %: the model is a product of two functions of one angle each, fitted to the whole table
    np.testing.assert_allclose(found, list(R_A[name].values()), rtol=0.30)


def test_a_stud_has_the_r_i_of_its_standard_over_the_face_that_is_built():
    """Compare R_I of a stud, mcd/lx, and its fall towards an entrance angle of 20 degrees.

    `retro_reflectors` names the sources.
    """
    bsdf = loaded(
        Material("s", "diffuse", flat(BLACK), retro=retro_reflection("stud", flat(BLACK)))
    )
    angles = np.array([(0.3, 5.0), (1.0, 10.0), (2.0, 15.0), (0.2, 0.2), (0.2, 20.0)])
    light, observer = geometry(angles[:, 0], angles[:, 1])
    area_m2 = float(np.prod(STUD_FACE_M))
    found = 1e3 * area_m2 * value(bsdf, light, observer) * light[:, 2] * observer[:, 2]
    # 2e-3: three parameters are fitted to three values and rounded to 5 digits
    np.testing.assert_allclose(found[:3], [220.0, 25.0, 2.5], rtol=2e-3)
    assert found[4] / found[3] == pytest.approx(112 / 279, rel=0.01)  # 0.1 degrees off axis


@pytest.mark.parametrize("name", sorted(RETRO))
def test_materials_send_back_their_r_a_in_their_colour(name):
    material = MATERIALS[name]
    kind, times = RETRO[name][2:]
    observation, entrance = next(iter(R_A[kind]))
    light, observer = geometry(np.array([observation]), np.array([float(entrance)]))
    found = (value(loaded(material), light, observer) * light[:, 2] * observer[:, 2])[0]
    # evaluated at 550 nm, where R_A is scaled by the reflectance over its luminous mean
    colour = float(material.reflectance.at(550.0)) / luminous_mean(material.reflectance)
    assert found == pytest.approx(times * colour * R_A[kind][observation, entrance], rel=0.2)


@pytest.mark.parametrize("name", sorted(RETRO))
def test_no_reflector_sends_back_more_than_its_light(name):
    bsdf = loaded(MATERIALS[name])
    for elevation_deg in (1.0, 20.0, 50.0, 90.0):
        assert albedo(bsdf, elevation_deg, 20_000) < 0.95


def test_a_reflector_is_reciprocal_and_sampled_as_it_is_evaluated():
    bsdf = loaded(MATERIALS["plate_white"])
    assert reciprocity(bsdf) < 1e-3  # roughplastic's own tables are reciprocal to 4e-4
    for elevation_deg in (30.0, 85.0):
        assert max(samples_agree(bsdf, elevation_deg)) < 2e-3


def chi_square(name, entrance_deg, samples, order=6):
    """Return the p value of the retro-reflecting part only, in rings scaled to its width."""
    retro = retro_reflection(name, flat(1.0))
    bsdf = loaded(Material("s", "diffuse", flat(BLACK), retro=retro))
    rings = np.r_[0, np.geomspace(retro.width / 30, 1.9, 24)]
    return chi_square_p(bsdf, towards(90 - entrance_deg), rings, samples, order=order)


@pytest.mark.parametrize("name", ["clothing", "animal_eye"])
def test_directions_are_drawn_as_the_density_says(name):
    """Sampled directions have the stated density, by a chi-square test.

    By chance, p is below 1e-4 once in 10,000 seeds; the seed is fixed.
    """
    assert chi_square(name, 30.0, 50_000) > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(R_A))
@pytest.mark.parametrize("entrance_deg", [5.0, 30.0, 60.0])
def test_directions_are_drawn_as_the_density_says_everywhere(name, entrance_deg):
    """Repeat the chi-square test for all retro-reflectors and entrance angles, with more
    samples."""
    assert chi_square(name, entrance_deg, 1_000_000, order=10) > 1e-4


def test_the_scalar_variant_has_the_same_reflector():
    directions = [(0.333, 5.0), (2.0, 30.0)]
    light, observer = geometry(*np.array(directions).T)
    expected = value(loaded(MATERIALS["plate_white"]), light, observer)
    mi.set_variant("scalar_spectral")
    bsdf = loaded(MATERIALS["plate_white"])
    for way, eye, wanted in zip(light, observer, expected):
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*eye)
        si.wavelengths = mi.Spectrum(550.0)
        found = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*way))[0] / way[2]
        assert found == pytest.approx(wanted, rel=1e-3)  # rounding to float32


@pytest.mark.parametrize("fields", [{"share": 0.0}, {"share": 1.5}, {"falloff": 1.0}, {"width": 0}])
def test_impossible_retro_reflection_is_refused_by_name(make, fields):
    from isethdr_mitsuba.world.materials import ramp_surfaces

    retro = replace(RetroReflection(peak=1.0, width=1e-3, falloff=2.0), **fields)
    scene = make.describe([], materials=[make.material("sign", retro=retro)])
    with pytest.raises(ConfigError, match="material 'sign' has retro-reflection.*expected"):
        ramp_surfaces(scene)
