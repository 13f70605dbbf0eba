"""Textures: seeded spatial noise between two spectra, with the mean of both, constant in time."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_scenes.materials import MATERIALS
from isethdr_scenes.textures import look_of, textured

from isethdr_core.errors import ConfigError
from isethdr_core.scene import Material, Texture, flat


@pytest.fixture(autouse=True)
def llvm():
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def share(points, **fields):
    """Return the share of the second reflectance at points (n, 3)."""
    from isethdr_mitsuba.paths.texture_noise import TextureTables

    material = Material("m", reflectance=flat(0.2), texture=Texture(flat(0.4), **fields))
    tables = TextureTables([Material("plain"), material], 2)
    place = mi.Point3f(*np.asarray(points, np.float32).T)
    second, found = tables.share(mi.UInt32(1), place, mi.Bool(True))
    assert np.array(second)[0] == 2
    return np.array(found)


def cloud(count=200_000, seed=0):
    return np.random.default_rng(seed).uniform(-200, 200, (count, 3))


def test_half_of_each_on_average_and_another_seed_is_another_texture():
    points = cloud()
    one, again, other = (share(points, seed=s) for s in (3, 3, 4))
    assert np.array_equal(one, again)
    # points are in different patches of a metre: 200,000 independent values with a standard
    # deviation of 0.2
    assert one.mean() == pytest.approx(0.5, abs=0.003) and 0.1 < one.std() < 0.4
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.02
    assert one.min() >= 0 and one.max() <= 1


def test_noise_is_smooth_within_a_patch_and_new_in_the_next():
    points = cloud(50_000)
    here = share(points, patch_m=2.0, patches=1.0, grain=0.0)
    near = share(points + [0.002, 0, 0], patch_m=2.0, patches=1.0, grain=0.0)
    # the slope of smoothstep is at most 1.5 per cell, between values that differ by 2
    assert np.abs(near - here).max() < 0.002 / 2.0 * 1.5 + 1e-4
    apart = share(points + [20.0, 0, 0], patch_m=2.0, patches=1.0, grain=0.0)
    assert abs(np.corrcoef(here, apart)[0, 1]) < 0.02


def test_the_integrator_shows_both_spectra_and_their_mean(make):
    """Under a white sky, the radiance of a matt plane is its reflectance in each tile."""
    texture = Texture(flat(0.6), seed=1, patch_m=1.0, patches=1.0, grain=0.0)
    wall = Material("wall", reflectance=flat(0.2), texture=texture)
    scene = make.describe(
        [("wall", "building", (make.part(make.quad(60, 60, 20.0), "wall"),), make.pose())],
        make.camera((0, 0, 0), (1, 0, 0), 60.0, 1.0),
        make.flat(1.0),
        [wall],
    )
    settings = MitsubaRenderer(
        width=48, height=48, margin=0.0, step_nm=100.0, samples=64, max_depth=2
    )
    found = settings(scene).radiance.values[0, 1]
    # 0.02: 530 patches, with a standard deviation of 0.2 of the range of 0.4 each, over the root of
    # 530
    assert found.mean() == pytest.approx(0.4, abs=0.02)
    assert 0.2 < np.quantile(found, 0.02) < 0.3 and 0.5 < np.quantile(found, 0.98) < 0.6
    assert wall.mean_reflectance().at(550.0) == pytest.approx(0.4)


def test_a_metal_has_a_texture_too_and_reflects_no_more_than_its_light(make):
    """Under a white sky, the radiance of rough metal is between its two reflectances."""
    texture = Texture(flat(0.9), seed=1, patch_m=1.0, patches=1.0, grain=0.0)
    plate = Material("plate", "conductor", flat(0.5), 0.2, texture=texture)
    scene = make.describe(
        [("plate", "building", (make.part(make.quad(60, 60, 20.0), "plate"),), make.pose())],
        make.camera((0, 0, 0), (1, 0, 0), 60.0, 1.0),
        make.flat(1.0),
        [plate],
    )
    settings = MitsubaRenderer(
        width=24, height=24, margin=0.0, step_nm=100.0, samples=64, max_depth=2
    )
    found = settings(scene).radiance.values[0, 1]
    # 0.03: 130 patches, with a standard deviation of 0.2 of the range of 0.4 each, over the root of
    # 130: 0.007; facets lose less than 1 % here
    assert found.mean() == pytest.approx(0.7, abs=0.03)
    assert 0.49 < found.min() < 0.6 and 0.8 < found.max() < 0.91


@pytest.mark.parametrize("name", sorted(n for n in MATERIALS if look_of(n) is not None))
def test_a_textured_material_keeps_its_mean_and_is_possible(name):
    plain = MATERIALS[name]
    made = textured(MATERIALS[name], 7)
    nm = np.arange(380.0, 781.0)
    np.testing.assert_allclose(made.mean_reflectance().at(nm), plain.reflectance.at(nm), rtol=0.01)
    for spectrum in (made.reflectance, made.texture.other):
        assert 0 < spectrum.at(nm).min() and spectrum.at(nm).max() <= 1
    assert np.ptp(made.texture.other.at(nm) / made.reflectance.at(nm)) > 0.005  # colours differ


def test_a_texture_without_a_size_is_refused_by_name(make):
    from isethdr_mitsuba.world.materials import ramp_surfaces

    scene = make.describe([], materials=[Material("wall", texture=Texture(flat(0.4), grain_m=0.0))])
    with pytest.raises(ConfigError, match="material 'wall' has a texture.*grain=0"):
        ramp_surfaces(scene)
