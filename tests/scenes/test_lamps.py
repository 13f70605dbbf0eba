"""Lamps: intensities inside the regulations' limits, and the dipped beam at the test points of UN
R112.
"""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.lamps import KINDS, LOW_BEAM, lamp, low_beam

LIMITS_CD = {  # least and most on the reference axis
    "position": (4, 140),
    "tail": (4, 17),
    "brake": (60, 260),
    "indicator": (175, 1200),
    "marker": (0.6, 25),
    "reverse": (80, 600),
}


def intensity_cd(lamps, left_deg, up_deg):
    """Sum of the beams in one direction, by the rule in `isethdr_core.scene.Lamp`; the Lambertian
    floors are left out.
    """
    a, b = np.radians([up_deg, left_deg])
    direction = np.array([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)])
    total = 0.0
    for one in lamps:
        cosine, inner, outer = (
            direction @ np.array(one.axis),
            *np.cos(np.radians([one.inner_deg, one.outer_deg])),
        )
        t = np.clip((cosine - outer) / (inner - outer), 0, 1)
        total += one.intensity_cd * t * t * (3 - 2 * t)
    return total


BEAM = [low_beam(m) for m in LOW_BEAM]


@pytest.mark.parametrize(
    "name, left, up, least, most",
    [
        ("B50L", 3.43, 0.57, 0, 350),  # oncoming eyes at 50 m
        ("75R", -1.15, -0.57, 10_100, 44_100),
        ("50R", -1.72, -0.86, 10_100, 44_100),
        ("50V", 0.0, -0.86, 5_100, 44_100),
        ("50L", 3.43, -0.86, 0, 13_200),
        ("75L", 3.43, -0.57, 0, 10_600),
        ("25L", 9.0, -1.72, 1_700, 44_100),
        ("25R", -9.0, -1.72, 1_700, 44_100),
        ("zone III, left", 8.0, 2.0, 0, 625),
        ("zone III, ahead", 0.0, 1.5, 0, 625),
    ],
)
def test_dipped_beam_meets_the_points_of_r112_class_b(name, left, up, least, most):
    assert least <= intensity_cd(BEAM, left, up) <= most


def test_dipped_beam_leaves_no_dark_hole_on_the_road():
    # from 6 m (6.2 degrees below the horizon for a lamp 0.65 m high) to 25 m, half a lane to either
    # side
    for distance in (6, 8, 10, 15, 25):
        up = -np.degrees(np.arctan(0.65 / distance))
        for y in (-1.75, 0.0, 1.75):
            assert intensity_cd(BEAM, np.degrees(np.arctan(y / distance)), up) > 800, (distance, y)


def test_dipped_beam_has_the_flux_of_a_headlamp():
    u = np.linspace(np.cos(np.radians(60)), 1, 1500)  # cosine to +x; the ring's measure is du dphi
    phi = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    total = 0.0
    for one in BEAM:
        k, p = np.meshgrid(u, phi, indexing="ij")
        s = np.sqrt(1 - k * k)
        cosine = np.stack([k, s * np.cos(p), s * np.sin(p)], -1) @ np.array(one.axis)
        inner, outer = np.cos(np.radians([one.inner_deg, one.outer_deg]))
        t = np.clip((cosine - outer) / (inner - outer), 0, 1)
        total += (
            one.intensity_cd
            * (t * t * (3 - 2 * t)).mean()
            * 2
            * np.pi
            * (1 - np.cos(np.radians(60)))
        )
    assert (
        400 < total < 1200
    )  # lm: an H7 low beam projects some 700 lm onto the road, LED units up to 1000


@pytest.mark.parametrize("kind", sorted(LIMITS_CD))
def test_signal_lamps_are_within_their_regulation(kind):
    least, most = LIMITS_CD[kind]
    assert least <= KINDS[kind].intensity_cd <= most


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_lamp_is_possible(kind):
    one = lamp(kind, (3.0, 0.0, -4.0))
    assert one.axis == pytest.approx((0.6, 0, -0.8), abs=1e-15)
    assert one.group in ("headlights", "streetlights", "other")
    assert 0 < one.inner_deg <= one.outer_deg <= 90
    assert 0 < one.lambertian_share < 1 and one.intensity_cd > 0
