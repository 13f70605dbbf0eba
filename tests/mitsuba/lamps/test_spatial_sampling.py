"""Spatial light sampling: lamps are chosen by their light at each part of the picture. Occluded
lamps
are chosen rarely, but every lamp has a chance.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.lamps import spatial_sampling
from isethdr_mitsuba.lamps.lamp_tables import LampTables
from isethdr_mitsuba.paths.passes import Frame, estimate
from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.scene import Camera, Lamp

from ..paths.test_integrator import compiled

CAMERA = Camera((0, 0, 1.4), (18, 0, 1.2), 50.0, 16 / 9)


@pytest.fixture(autouse=True)
def llvm():
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def test_slots_go_by_light_and_each_lamp_keeps_one():
    light = np.random.default_rng(5).lognormal(0, 4, (40, 12))
    light[3], light[4, :] = 0.0, np.eye(12)[7]
    strength = np.arange(1.0, 13)
    slots = spatial_sampling.slots_of(light, strength)
    chance = spatial_sampling.shares_of(slots, 12)
    np.testing.assert_allclose(
        chance, np.stack([(slots == k).mean(1) for k in range(12)], 1), rtol=1e-15
    )
    each = 1 / slots.shape[1]
    assert slots.shape == (40, 12 * spatial_sampling.SLOTS) and chance.min() == pytest.approx(each)
    by = np.where(np.arange(40)[:, None] == 3, strength, light)
    want = each + (1 - 12 * each) * by / by.sum(1, keepdims=True)
    assert np.abs(chance - want).max() <= each * (1 + 1e-9), "a share may be off by a slot"
    assert chance[4, 7] == pytest.approx(1 - 11 * each)


def test_each_point_has_one_vote_at_its_place():
    light = np.array([[1e9, 0.0], [1.0, 3.0], [0.0, 0.0], [2.0, 2.0]])
    np.testing.assert_allclose(
        spatial_sampling.votes(3, np.array([0, 0, 0, 2]), light), [[1.25, 0.75], [0, 0], [0.5, 0.5]]
    )


def test_cells_go_around_the_camera_and_outwards():
    import mitsuba as mi

    around, rings = spatial_sampling.CELLS
    degrees, far = np.meshgrid(
        -180 + (np.arange(around) + 0.5) * 360 / around,
        300.0 ** ((np.arange(rings) + 0.5) / rings),
        indexing="ij",
    )
    x = far * np.cos(np.radians(degrees))
    y = far * np.sin(np.radians(degrees))
    found = spatial_sampling.cell_of(
        mi.Vector3f(*(np.float32(v.ravel()) for v in (x, y, 7 + 0 * x)))
    )
    np.testing.assert_array_equal(np.array(found), np.arange(around * rings))
    ends = np.array(
        spatial_sampling.cell_of(mi.Vector3f([0.0, 1e9, -1e9], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]))
    )
    assert (ends < around * rings).all() and list(ends % rings) == [0, rings - 1, rings - 1], (
        "nothing lies outside"
    )


def yard(make):
    """Return a scene with a wall along the road, between two lamps that point down."""
    down = Lamp("street", "streetlights", 1000.0, make.flat(1.0), (0, 0, -1.0), 80.0, 89.0, 0.0)
    ground = make.part((make.quad(60, 60)[0][:, [2, 1, 0]], make.quad(60, 60)[1]), "grey")
    wall = make.part(make.quad(28, 8), "grey")
    lying = make.part((make.quad(0.4, 0.2)[0][:, [2, 1, 0]], make.quad(0.4, 0.2)[1]), "grey", down)
    objects = [
        ("ground", "road", (ground,), make.pose()),
        ("wall", "building", (wall,), make.pose(31, 0, 4, 90.0)),
        *(
            (f"lamp{i}", "street lamp", (lying,), make.pose(15, y, 3))
            for i, y in enumerate((5.0, -5.0))
        ),
    ]
    return make.describe(
        objects, CAMERA, materials=[make.material("grey", reflectance=make.flat(0.3))]
    )


def test_a_lamp_behind_a_wall_is_hardly_looked_at(make, monkeypatch):
    kept = []
    aim = LampTables.aim
    monkeypatch.setattr(
        LampTables, "aim", lambda self, *given: (aim(self, *given), kept.append(self.chances))[0]
    )
    settings = MitsubaRenderer(width=64, height=36, margin=0.0, step_nm=100.0)
    compiled(yard(make), settings, ["streetlights"])
    chance = np.array(kept[0].chance).reshape(-1, 2)
    blocks = 64 * 36
    assert len(chance) == blocks + np.prod(spatial_sampling.CELLS)
    assert chance[blocks:].sum(1) == pytest.approx(1.0)
    assert (chance[blocks:] == 0.5).all(1).any(), (
        "nobody looked into some cells: lamps by strength, and these are alike"
    )
    # The road in front of the camera, on each side of the wall: the lamp on this side is near, and
    # so has no chance in the random choice. The hidden lamp has all of the chance.
    length = np.array(kept[0].near.lengths[0]).reshape(36, 64)[-6:]
    first = np.array(kept[0].near.lamps[0]).reshape(36, 64, -1)[-6:, :, 0]
    bottom = chance[:blocks].reshape(36, 64, 2)[-6:]
    own = []
    for half in (slice(26), slice(-26, None)):
        lamp = np.bincount(first[:, half].ravel()).argmax()
        alone = (length[:, half] == 1) & (first[:, half] == lamp)
        assert alone.mean() > 0.9
        assert (bottom[:, half][alone] == np.eye(2)[1 - lamp]).all()
        own.append(lamp)
    assert sorted(own) == [0, 1]
    # sampled points saw the lamp on their side fully, and the other one not at all
    clear = np.array(kept[0].clear).reshape(-1, 2)[:blocks].reshape(36, 64, 2)[-6:]
    for half, lamp in ((slice(26), own[0]), (slice(-26, None), own[1])):
        assert np.median(clear[:, half, lamp]) == 1.0
        assert np.median(clear[:, half, 1 - lamp]) == np.float32(spatial_sampling.LEAST_CLEAR)


def nothing_known(view, lamps):
    """Return the light of lamps at places without any sampled point."""
    shape = spatial_sampling.places_of(view), lamps
    return spatial_sampling.PlaceLight(np.zeros(shape), np.ones(shape))


def test_light_is_the_same_and_noise_less_than_where_nothing_is_known_of_the_place(
    make, monkeypatch
):
    """Compare light and noise with and without known light, for 24 lamps along a road.

    Each lamp lights only a stretch of the road.
    """
    down = Lamp("street", "streetlights", 1000.0, make.flat(1.0), (0, 0, -1.0), 30.0, 40.0, 0.0)
    ground = make.part((make.quad(90, 60)[0][:, [2, 1, 0]], make.quad(90, 60)[1]), "grey")
    lying = make.part((make.quad(0.4, 0.2)[0][:, [2, 1, 0]], make.quad(0.4, 0.2)[1]), "grey", down)
    objects = [
        ("ground", "road", (ground,), make.pose()),
        *(
            (f"lamp{i}", "street lamp", (lying,), make.pose(6 + 3 * (i // 2), 3 * (-1) ** i, 2.5))
            for i in range(24)
        ),
    ]
    scene = make.describe(
        objects, CAMERA, materials=[make.material("grey", reflectance=make.flat(0.3))]
    )
    settings = MitsubaRenderer(width=48, height=27, margin=0.0, step_nm=100.0, samples=256)

    def followed():
        one_pass = compiled(scene, settings, ["streetlights"])
        return estimate(
            one_pass, settings, Frame(("streetlights",), np.array(settings.bands_nm()), (27, 48))
        )

    by_place = followed()
    monkeypatch.setattr(
        "isethdr_mitsuba.lamps.lamp_tables.light_at_points",
        lambda scene, hits, camera, view, *_: nothing_known(view, 24),
    )
    anywhere = followed()
    assert by_place.noise[0] < 0.6 * anywhere.noise[0]
    level = by_place.radiance.mean((0, 1))
    other = anywhere.radiance.mean((0, 1))
    lit = level > 0.01 * level.mean()
    assert level[lit].sum() == pytest.approx(
        other[lit].sum(), rel=5 * anywhere.noise[0] / np.sqrt(lit.sum())
    )
    off = (level - other)[lit] / np.hypot(
        *(np.abs(e.half_difference[0][lit]).mean() for e in (by_place, anywhere))
    )
    assert abs(np.mean(off)) < 5 * np.std(off) / np.sqrt(lit.sum())
