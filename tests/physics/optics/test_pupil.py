"""Pupil rasters: areas known in closed form, agreement with points, seeds."""

import numpy as np
import pytest
from scipy.special import j1

from isethdr_core.physics.optics.pupil import (
    Dust,
    Scratches,
    blades,
    chord_ends,
    dirt,
    disc,
    energy,
    gauss_chords,
    opening,
    overlaps,
    raster,
    strip,
    strip_blocks,
    transmission,
)


def axis(n, half=0.6):
    return (np.arange(n) + 0.5) / n * 2 * half - half


def area(shape, losses=(), n=400, **kw):
    x = axis(n)
    return raster(opening(shape, losses), x, x, **kw).sum(dtype=float) * (x[1] - x[0]) ** 2


def test_areas():
    # tolerances: chords are exact along x, and there are 1600 of them along y
    assert area(disc(0, 0, 0.5)) == pytest.approx(np.pi / 4, rel=1e-5)
    for n in (3, 4, 5, 6, 8):
        assert area(blades(0.5, n, 11.0)) == pytest.approx(
            n / 2 * 0.25 * np.sin(2 * np.pi / n), rel=1e-4
        )
    assert area(strip(0.1, -0.05, 0.3, 0.02, 0.7)) == pytest.approx(0.006, rel=1e-3)
    assert area(blades(0.5, 6, 0.0, rounding=1.0)) == pytest.approx(np.pi / 4, rel=1e-4)
    assert area(blades(0.5, 6)) < area(blades(0.5, 6, rounding=0.5)) < np.pi / 4
    assert area(disc(0, 0, 0.5), [(disc(0.1, 0.1, 0.1), 0.25)]) == pytest.approx(
        np.pi / 4 - 0.25 * np.pi * 0.01, rel=1e-5
    )


