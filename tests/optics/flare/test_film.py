"""The film of a wiper: share, width and direction of its streaks by closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_optics import IdealLens
from isethdr_optics.flare.film import FilmFlare

from isethdr_core import ledger
from isethdr_core.data import quantities

LENS = IdealLens(focal_length_mm=4.0, f_number=4.0)
PITCH = 1e-3


def lamp(ny=41, nx=121):
    """Return the mixed radiance of one lit tile in the middle of the field."""
    values = np.zeros((1, ny, nx))
    values[0, ny // 2, nx // 2] = 1.0
    return quantities.plane(
        values,
        [550.0],
        quantities.centres(nx, nx * PITCH),
        quantities.centres(ny, ny * PITCH),
        quantities.RADIANCE,
    )


def test_the_streak_has_its_share_within_its_half_width_and_loses_what_leaves_the_field():
    """A vertical stroke makes a streak along x with the profile of a Lorentz curve.

    Closed form: a share of 2/pi atan(a / w) lies within the distance a, where w is the half width.
    1e-6 is the error of the convolution. 1e-3: the middle tiles share light with their neighbours.
    """
    flare = FilmFlare(0.2, float(np.degrees(np.arctan(10.5e-3))), 90.0)
    light = flare.redirected(LENS, lamp()).values[0]
    assert light[20, 60] > 0.8
    inside = 0.2 * 2 / np.pi * np.arctan(60.5 / 10.5)
    assert light.sum() == pytest.approx(0.8 + inside, rel=1e-3)
    assert light[20].sum() == pytest.approx(light.sum(), rel=1e-6)
    assert light[20, 50:71].sum() == pytest.approx(0.8 + 0.2 / 2, rel=1e-3)


@pytest.mark.parametrize("stroke", [0.0, 30.0, 110.0])
def test_streaks_are_across_the_stroke(stroke):
    """Find the direction of a streak by its second moments.

    Half a degree: the tiles that hold the streak are not symmetric about its direction.
    """
    light = FilmFlare(0.5, 0.2, stroke).kernel((PITCH, PITCH), (40, 40))
    y, x = np.mgrid[-40:41, -40:41]
    light[40, 40] = 0.0
    light[np.hypot(x, y) > 38] = 0.0
    moments = [(light * a * b).sum() for a, b in ((x, x), (x, y), (y, y))]
    angle = 0.5 * np.degrees(np.arctan2(2 * moments[1], moments[0] - moments[2]))
    assert (angle - stroke - 90 + 90) % 180 - 90 == pytest.approx(0.0, abs=0.5)


def test_no_film_leaves_the_light_and_a_film_keeps_even_light_far_from_the_border():
    mixed = lamp()
    assert FilmFlare(scattered=0.0).redirected(LENS, mixed) is mixed
    even = mixed.copy(data=np.ones_like(mixed.values))
    flare = FilmFlare(0.1, 0.1, 90.0)
    left = 0.1 * (1 - 2 / np.pi * np.arctan(60.5e-3 / np.tan(np.radians(0.1))))
    assert flare.redirected(LENS, even).values[0, 20, 60] == pytest.approx(1 - left, rel=1e-6)


@pytest.mark.parametrize("width", [120, 121])
def test_the_ledger_states_what_leaves_the_field_from_its_middle(width):
    """Closed form for a lamp in the middle tile; 1e-3 as above."""
    flare = FilmFlare(0.2, float(np.degrees(np.arctan(10.5e-3))), 90.0)
    mixed = lamp(nx=width)
    with ledger.stage(ledger.Ledger(), "lens") as row:
        light = flare.redirected(LENS, mixed).values[0]
    [stated] = [note.bound for note in row.left_out]
    assert stated == pytest.approx(1 - light.sum(), rel=1e-6)
    before, after = np.arctan((np.array([width // 2, width - width // 2 - 1]) + 0.5) / 10.5)
    assert stated == pytest.approx(0.2 * (1 - (before + after) / np.pi), rel=1e-2)
