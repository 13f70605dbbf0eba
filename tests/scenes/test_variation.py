"""Materials that vary between objects, dust on vehicles, and signs of a night road."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.builders import RECIPES
from isethdr_scenes.coloured import COATS, FINISHES, material_of, name_of
from isethdr_scenes.geometry.mesh.piece import face_areas
from isethdr_scenes.materials import MATERIALS, METAL, RETRO, used
from isethdr_scenes.placing.camera import Eye
from isethdr_scenes.placing.plan import Layout, Standing
from isethdr_scenes.placing.site import Foot
from isethdr_scenes.retro_reflectors import RED_OVER_WHITE, luminous_mean
from isethdr_scenes.roads.kinds import kind
from isethdr_scenes.street_models import HIDDEN, model_names, things_of
from isethdr_scenes.textures import LOOKS, PLAIN, look_of, textured
from isethdr_scenes.things import draw
from isethdr_scenes.variation import DIRTY, MOST_DUST, varied

from isethdr_core.scene import Model, Part

NM = np.arange(400.0, 701.0, 10)
COATED = (Part("p", np.eye(3), np.array([[0, 1, 2]]), "paint_red"),)


def models(count, material):
    corner = np.eye(3)
    part = Part("p", corner, np.array([[0, 1, 2]]), material)
    return {f"car{k}": Model("car", (part,)) for k in range(count)}


def own(count, material, seed=0):
    """Return the varied materials of `count` models that have the same material."""
    changed, materials = varied(models(count, material), MATERIALS, seed)
    assert {p.material for m in changed.values() for p in m.parts} == set(materials)
    return [materials[changed[f"car{k}"].parts[0].material] for k in range(count)]


@pytest.mark.parametrize("name", ["cloth_white", "fur", "skin", "paint_silver"])
def test_the_mean_of_many_objects_is_the_spectrum_of_the_class(name):
    clean = [m.reflectance if "paint" in name else m.mean_reflectance() for m in own(300, name)]
    values = np.array([spectrum.at(NM) for spectrum in clean])
    assert (values.std(0) / values.mean(0)).min() > 0.05 and (values <= 0.92).all()
    base = MATERIALS[name].reflectance.at(NM)
    # objects vary by 12 %, so the mean of 300 has a standard error of 0.7 %; the mean of a
    # lognormal distribution is 0.7 % higher
    np.testing.assert_allclose(values.mean(0), base, rtol=0.06)


def test_the_same_seed_gives_the_same_materials_and_another_others():
    first = own(3, "paint_red")
    again = own(3, "paint_red")
    other = own(3, "paint_red", seed=1)
    assert first == again
    assert first[0].reflectance != first[1].reflectance != other[1].reflectance


def test_the_looks_of_things_stay_when_others_leave_the_picture_or_lamps_change():
    rng = np.random.default_rng(1)
    one, two = (draw("rock", rng) for _ in range(2))
    feet = [Foot(name, thing, 9.0, 0.0, 0.0) for name, thing in zip("abc", (one, two, two))]
    standing = tuple(Standing(foot, np.eye(4)) for foot in feet)
    layout = Layout(kind("country_straight", 1), standing, ())
    place = Eye(np.zeros(3), np.array([1.0, 0.0, 0.0]))
    names = model_names(layout, list(layout.standing))
    assert names["a"] != names["b"] == names["c"]
    shown = (
        *layout.standing[1:2],
        replace(layout.standing[2], foot=replace(feet[2], lamps=("x",))),
    )
    later = replace(layout, standing=(layout.standing[0], *shown))
    built, objects = things_of(later, list(shown), place, {}, "dipped_r112_b", names)
    hidden, second, third = (placed.model for placed in objects)
    assert hidden == HIDDEN and second == names["b"] and third != second
    changed, _ = varied({k: replace(m, parts=COATED) for k, m in built.items()}, MATERIALS, 1)
    assert changed[second].parts[0].material == changed[third].parts[0].material


def test_dust_hides_paint_by_its_share_and_never_reflects_more_than_either():
    dust = []
    for m in own(200, "paint_black"):
        clean = m.reflectance.at(NM)
        dirty = m.texture.other.at(NM)
        assert (dirty >= clean - 1e-12).all() and (dirty < 0.3).all()  # soil is brighter than black
        dust.append(((m.mean_reflectance().at(NM) - clean) / (np.interp(NM, *SOIL) - clean)).mean())
    assert 0 <= min(dust) and max(dust) <= MOST_DUST + 1e-9
    assert np.mean(dust) == pytest.approx(MOST_DUST / 2, abs=0.03)


SOIL = (400.0, 500.0, 600.0, 700.0), (0.12, 0.17, 0.22, 0.26)


def test_what_is_measured_by_class_does_not_vary():
    for name in ("plate_white", "sheeting_white", "glass", "lamp_red", "reflective_band"):
        assert own(1, name)[0] is MATERIALS[name]


def test_red_sheeting_sends_back_its_share_of_the_white_one():
    white = MATERIALS["sheeting_white"]
    red = MATERIALS["sheeting_red"]
    assert red.retro == white.retro  # one surface, two colours
    share = luminous_mean(red.reflectance) / luminous_mean(white.reflectance)
    assert share == pytest.approx(RED_OVER_WHITE, rel=1e-6)


@pytest.mark.parametrize("name", ["deer", "limit"])
def test_a_sign_faces_who_comes_and_stands_on_the_ground(name):
    parts = RECIPES["sign"](name).model().parts
    faces = {p.material: p for p in parts if p.material.startswith(("sheeting", "plate"))}
    assert set(faces) == {"sheeting_red", "sheeting_white", "plate_ink"}
    for part in faces.values():
        assert (face_areas(part)[:, 0] < 0).all() and np.ptp(part.vertices[:, 1]) > 0.1
    front = {k: p.vertices[:, 0].min() for k, p in faces.items()}
    assert front["plate_ink"] < front["sheeting_white"] < front["sheeting_red"]
    assert (
        min(p.vertices[:, 2].min() for p in parts)
        < 0
        < 2
        <= faces["sheeting_red"].vertices[:, 2].min() + 1e-9
    )


def test_no_material_is_one_flat_spectrum_but_those_that_say_why():
    """Every material of a street or night drive has a texture: dust on paint, a look on others.

    The exceptions are listed with their reason.
    """
    plain = {n for n in MATERIALS if look_of(n) is None and not n.startswith(DIRTY)}
    assert plain == set(PLAIN)
    assert not set(PLAIN) & set(LOOKS)
    # materials without a texture are glass, covers of lamps or retro-reflectors
    for name, why in PLAIN.items():
        material = MATERIALS[name]
        assert why.startswith(("a pane", "cover of a lamp", "a retro-reflector"))
        assert why.startswith("a retro-reflector") == (name in RETRO or "sheeting" in name)
        assert why.startswith("a pane") or material.kind != "thin_glass"


def test_what_an_asset_pack_colours_has_the_look_of_its_finish():
    for finish in FINISHES:
        name = name_of("#806040", finish)
        made = used({"thing": Model("thing", (Part("p", np.eye(3), np.array([[0, 1, 2]]), name),))})
        assert (made[name].texture is None) == (finish == "glass")
        np.testing.assert_allclose(
            made[name].mean_reflectance().at(NM), material_of(name).reflectance.at(NM), rtol=0.01
        )
    assert {*COATS, "matt", "metal", "glass"} == set(FINISHES)


@pytest.mark.parametrize("name", ["fur", "cloth_white", "skin"])
def test_a_material_that_varies_keeps_its_mean_under_its_texture(name):
    """Vary a material as scenes do: first add its texture, then vary the spectrum per object."""
    once = varied(models(1, name), {name: MATERIALS[name]}, 3)[1]
    twice = varied(models(1, name), used(models(1, name), seed=3), 3)[1]
    (first,) = once.values()
    (second,) = twice.values()
    # 1 %: the spectra have different nodes, with linear interpolation between them
    np.testing.assert_allclose(
        second.mean_reflectance().at(NM), first.mean_reflectance().at(NM), rtol=0.01
    )
    assert second.texture is not None


@pytest.mark.parametrize("name", sorted(METAL))
def test_metal_under_dirt_reflects_no_more_than_it_gets(name):
    made = textured(MATERIALS[name], 5)
    assert made.kind == "conductor" and made.roughness == MATERIALS[name].roughness
    for spectrum in (made.reflectance, made.texture.other):
        assert 0 < spectrum.at(NM).min() and spectrum.at(NM).max() <= 1