@pytest.mark.slow
def test_cells_average_the_points():
    shape = blades(0.5, 5, 8.0, 0.3)
    losses = dirt(0.5, Dust(30, 20), Scratches(8, 10, 300), seed=3)
    n = 60
    sub = 24
    x = axis(n * sub)
    points = (
        transmission(shape, losses, x[None, :], x[:, None]).reshape(n, sub, n, sub).mean((1, 3))
    )
    cells = raster(opening(shape, losses), axis(n), axis(n), strips=sub // 2)
    # points resolve 1/24 of a cell along x
    assert np.abs(cells - points).mean() < 2e-3
    assert np.quantile(np.abs(cells - points), 0.99) < 0.03


@pytest.mark.slow
def test_overlaps_are_those_of_all_pairs():
    """Compare with all pairs: the search skips pairs with separate bounds and misses no overlap."""
    shape = blades(0.5, 6, 17.0)
    losses = dirt(0.5, Dust(120, 20), Scratches(30, 10, 400), seed=4)
    found = {held for _, held in overlaps(shape, [s for s, _ in losses])}
    pairs = {
        (a, b)
        for a in range(len(losses))
        for b in range(a + 1, len(losses))
        if not (shape & losses[a][0] & losses[b][0]).is_empty()
    }
    assert len(pairs) > 50 and {held for held in found if len(held) == 2} == pairs
    y = np.linspace(-0.5, 0.5, 400)
    for part, held in overlaps(shape, [s for s, _ in losses]):
        whole = shape
        for index in held:
            whole = whole & losses[index][0]
        inside = (y >= part.low) & (y <= part.high)
        for own, all_borders in zip(part.chords(y[inside]), whole.chords(y[inside])):
            hit = np.less(*whole.chords(y[inside]))
            np.testing.assert_array_equal(own[hit], all_borders[hit])
    for one, _ in losses:
        left, right = one.sides()
        own_left, own_right = one.chords(np.linspace(one.low, one.high, 5001))
        hit = own_left < own_right
        assert left <= own_left[hit].min() and own_right[hit].max() <= right


def test_dirt_outside_the_opening_does_nothing():
    a, b = (
        raster(opening(disc(0, 0, 0.5), losses), axis(50), axis(50))
        for losses in ((), [(disc(0.58, 0.0, 0.05), 1.0)])
    )
    np.testing.assert_allclose(a, b, atol=1e-6)  # float32 sums


def test_y_points_down_and_x_right():
    cells = raster([(disc(0.3, -0.2, 0.1), 1.0)], axis(60), axis(60))
    row, col = (float((cells * i).sum() / cells.sum()) for i in np.indices(cells.shape))
    assert axis(60)[round(row)] == pytest.approx(-0.2, abs=0.02) and axis(60)[
        round(col)
    ] == pytest.approx(0.3, abs=0.02)


def test_seeded():
    kinds = Dust(40, 9), Scratches(5, 3, 400)
    assert dirt(0.5, *kinds, seed=1) == dirt(0.5, *kinds, seed=1)
    assert dirt(0.5, *kinds, seed=1) != dirt(0.5, *kinds, seed=2)
    with pytest.raises(ValueError, match="rounding"):
        blades(0.5, 6, rounding=1.5)


def test_overlapping_dirt_multiplies():
    losses = [(disc(0, 0, 0.2), 0.5), (disc(0.05, 0, 0.2), 0.4), (strip(0, 0, 0.5, 0.05, 0.3), 0.9)]
    cells = raster(opening(disc(0, 0, 0.5), losses), axis(61), axis(61))
    assert cells[30, 30] == pytest.approx(0.5 * 0.6 * 0.1, abs=1e-6)  # float32 sums
    assert cells[24, 30] == pytest.approx(0.5 * 0.6, abs=1e-6)


@pytest.mark.slow
def test_energy_from_areas():
    assert energy(disc(0, 0, 0.5), []) == pytest.approx(np.pi / 4, rel=1e-12)  # exact quadrature
    assert energy(blades(0.5, 6, 0.0), []) == pytest.approx(
        6 / 2 * 0.25 * np.sin(np.pi / 3), rel=1e-6
    )
    losses = dirt(0.5, Dust(60, 20), Scratches(8, 10, 300), seed=3)
    x = axis(1500, 0.5)
    want = np.mean(transmission(disc(0, 0, 0.5), losses, x[None, :], x[:, None]) ** 2)
    assert energy(disc(0, 0, 0.5), losses) == pytest.approx(want, rel=3e-4)  # 2 million points


@pytest.mark.parametrize(
    "matrix", [((0.93, 0.05), (0.04, 0.97)), ((-0.9, 0.0), (0.0, 1.1)), ((0.0, 1.0), (-1.0, 0.0))]
)
def test_the_image_of_a_shape_under_a_linear_map_holds_the_images_of_its_points(matrix):
    x = axis(60, 0.7)
    fine = axis(600, 0.7)
    across, down = np.meshgrid(fine, fine)
    back = np.einsum("ij,jyx->iyx", np.linalg.inv(matrix), np.stack([across, down]))
    grown = abs(np.linalg.det(matrix))
    for shape in (
        disc(0.05, -0.1, 0.4),
        blades(0.5, 6, 8.0, 0.3),
        blades(0.5, 5, 3.0) & disc(0.2, 0.1, 0.45),
        strip(0.1, 0.0, 0.5, 0.1, 0.4),
    ):
        image = shape.mapped(matrix)
        # 1e-4: the height of a mapped shape with slanted corners is only a bound
        assert energy(image, []) == pytest.approx(grown * energy(shape, []), rel=1e-4)
        points = shape.contains(*back)
        np.testing.assert_array_equal(image.contains(across, down), points)
        cells = points.reshape(60, 10, 60, 10).mean((1, 3))
        # 0.15: 10 x 10 points per cell, and corners as above
        np.testing.assert_allclose(raster([(image, 1.0)], x, x), cells, atol=0.15)
        inverse = tuple(map(tuple, np.linalg.inv(matrix)))
        np.testing.assert_allclose(
            image.mapped(inverse).contains(across, down), shape.contains(across, down), atol=0
        )


def test_blocks_of_strips_hold_all_chords_once():
    terms = opening(blades(0.5, 6), dirt(0.5, Dust(60, 20), Scratches(20, 10, 300), seed=3))
    strips = -0.6, 0.0005, 2400
    blocks = strip_blocks(terms, *strips, most=4000)
    parts = [list(chord_ends(terms, *strips, block=block)) for block in blocks]
    counts = [sum(len(chords[0]) for chords in part) for part in parts]
    assert len(blocks) > 5
    assert max(counts) < 2 * 4000  # dirt is not uniformly distributed
    in_blocks, together = (
        np.array([np.concatenate([c[k] for c in chords]) for k in range(4)])
        for chords in (sum(parts, []), list(chord_ends(terms, *strips)))
    )
    ordered = (a[:, np.lexsort(a)] for a in (in_blocks, together))
    np.testing.assert_array_equal(*ordered)


def test_gauss_chords_fill_round_and_straight_shapes():
    strips = -1.0, 0.1, 20
    every = slice(0, 20)

    def of_chords(shape):
        left, right, weight, level = gauss_chords((shape, 2.0), *strips, every, np.inf)
        area = weight * (right - left) * strips[1]
        return area.sum(), (area * (strips[0] + strips[1] * level)).sum() / area.sum()

    # 4e-4 for a disc over six rows; Gauss points in each row alone would err by 1.2e-3
    area, centre = of_chords(disc(0.0, 0.023, 0.3))
    assert area == pytest.approx(2 * np.pi * 0.09, rel=4e-4)
    assert centre == pytest.approx(0.023, abs=1e-4)
    # a disc within one row
    assert of_chords(disc(0.0, 0.05, 0.04)) == pytest.approx((2 * np.pi * 0.0016, 0.05), rel=1e-9)
    # straight sides that end within rows
    assert of_chords(strip(0.0, 0.033, 0.4, 0.2, 0.0)) == pytest.approx((0.16, 0.033), rel=1e-9)


@pytest.mark.parametrize(
    ("shape", "transform"),
    [
        (disc(0.0, 0.0, 0.6), lambda q: 2 * np.pi * 0.6 * j1(0.6 * q) / q),
        (
            strip(0.0, 0.0, 0.8, 0.5, 0.4),
            lambda q: (
                0.4
                * np.sinc(0.4 * q * np.cos(0.4) / np.pi)
                * np.sinc(0.25 * q * np.sin(0.4) / np.pi)
            ),
        ),
    ],
    ids=["round", "slanted"],
)
def test_chords_transform_along_x_as_their_shape_does(shape, transform):
    """Compare the transform of chords along x with the closed form of their shape.

    The highest frequency of an image changes its phase by a quarter turn per cell.
    """
    step = 0.02
    left, right, weight, _ = gauss_chords((shape, 1.0), -1.0, step, 100, slice(0, 100), step)
    q = np.linspace(0.5, 1.0, 20) * np.pi / 2 / step
    turned = np.exp(-1j * q[:, None] * right) - np.exp(-1j * q[:, None] * left)
    found = step * (turned @ weight) / (-1j * q)
    # error of two Gauss points per quarter turn; rows that are not divided err by 1e-3
    np.testing.assert_allclose(found, transform(q), atol=2e-6)
