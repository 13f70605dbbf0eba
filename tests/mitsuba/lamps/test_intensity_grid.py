"""Lamps with an intensity table have its candela for any faces: on the host, on the device and as
spots.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
from isethdr_mitsuba.lamps.spots import cone_deg, lost_beyond, spots
from isethdr_scenes.builders import RECIPES
from isethdr_scenes.lamps import lamp as lamp_of_kind

from isethdr_core.errors import ConfigError
from isethdr_core.scene import IntensityTable, Lamp

NODES = np.arange(-40.0, 40.1, 0.5)
# a smooth beam with a step at the horizon, as a dipped beam has
TABLE = IntensityTable(
    NODES,
    NODES,
    np.exp(-((NODES / 12) ** 2))
    / (1 + np.exp(NODES[:, None] / 0.6))
    * np.exp(-(NODES[:, None] ** 2) / 80),
)
PEAK = 5000.0


def directions(count=4000, seed=0):
    """Return unit vectors within 30 degrees of +x, and their angles to the left and up."""
    left, up = np.random.default_rng(seed).uniform(-30, 30, (2, count))
    a, b = np.radians([left, up])
    return np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], -1), left, up


def placed(make, mesh, pose=None, share=0.0, axis=(1.0, 0, 0)):
    lamp = Lamp("low_beam", "headlights", PEAK, make.flat(1.0), axis, 90, 90, share, TABLE)
    at = make.pose() if pose is None else pose
    (one,) = placed_lamps(make.describe([("l", "car", (make.part(mesh, "black", lamp),), at)]))
    return one


def tilted(make):
    """Return a lens of two panes with different directions, tilted back, as at a car's corner."""
    v, f = make.quad(0.05, 0.04)
    a = make.pose(turn_deg=35.0, pitch_deg=-20.0)
    b = make.pose(0, 0.2, 0, -15.0)
    corners = np.concatenate([v @ m[:3, :3].T + m[:3, 3] for m in (a, b)])
    return corners, np.concatenate([f, f + len(v)])


def candela(one, direction):
    """Return the intensity in directions, cd: luminance times the projected area of all faces."""
    tri = one.triangles
    area = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0]) / 2
    return one.peak_cd_m2 * one.relative(direction) * np.maximum(direction @ area.T, 0).sum(-1)


def test_candela_is_that_of_the_table_whatever_the_faces(make):
    direction, left, up = directions()
    for mesh in (make.quad(0.1, 0.1), tilted(make)):
        found = candela(placed(make, mesh), direction)
        # luminance is interpolated linearly on its own grid: 1 % of the peak where the step bends
        np.testing.assert_allclose(found, PEAK * TABLE.at(left, up), atol=0.012 * PEAK)
        assert found.sum() == pytest.approx(PEAK * TABLE.at(left, up).sum(), rel=5e-3)


def own_directions(lamp, count=4000, widest_deg=70.0):
    """Return directions about the axis of an upright lamp, and their angles as in its table."""
    axis = np.array(lamp.axis)
    left = np.cross([0.0, 0.0, 1.0], axis)
    left /= np.linalg.norm(left)
    aside, above = np.random.default_rng(1).uniform(-widest_deg, widest_deg, (2, count))
    a, b = np.radians([aside, above])
    parts = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], -1)
    return parts @ np.stack([axis, left, np.cross(axis, left)]), aside, above


@pytest.mark.parametrize(
    ("recipe", "widest_deg"), [(("street_lamp",), 70.0), (("luminaire",), 70.0), (None, 35.0)]
)
def test_luminaires_as_built_have_the_candela_of_their_table(make, recipe, widest_deg):
    """Compare intensities of built luminaires with their tables.

    A street lamp and a tunnel luminaire point down, tilted by 5 degrees towards the road; a traffic
    signal points horizontally. The Lambertian light of their lens is excluded.
    """
    if recipe is None:
        lamp = lamp_of_kind("signal_green", (1.0, 0.0, 0.0))
        part = make.part(make.quad(0.1, 0.1), "black", lamp)
    else:
        (part,) = (p for p in RECIPES[recipe[0]]().model().parts if p.lamp)
        lamp = part.lamp
    (one,) = placed_lamps(make.describe([("l", "street lamp", (part,), make.pose())]))
    direction, left, up = own_directions(lamp, widest_deg=widest_deg)
    facing_up = direction[:, 2] > -0.3 if recipe else direction[:, 0] < 0.3
    direction, left, up = (v[~facing_up] for v in (direction, left, up))
    tri = one.triangles
    area = np.maximum(direction @ np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0]).T / 2, 0)
    glow = one.peak_cd_m2 * one.floor / (1 + one.floor) * area.sum(-1)
    wanted = lamp.intensity_cd * lamp.table.at(left, up)
    found = candela(one, direction) - glow
    off = np.abs(found - wanted) / lamp.intensity_cd
    # luminance is interpolated linearly on its own grid, with 3 degrees at the cut-off: 2 % of the
    # largest intensity for 99 % of the directions
    assert np.quantile(off, 0.99) < 0.02 and off.max() < 0.04
    assert found.sum() == pytest.approx(wanted.sum(), rel=5e-3)


