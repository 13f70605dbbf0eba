"""Lamps: intensities within the limits of regulations, and the dipped beam against UN R112."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.builders import RECIPES
from isethdr_scenes.lamps import KINDS, lamp
from isethdr_scenes.photometry.families import family
from isethdr_scenes.photometry.luminaires import FLUX_LM

from isethdr_core.scene import IntensityTable

LUMINAIRES = {
    "street": "road",
    "tunnel": "tunnel",
    "street_road": "road",
    "street_post_top": "post_top",
    "street_high_mast": "high_mast",
}
SIGNALS = ("signal_red", "signal_amber", "signal_green")
COSINE = {"sign", "window", "shop_window", "panel"}  # diffusing faces


RECEIVER_DEG = 0.149  # angular diameter of the receiver: 65 mm at 25 m
LAMP_HEIGHT_M = 0.65
LAMP_ASIDE_M = 0.65


def intensity_cd(left_deg, up_deg):
    """Return the intensity of the dipped beam in a direction, cd."""
    one = lamp("low_beam", (1.0, 0.0, 0.0))
    return one.intensity_cd * one.table.at(left_deg, up_deg)


def test_the_cut_off_is_sharp_straight_and_aimed():
    """Check the limits of UN R112 on the sharpness and the position of the cut-off.

    The sharpness is the largest step of log E over 0.1 degrees, in a vertical scan by the receiver.
    """
    up = np.arange(-1.5, 0.51, 0.01)
    disc = np.array([(a, b) for a in np.linspace(-1, 1, 9) for b in np.linspace(-1, 1, 9)])
    disc = disc[np.hypot(*disc.T) <= 1] * RECEIVER_DEG / 2

    def through(left, up_deg):
        return intensity_cd(left + disc[:, :1], up_deg + disc[:, 1:]).mean(0)

    inflection = []
    for left in (1.5, 2.5, 3.5):
        step = np.log10(through(left, up - 0.05) / through(left, up + 0.05))
        assert 0.13 <= step.max() <= 0.40
        inflection.append(up[step.argmax()])
    assert inflection[1] == pytest.approx(-0.57, abs=0.05)  # as a lamp is aimed
    assert np.ptp(inflection) <= 0.2


def test_light_on_the_road_falls_steadily_from_10_to_50_m():
    """Check illuminance by both lamps on a plane that faces them.

    This plane stands for the road, since R_L of a dry road hardly depends on distance.
    """
    metres = np.arange(10.0, 50.1, 0.5)
    for across in (-1.75, 0.0, 1.75):
        lux = road_lux(metres, across)
        assert (np.diff(np.log(lux)) < 0).all() and lux[-1] > 2
        # no dark or bright patches: the ratio of neighbouring values changes by at most a factor of
        # 1.1 per step of 0.5 m
        assert np.abs(np.diff(np.log(lux), 2)).max() < np.log(1.1)
    assert road_lux(np.array([6.0]), 0.0) > road_lux(np.array([10.0]), 0.0)


def road_lux(metres, across):
    """Return the illuminance by both lamps on a plane at the road that faces them, lx."""
    lux = 0.0
    for side in (LAMP_ASIDE_M, -LAMP_ASIDE_M):
        away = np.hypot(metres, across - side)
        left = np.degrees(np.arctan2(across - side, metres))
        down = np.degrees(np.arctan(LAMP_HEIGHT_M / away))
        lux = lux + intensity_cd(left, -down) / (away**2 + LAMP_HEIGHT_M**2)
    return lux


def test_dipped_beam_has_the_flux_of_a_headlamp():
    left = np.arange(-49.75, 50, 0.5)
    up = np.arange(-49.95, 50, 0.1)[:, None]
    each = np.radians(0.5) * np.radians(0.1) * np.cos(np.radians(up))
    # in lm: an H7 low beam projects about 700 lm onto the road, LED units up to 1000 lm
    assert 400 < (intensity_cd(left, up) * each).sum() < 1200


def test_a_table_is_linear_between_its_nodes_and_ends_at_them():
    table = IntensityTable(
        np.array([-10.0, 0, 30]), np.array([-5.0, 5]), np.arange(6).reshape(2, 3)
    )
    np.testing.assert_allclose(table.at([-10, -5, 0, 15, 30], -5), [0, 0.5, 1, 1.5, 2])
    assert table.at(0, 0) == 2.5 and table.at(30, 5) == 5
    assert not table.at([-10.1, 30.1, 0, 0], [0, 0, -5.1, 5.1]).any()


@pytest.mark.parametrize("kind", sorted(set(KINDS) - COSINE - set(LUMINAIRES) - set(SIGNALS)))
def test_lamps_of_vehicles_are_tables_of_their_family(kind):
    """Vehicle lamps use the table of their family; `test_photometry` checks its rules."""
    pattern = family(KINDS[kind].family)
    one = lamp(kind, (1.0, 0.0, 0.0))
    assert one.table is pattern.table and one.intensity_cd == pattern.intensity_cd
    assert pattern.rules


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_lamp_is_possible(kind):
    one = lamp(kind, (3.0, 0.0, -4.0))
    assert one.axis == pytest.approx((0.6, 0, -0.8), abs=1e-15)
    assert one.group in ("headlights", "streetlights", "other")
    # a table over two angles, or Lambertian: no round beam
    assert (one.table is None) == (kind in COSINE)
    assert one.inner_deg == one.outer_deg == 90
    assert 0 < one.lambertian_share < 1 and one.intensity_cd > 0


@pytest.mark.parametrize("kind, name", LUMINAIRES.items())
def test_street_luminaires_have_their_flux_and_are_cut_off(kind, name):
    one = lamp(kind, (0.1, 0.0, -1.0))
    angle = np.arange(-87.9, 88, 0.2)
    candela = one.intensity_cd * one.table.at(angle, angle[:, None])
    each = np.radians(0.2) ** 2 * np.cos(np.radians(angle))[:, None]
    # 1 %: the table is linear between nodes 2 degrees apart, here summed in steps of 0.2
    assert (candela * each).sum() == pytest.approx(FLUX_LM[name], rel=0.01)
    # full cut-off: at 85 degrees off the axis less than 25 cd per 1000 lm (IES: 2.5 % at 90)
    assert one.intensity_cd * one.table.at(85.0, 0.0) < 0.025 * FLUX_LM[name]


def test_a_signal_is_brightest_on_its_axis_and_sends_its_light_down():
    one = lamp("signal_red", (1.0, 0.0, 0.0))
    at = lambda left, up: one.intensity_cd * float(one.table.at(left, up))
    assert at(0, 0) == pytest.approx(200, rel=1e-9) == one.intensity_cd * one.table.value.max()
    # half of it at the half widths given in `luminaires`; 1 %: the constant light at large angles
    # adds to it
    assert [at(10, 0), at(-10, 0), at(0, -7), at(0, 3)] == pytest.approx([100] * 4, rel=0.01)
    left = np.arange(-59.75, 60, 0.5)
    up = np.arange(-39.875, 20, 0.25)[:, None]
    each = np.radians(0.5) * np.radians(0.25) * np.cos(np.radians(up))
    flux_lm = (one.intensity_cd * one.table.at(left, up) * each).sum()
    # closed form: half normal distributions on each side over small angles, plus the constant rest
    wide = np.pi / np.log(2) * 10 * (7 + 3) / 2 * np.radians(1) ** 2
    rest = np.radians(120) * (np.sin(np.radians(20)) + np.sin(np.radians(40)))
    # 2 %: the closed form takes angles as plane, while cosines of 10 degrees occur
    assert flux_lm == pytest.approx(200 * (0.996 * wide + 0.004 * rest), rel=0.02)


@pytest.mark.parametrize("recipe", [("street_lamp",), ("luminaire",)])
def test_built_luminaires_are_turned_towards_the_road(recipe):
    """A street lamp is tilted towards its road, +y; a tunnel luminaire of the left row towards
    -y."""
    towards = 1.0 if recipe == ("street_lamp",) else -1.0
    (part,) = (p for p in RECIPES[recipe[0]]().model().parts if p.lamp)
    assert part.lamp.axis == pytest.approx((0, towards * np.sin(np.radians(5)), -0.9962), abs=1e-4)


def test_a_tunnel_is_lit_evenly_along_its_road():
    """Check the uniformity of illuminance along the middle of the right lane of a tunnel.

    Two rows of luminaires are 4.75 m high and have a spacing of 12 m.
    """
    tilt = np.radians(5.0)
    axis = np.array([0.0, -np.sin(tilt), -np.cos(tilt)])
    one = lamp("tunnel", axis)
    along = np.arange(-6.0, 6.1, 0.5)
    lux = 0.0
    # the middle of the lane is 3.95 m from the left row and, seen from the luminaires of the right
    # row, which face the other way, 0.45 m outside
    for aside in (-3.95, -0.45):
        for post in np.arange(-60.0, 60.1, 12.0):
            way = np.stack([along - post, 0 * along + aside, 0 * along - 4.75], 1)
            distance = np.linalg.norm(way, axis=1)
            up = np.degrees(np.arcsin(way @ [0.0, -np.cos(tilt), np.sin(tilt)] / distance))
            left = np.degrees(np.arctan2(way[:, 0], way @ axis))
            lux = lux + one.intensity_cd * one.table.at(left, up) * 4.75 / distance**3
    # 0.6 of the mean along the road, as CIE 88 requires (assumed)
    assert lux.min() > 0.6 * lux.mean() and 20 < lux.mean() < 200


def test_a_road_luminaire_lights_its_road_evenly():
    """Check the uniformity of illuminance between two posts 8 m high and 30 m apart, 2 m aside."""
    one = lamp("street_road", (0.1, 0.0, -1.0))
    along = np.arange(0.0, 30.1, 1.0)
    lux = 0.0
    for post in (-30.0, 0.0, 30.0, 60.0):
        x = along - post
        height = 8.0
        aside = 2.0
        distance2 = x**2 + height**2 + aside**2
        left = np.degrees(np.arctan2(x, height))
        up = np.degrees(np.arcsin(aside / np.sqrt(distance2)))
        lux = lux + one.intensity_cd * one.table.at(left, up) * height / distance2**1.5
    # EN 13201-2 requires a minimum uniformity; 0.25 of the mean is its U_0 for classes P to C
    # (assumed)
    assert lux.min() > 0.25 * lux.mean() and 5 < lux.mean() < 40
