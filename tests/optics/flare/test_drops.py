"""Drops: images of lamps by closed forms, a textured scene by random rays, and limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, IdealLens
from isethdr_optics.flare.drops import Drop, DropsFlare
from isethdr_optics.plan.planning import complete_plan

from isethdr_core import ledger
from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError

LENS = IdealLens(focal_length_mm=4.0, f_number=4.0)  # a pupil of 1 mm
PITCH = 2e-3  # tangent of the field angle per tile


def field(values):
    """Return mixed radiance (band, y, x) on tiles of 2 mrad."""
    values = np.asarray(values, float)
    return quantities.plane(
        values,
        np.linspace(500.0, 600.0, len(values)),
        quantities.centres(values.shape[2], values.shape[2] * PITCH),
        quantities.centres(values.shape[1], values.shape[1] * PITCH),
        quantities.RADIANCE,
    )


def only(monkeypatch, *drops):
    """Return a flare with these drops only."""
    monkeypatch.setattr(DropsFlare, "drops", lambda self, width_mm, height_mm: list(drops))
    return DropsFlare()


def test_without_drops_the_light_is_the_same():
    mixed = field(np.random.default_rng(0).random((2, 8, 12)))
    none = DropsFlare(drops_per_mm2=0.0)
    assert none.redirected(LENS, mixed) is mixed
    np.testing.assert_array_equal(LENS(mixed, [none]).values, LENS(mixed).values)


def test_even_light_stays_even_and_a_lens_images_what_drops_leave():
    """Uniform light stays uniform behind drops, and a lens images the radiance behind them.

    1e-12: rounding of sums of tiles in double precision.
    """
    flare = DropsFlare(drops_per_mm2=0.2, seed=3)
    even = flare.redirected(LENS, field(np.full((1, 40, 60), 7.0)))
    np.testing.assert_allclose(even.values, 7.0, rtol=1e-12)
    mixed = field(np.random.default_rng(1).random((1, 40, 60)))
    behind = flare.redirected(LENS, mixed)
    assert np.abs(behind.values - mixed.values).max() > 0.1
    np.testing.assert_array_equal(LENS(mixed, [flare]).values, LENS(behind).values)


def test_a_complete_plan_images_what_drops_leave_and_states_their_notes():
    """Equal bits: both image the same radiance behind the drops."""
    flare = DropsFlare(drops_per_mm2=0.2, seed=3)
    mixed = field(np.random.default_rng(1).random((1, 12, 16)))
    lens = DiffractionLimitedLens(focal_length_mm=4.0, f_number=4.0)
    with ledger.stage(ledger.Ledger(), "lens"):
        made = complete_plan(lens, [flare], mixed)
        row = ledger.collected(lambda: flare.redirected(lens, mixed)).row
    behind = flare.redirected(lens, mixed)
    alone = complete_plan(lens, [], behind)
    np.testing.assert_array_equal(made.image(mixed).values, alone.image(behind).values)
    assert row.left_out
    assert made.left_out == (*row.left_out, *alone.left_out)


def test_light_from_beyond_the_tiles_is_stated(monkeypatch):
    """State the share of light that drops bring from beyond the tiles of the scene.

    The expected share comes from a wide field lit only on the tiles of a narrow one: it shows how
    much light these tiles give, and the rest comes from beyond them. 1e-9: rounding of sums of
    tiles in double precision.
    """
    flare = only(monkeypatch, Drop(1.0, -0.5, 1.2), Drop(-1.5, 1.0, 0.6))

    def shares(mixed):
        with ledger.stage(ledger.Ledger(), "lens") as row:
            flare.redirected(LENS, mixed)
        return [told.bound for told in row.left_out if told.what.startswith("light from beyond")]

    lit = np.zeros((1, 240, 260))
    narrow = np.s_[:, 100:140, 100:160]
    lit[narrow] = 1.0
    expected = 1 - flare.redirected(LENS, field(lit)).values[narrow].mean()
    assert shares(field(lit[narrow])) == pytest.approx([expected], rel=1e-9)
    # drops within 3 mm of the axis deflect by at most 0.17, from directions up to 0.05: the wide
    # field has tiles there
    assert shares(field(lit)) == []


def test_a_lamp_through_a_drop_is_a_disc_of_the_pupil_in_its_place(monkeypatch):
    """Compare light, position and size of the image of a lamp with the closed form of a thin lens.

    Light of a lamp in the direction t leaves the point p of the drop in the direction t + p / f. It
    meets the pupil where |z (t + p / f) - p| < D / 2. These points p are a disc of radius
    (D / 2) / (z / f - 1) about p = -z t / (z / f - 1). The share of light is the area of that disc
    over the area of the pupil. The image has the diameter D / (z - f), about D / z as a point of
    the glass has it.

    Tolerances: 2 % of the light, since the pupil is drawn with six cells along its diameter; a
    tenth of a tile for the centroid of the cells; less than 10 % for the blur by tiles and cells.
    """
    flare = replace(only(monkeypatch, Drop(0.0, 0.0, 2.0)), distance_mm=30.0)
    values = np.zeros((1, 61, 61))
    values[0, 30, 42] = 1.0
    lamp = 12 * PITCH
    seen = flare.redirected(LENS, field(values))
    light = seen.values[0]
    focal_mm = flare.focal_length_mm(2.0)
    ratio = 30.0 / focal_mm - 1
    assert light.sum() == pytest.approx(1 / ratio**2, rel=0.02)
    across = (light.sum(0) @ seen.x.values) / light.sum()
    assert across == pytest.approx(-lamp / ratio, abs=0.1 * PITCH)
    spread = np.sqrt((light.sum(0) @ (seen.x.values - across) ** 2) / light.sum())
    diameter = 1.0 / (30.0 - focal_mm)
    # the rms width of a uniform disc along one axis is a quarter of its diameter
    assert diameter / 4 < spread < 1.1 * diameter / 4


def test_many_rays_through_drops_bring_the_same_light(monkeypatch):
    """Compare with a Monte Carlo trace of 40 000 rays per tile.

    The standard error of the rays is 0.4 % of the spread of the light. The rims of drops are drawn
    with quarters of the pupil, which errs by 1.5 % of the light.
    """
    drops = [Drop(0.0, 0.0, 0.8), Drop(1.5, 0.4, 0.5)]
    flare = only(monkeypatch, *drops)
    y, x = np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 80), indexing="ij")
    scene = 1 + np.sin(4 * x) * np.cos(3 * y)
    mixed = field(scene[None])
    seen = flare.redirected(LENS, mixed).values[0]
    random = np.random.default_rng(2)
    radius = 0.5 * np.sqrt(random.random(40_000))
    turn = random.random(40_000) * 2 * np.pi
    for row, column in [(30, 40), (34, 46), (33, 51), (30, 47), (20, 20)]:
        at = np.array([mixed.x.values[column], mixed.y.values[row]])
        place = 60.0 * at[:, None] + radius * np.array([np.cos(turn), np.sin(turn)])
        way = np.repeat(at[:, None], place.shape[1], 1)
        for drop in drops:
            off = place - np.array([[drop.x_mm], [drop.y_mm]])
            hit = np.hypot(*off) < drop.radius_mm
            way[:, hit] -= off[:, hit] / flare.focal_length_mm(drop.radius_mm)
        columns, rows = (
            np.clip(np.floor(w / PITCH + n / 2).astype(int), 0, n - 1)
            for w, n in zip(way, (80, 60), strict=True)
        )
        assert seen[row, column] == pytest.approx(scene[rows, columns].mean(), abs=0.03)


def test_drops_are_apart_and_belong_to_the_glass_whatever_the_field():
    flare = DropsFlare(drops_per_mm2=0.1, seed=5)
    wide = flare.drops(80.0, 50.0)
    place = np.array([drop[:2] for drop in wide])
    apart = np.hypot(*(place[:, None] - place[None]).transpose(2, 0, 1))
    radii = np.array([drop.radius_mm for drop in wide])
    np.fill_diagonal(apart, np.inf)
    assert (apart > radii[:, None] + radii[None]).all()
    near = [d for d in wide if abs(d.x_mm) < 15 and abs(d.y_mm) < 10]
    assert near and set(near) <= set(flare.drops(40.0, 30.0))
    assert flare.drops(40.0, 30.0) != DropsFlare(drops_per_mm2=0.1, seed=6).drops(40.0, 30.0)


def test_radii_in_the_wrong_order_are_refused():
    with pytest.raises(ConfigError, match=r"expected the lesser number first.*largest_radius_mm=2"):
        DropsFlare(least_radius_mm=2.0, largest_radius_mm=1.0)


@pytest.mark.parametrize("f_number", [4.0, 64.0, 256.0])
def test_all_light_from_within_a_drop_passes_it(f_number):
    """Also a pupil that is much narrower than a cell of the drop sees the drop only.

    3 %: cells of finite size at the rim of the pupil.
    """
    drop = Drop(0.1, -0.05, 1.5)
    tangent = quantities.centres(64, 64 * PITCH)
    pupil_mm = 4.0 / f_number
    view = DropsFlare()._view(drop, (tangent, tangent), (PITCH, PITCH), pupil_mm, (1, 1))
    glass = 60.0 * tangent
    apart = np.hypot(
        glass[view.rows.tiles, None] - drop.y_mm, glass[None, view.columns.tiles] - drop.x_mm
    )
    covered = view.covered()
    np.testing.assert_allclose(covered[apart < 1.5 - 0.7], 1.0, atol=0.03)
    assert covered[apart > 1.5 + 0.7].max(initial=0.0) == 0.0