def test_a_turned_lamp_takes_its_beam_along(make):
    direction, left, up = directions(500)
    pose = make.pose(5, 3, 1, 130.0)
    turned = candela(placed(make, tilted(make), pose), direction @ pose[:3, :3].T)
    # both are the same numbers up to rounding in float64
    np.testing.assert_allclose(turned, candela(placed(make, tilted(make)), direction), atol=1e-6)


def test_the_lens_glows_with_its_share_of_the_flux(make):
    one = placed(make, make.quad(0.1, 0.1), share=0.02)
    u = (np.arange(1, 2000) - 0.5) / 2000
    up = np.degrees(np.arcsin(2 * u - 1))
    left = (np.arange(720) - 359.5) / 4
    a = np.radians(left)
    b = np.radians(up[:, None])
    # the front half
    sphere = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b) + 0 * a], -1)
    total = candela(one, sphere).mean() * 2 * np.pi
    glow = one.peak_cd_m2 * one.floor / (1 + one.floor) * np.pi * one.area_m2
    assert glow / total == pytest.approx(0.02, rel=0.01)


def test_the_device_agrees_with_the_host(make):
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))
    from isethdr_mitsuba.lamps.beam_lamp import beam_lamp
    from isethdr_mitsuba.lamps.device_grids import DeviceGrids

    lamps = [
        placed(make, tilted(make)),
        placed(make, make.quad(0.1, 0.1), make.pose(turn_deg=90.0)),
    ]
    direction, _, _ = directions()
    vector = mi.Vector3f(*direction.T.astype(np.float32))
    for number, one in enumerate(lamps):
        axis = mi.Vector3f(*map(float, one.axis))
        lamp = mi.UInt32(number)
        every = mi.Bool(True)
        found = DeviceGrids(lamps).pattern(lamp, vector, axis, mi.Float(7), every)
        # 2e-4: directions in float32 have an error of 1e-7, which is 1e-4 of a cell
        np.testing.assert_allclose(np.array(found), one.relative(direction), atol=2e-4)
        alone = beam_lamp(one).grid_pattern(vector, True)
        np.testing.assert_allclose(np.array(alone), one.relative(direction), atol=2e-4)


def test_spots_have_the_candela_of_the_table(make):
    import mitsuba as mi

    mi.set_variant("scalar_spectral")
    one = placed(make, make.quad(0.05, 0.05))
    direction, left, up = directions(1000)
    found = sum(s.candela(direction) for s in spots([one]))
    # 2 %: the nearest texel is 0.1 degrees wide, over which the step falls by 1 % of the peak
    np.testing.assert_allclose(found, PEAK * TABLE.at(left, up), atol=0.02 * PEAK)


def test_the_light_beyond_a_spot_is_stated():
    even = IntensityTable(np.array([-90.0, 90]), np.array([-90.0, 90]), np.ones((2, 2)))
    # uniform light: all of the front hemisphere except the square of tangents up to 0.84, whose
    # solid angle is 4 asin(sin^2 of 40 degrees)
    square = 4 * np.arcsin(np.sin(np.radians(40.0)) ** 2)
    assert lost_beyond(even, 40.0) == pytest.approx(1 - square / (2 * np.pi), abs=0.01)
    assert lost_beyond(TABLE, 40.0) < 0.01
    assert cone_deg(TABLE) == 40 and cone_deg(even) == 80  # narrowest without loss


def test_a_table_that_looks_straight_up_is_refused(make):
    v, f = make.quad(0.1, 0.1)
    with pytest.raises(ConfigError, match="straight up"):
        placed(make, (v[:, [2, 1, 0]], f[:, ::-1]), axis=(0.0, 0, 1.0))
