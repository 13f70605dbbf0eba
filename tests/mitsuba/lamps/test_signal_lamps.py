"""Lamps of vehicles in a rendered scene have the candela of their tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_scenes import things
from isethdr_scenes.builders import RECIPES
from isethdr_scenes.lamps import KINDS

from isethdr_core.physics.photometry import luminance
from isethdr_core.scene import Camera, Material, Model, Placed, SceneDescription, flat

FAR_M = 40.0
CELL = 0.04  # distance of neighbouring lamps as a tangent: 1.6 m
DIRECTIONS = ((0.0, 0.0), (10.0, 5.0), (-20.0, -5.0))  # degrees left of and above the lamp's axis
TABLES = sorted(k for k, v in KINDS.items() if v.family)


@pytest.fixture(scope="module")
def models():
    """Return the parts of a car with curved lenses, a truck, a bicycle, and a drawn car, which has
    daytime lamps.
    """
    recipes = (("car", "sedan", "red"), ("truck",), ("bicycle",))
    drawn = things.build(things.draw("car", np.random.default_rng([0, 0]), "sedan"), "near")
    return [*(RECIPES[name](*rest).model().parts for name, *rest in recipes), drawn.parts]


def unit(left_deg, up_deg):
    a, b = np.radians([left_deg, up_deg])
    return np.array([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)])


def frame(direction):
    """Return axes as columns: the first along a direction, the second horizontal."""
    aside = np.cross([0.0, 0.0, 1.0], direction)
    aside /= np.linalg.norm(aside)
    return np.stack([direction, aside, np.cross(direction, aside)], 1)


def shown(part, number, left_deg, up_deg, at):
    """Return a lamp at a point, turned so that the camera at the origin sees it at given angles."""
    part = replace(part, material="dark")
    axis = np.degrees(np.arctan2(part.lamp.axis[1], part.lamp.axis[0]))
    pose = np.eye(4)
    pose[:3, :3] = frame(-at / np.linalg.norm(at)) @ frame(unit(axis + left_deg, up_deg)).T
    pose[:3, 3] = at - pose[:3, :3] @ (part.vertices.max(0) + part.vertices.min(0)) / 2
    name = f"lamp {number}"
    return Model(name, (part,)), Placed(name, name, "car", pose)


def luminances(pairs, camera, width, height):
    """Return luminance times solid angle of tiles, cd/m2 sr, of lamps in front of darkness."""
    models = {m.name: m for m, _ in pairs}
    placed = tuple(p for _, p in pairs)
    dark = {"dark": Material("dark", reflectance=flat(0.0))}
    description = SceneDescription("lamps", models, placed, dark, camera)
    spectral = {"first_nm": 380.0, "last_nm": 780.0, "samples": 1, "max_depth": 1}
    ds = MitsubaRenderer(width=width, height=height, margin=0.0, **spectral)(description)
    x, y = np.meshgrid(ds.x.values, ds.y.values)
    # the solid angle is the area in tangents times the cubed cosine of the angle to the camera's
    # axis
    solid = ds.attrs["pitch_x"] * ds.attrs["pitch_y"] * (1 + x**2 + y**2) ** -1.5
    return luminance(ds.radiance.values.sum(0), ds.wavelength.values) * solid


@pytest.mark.slow
def test_rendered_lamps_have_the_candela_of_their_tables(models):
    """Compare all kinds of lamps with their tables, from three directions each, in one picture."""
    pairs = []
    expected = []
    for k, kind in enumerate(TABLES):
        part = next(p for parts in models for p in parts if p.lamp and p.lamp.kind == kind)
        for j, (left, up) in enumerate(DIRECTIONS):
            at = FAR_M * np.array([1.0, CELL * (len(TABLES) / 2 - 0.5 - k), CELL * (1 - j)])
            pairs.append(shown(part, len(pairs), left, up, at))
            cd = part.lamp.intensity_cd
            expected.append((cd * part.lamp.table.at(left, up), cd, at @ at))
    across = len(TABLES)
    down = len(DIRECTIONS)
    field = 2 * np.degrees(np.arctan(CELL * across / 2))
    camera = Camera((0, 0, 0), (1, 0, 0), float(field), across / down)
    found = luminances(pairs, camera, 4 * across, 4 * down)
    cells = found.reshape(down, 4, across, 4).sum((1, 3)).T.ravel()
    for lux, (candela, largest, distance2) in zip(cells, expected, strict=True):
        # 0.5 %: Lambertian light of the lens, up to 0.4 % of the largest intensity; 2 %: the grid
        # of the pattern, 1 %
        assert lux * distance2 == pytest.approx(candela, rel=0.02, abs=0.005 * largest)


@pytest.mark.slow
def test_the_body_hides_no_tail_lamp_from_behind(models):
    """View all rear lamps of a car, with its body, from 5 degrees above."""
    rear = [p for p in models[0] if p.lamp and p.lamp.axis[0] < 0]
    parts = [p if p.lamp in [r.lamp for r in rear] else replace(p, lamp=None) for p in models[0]]
    model = Model("car", tuple(replace(p, material="dark") for p in parts))
    target = np.array([rear[0].vertices[:, 0].min(), 0.0, 0.9])
    eye = target + FAR_M * unit(180.0, 5.0)
    camera = Camera(tuple(eye.tolist()), tuple(target.tolist()), 4.0, 1.0)
    found = luminances([(model, Placed("car", "car", "car", np.eye(4)))], camera, 8, 8)
    expected = sum(p.lamp.intensity_cd * p.lamp.table.at(0.0, 5.0) for p in rear)
    # 5 %: the rims of lenses extend into the body by some millimetres
    assert found.sum() * FAR_M**2 == pytest.approx(expected, rel=0.05)
