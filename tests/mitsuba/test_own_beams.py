"""Luminance of the road ahead in the dipped beams of the camera car: by formula, and rendered."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_mitsuba.world.materials import surface
from isethdr_scenes.geometry.vehicles.headlamp import own_headlamps
from isethdr_scenes.lamps import lamp
from isethdr_scenes.materials import MATERIALS
from isethdr_scenes.placement import OWN_LAMPS
from isethdr_scenes.road_surfaces import DEFAULT, DRY_MARKING_R_L, road_materials, road_surfaces

from isethdr_core.physics.photometry import luminance
from isethdr_core.scene import Camera, Model, Part, Placed, SceneDescription

from .world.bsdf_probe import value

EYE_M = np.array([0.0, 0.0, 1.3])
AHEAD_M, ASIDE_M, HEIGHT_M = OWN_LAMPS
LINE_M = -1.7  # y of the edge line


@pytest.fixture(autouse=True)
def llvm():
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def by_formula(material, metres, across=0.0):
    """Return the luminance of a flat road, cd/m2, and the illuminance on a plane that faces the
    lamps, lx, at distances from the lamps. Both lamps are points.
    """
    bsdf = mi.load_dict(surface(material, 400.0, 700.0))
    beam = lamp("low_beam", (1.0, 0.0, 0.0))
    metres = np.asarray(metres, float)
    points = np.stack([AHEAD_M + metres, across + 0 * metres, 0 * metres], -1)
    to_eye = EYE_M - points
    to_eye /= np.linalg.norm(to_eye, axis=-1, keepdims=True)
    total = 0.0
    lux = 0.0
    for side in (ASIDE_M, -ASIDE_M):
        way = np.array([AHEAD_M, side, HEIGHT_M]) - points
        far = np.linalg.norm(way, axis=-1)
        light = way / far[:, None]
        left = np.arctan2(-light[:, 1], -light[:, 0])
        up = np.arcsin(-light[:, 2])
        candela = beam.intensity_cd * beam.table.at(np.degrees(left), np.degrees(up))
        each = candela / far**2
        lux = lux + each
        total = total + value(bsdf, light, to_eye) * each * light[:, 2]
    return total, lux


def test_the_road_at_30_m_has_the_luminance_of_its_class():
    materials = road_materials(DEFAULT)
    (found,), (lux,) = by_formula(materials["asphalt"], [30.0])
    assert found / lux == pytest.approx(1e-3 * road_surfaces()[DEFAULT].r_l, rel=0.10)
    assert 0.09 < found < 0.5  # cd/m2; measured roads have 0.09 to 0.19, older lamps
    (line,), (line_lux,) = by_formula(materials["road_paint"], [30.0], LINE_M)
    (beside,), (beside_lux,) = by_formula(materials["asphalt"], [30.0], LINE_M)
    assert line_lux == beside_lux
    ratio = DRY_MARKING_R_L / road_surfaces()[DEFAULT].r_l
    assert line / beside == pytest.approx(ratio, rel=0.15)


def test_the_luminance_of_the_road_falls_from_10_to_50_m():
    metres = np.arange(10.0, 50.5, 0.5)
    for across in (0.0, LINE_M):
        found, _ = by_formula(road_materials(DEFAULT)["asphalt"], metres, across)
        assert (np.diff(found) < 0).all()
        # limits from measurements on a road at night: FHWA-HRT-04-138, appendix I, table 13, four
        # positions across the road; modern lamps are up to twice as bright
        assert 0.11 < found[0] < 2 * 0.58 and 0.03 < found[-1] < 2 * 0.11


def flat_road():
    """Return a straight road with an edge line, and the lamps of the camera car."""

    def strip(name, y, z, material):
        corners = [[-20, y[0], z], [300, y[0], z], [300, y[1], z], [-20, y[1], z]]
        return Part(name, np.array(corners, float), np.array([[0, 1, 2], [0, 2, 3]]), material)

    lamps = own_headlamps(*OWN_LAMPS).model()
    road = Model(
        "road",
        (
            strip("asphalt", (-60.0, 60.0), 0.0, "asphalt"),
            strip("line", (LINE_M - 0.5, LINE_M + 0.5), 0.001, "road_paint"),
        ),
    )
    objects = tuple(Placed(n, n, c, np.eye(4)) for n, c in (("road", "road"), ("lamps", "car")))
    materials = road_materials(DEFAULT)
    for part in lamps.parts:
        materials[part.material] = MATERIALS[part.material]
    # tiles of 0.1 x 0.01 degrees: four of them cover half a metre along the road at 30 m
    camera = Camera(tuple(EYE_M), (AHEAD_M + 30.0, -0.85, 0.0), 4.0, 20.0)
    return SceneDescription("flat", {"road": road, "lamps": lamps}, objects, materials, camera)


@pytest.mark.slow
def test_the_rendered_road_has_the_luminance_of_the_formula():
    settings = MitsubaRenderer(width=40, height=20, margin=0.0, samples=512, max_depth=2)
    ds = settings(flat_road())
    found = luminance(ds.radiance.sel(light_group="headlights").values, ds.wavelength.values)
    materials = road_materials(DEFAULT)
    for across, material in ((0.0, "asphalt"), (LINE_M, "road_paint")):
        x = ((across + 0.85) / -(AHEAD_M + 30.0) - ds.x.values) ** 2
        row = found.shape[0] // 2
        column = int(x.argmin())
        seen = found[row - 2 : row + 2, column - 1 : column + 2].mean()
        (formula,), _ = by_formula(materials[material], [30.0], across)
        # 3 %: bands contain 99.6 % of the luminance; lamps of 5 cm and half a metre of road:
        # 1 %; noise of paths: 1 %
        assert seen == pytest.approx(formula, rel=0.03)
