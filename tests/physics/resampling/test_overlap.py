"""Overlap: energy and uniform light through a distortion, tiles halved, areas by counted points."""

import numpy as np
import pytest

from isethdr_core.physics.optics.distortion import AngleTable, BrownConrady, KannalaBrandt
from isethdr_core.physics.resampling.overlap import borders, overlap_areas
from isethdr_core.quantities import centres

MAPS = [
    BrownConrady(-0.25, 0.05),
    BrownConrady(0.1, 0.02, -0.003, 2e-3, -1e-3),
    KannalaBrandt(0.02, -0.01, 0.001),
    AngleTable((5.0, 17.0, 27.0, 50.0), (0.0872, 0.296, 0.467, 0.845)),
]


class Same:
    def forward(self, x, y):
        return x, y

    inverse = forward


def grids(n_in=60, n_out=48):
    return tuple(
        borders(centres(n, w), w / n)
        for n, w in ((n_in, 1.2), (n_in, 1.2), (n_out, 0.7), (n_out, 0.7))
    )


def moved(light, lens, x_in, y_in, x_out, y_out):
    """Return irradiance on the output tiles."""
    areas = overlap_areas(x_in, y_in, lens, x_out, y_out)
    return (areas @ light.ravel()).reshape(len(y_out) - 1, len(x_out) - 1) / (
        (x_out[1] - x_out[0]) * (y_out[1] - y_out[0])
    )


@pytest.mark.parametrize("lens", MAPS, ids=lambda m: type(m).__name__)
def test_energy_is_kept(lens):
    """Energy conservation with lamps of 1e9: all light that the map sends into the output arrives,
    whichever tiles it crosses.
    """
    x_in, y_in, x_out, y_out = grids()
    light = np.zeros((60, 60))
    light[22:38, 22:38] = 10 ** np.random.default_rng(2).uniform(0, 9, (16, 16))
    out = moved(light, lens, x_in, y_in, x_out, y_out)
    # 1e-9: slivers below 1e-11 of a tile are dropped
    assert out.sum() * (x_out[1] - x_out[0]) ** 2 == pytest.approx(
        light.sum() * (x_in[1] - x_in[0]) ** 2, rel=1e-9
    )
    assert out.min() >= 0


def test_a_region_keeps_its_energy_where_the_map_sends_it():
    """Energy conservation on one side of a line: the output tiles left of the line's image hold
    the light of the input tiles left of the line.
    """
    lens = KannalaBrandt()
    x_in = borders(centres(300, 1.2), 1.2 / 300)
    y_in = borders(centres(60, 0.24), 0.24 / 60)
    light = np.zeros((60, 300))
    light[25:35, 60:240] = np.random.default_rng(3).random((10, 180))
    edge = float(lens.forward(x_in[180], 0.0)[0])
    # one border on the image of the line (straight enough over 10 rows)
    x_out = edge + edge / 50 * np.arange(-200, 80)
    y_out = borders(centres(40, 0.2), 0.005)
    areas = overlap_areas(x_in, y_in, lens, x_out, y_out)
    out = (areas @ light.ravel()).reshape(40, -1)
    want = light[:, :180].sum() * (x_in[1] - x_in[0]) * (y_in[1] - y_in[0])
    # 1e-4: the image of the line bows by a few 1e-4 of a tile's width over these rows
    assert out[:, :200].sum() == pytest.approx(want, rel=1e-4)


def test_uniform_light_becomes_the_inverse_area_ratio():
    """Compare with a closed form: irradiance changes by the area of the ideal plane over that of
    the sensor, so compressed light is brighter.
    """
    x_in, y_in, x_out, y_out = grids(120, 96)
    lens = BrownConrady(-0.2)
    out = moved(np.ones((120, 120)), lens, x_in, y_in, x_out, y_out)
    middle = (x_out[1:] + x_out[:-1]) / 2
    u, v = lens.inverse(*np.meshgrid(middle, middle))
    r2 = u**2 + v**2
    # 2e-4: tiles of 0.007 with straight sides
    np.testing.assert_allclose(out, 1 / ((1 - 0.2 * r2) * (1 - 0.6 * r2)), rtol=2e-4)
    assert out[0, 0] > out[48, 48] > 0.999


def test_without_distortion_nothing_changes_and_halves_are_halved():
    x = np.linspace(-0.6, 0.6, 13)
    light = np.random.default_rng(4).random((12, 12))
    np.testing.assert_allclose(moved(light, Same(), x, x, x, x), light, rtol=1e-9)
    np.testing.assert_allclose(
        moved(light, Same(), x, x, x[:-1] + 0.05, x), (light[:, :-1] + light[:, 1:]) / 2, rtol=1e-9
    )


def test_overlaps_match_counted_points():
    x_in, y_in, x_out, y_out = grids(20, 9)
    matrix = overlap_areas(x_in, y_in, MAPS[1], x_out, y_out).toarray()
    fine = centres(9 * 200, 0.7)
    # one output tile: column 5, row 3
    u, v = MAPS[1].inverse(*np.meshgrid(fine[1000:1200], fine[600:800]))
    pitch = x_in[1] - x_in[0]
    column, row = (np.floor((w - x_in[0]) / pitch).astype(int) for w in (u, v))
    one = matrix[3 * 9 + 5]
    counted = np.bincount((row * 20 + column).ravel(), minlength=400) * (one.sum() / u.size)
    # 1 %: 200 x 200 points of equal weight
    np.testing.assert_allclose(one, counted, atol=0.01 * one.sum())


def test_strips_of_rows_join():
    x_in, y_in, x_out, y_out = grids(90, 70)
    whole = overlap_areas(x_in, y_in, MAPS[0], x_out, y_out)
    part = overlap_areas(x_in, y_in, MAPS[0], x_out, y_out[40:51])
    np.testing.assert_allclose(part.toarray(), whole[40 * 70 : 50 * 70].toarray(), atol=1e-15)


def test_output_beyond_the_input_is_refused():
    x = np.linspace(-0.5, 0.5, 21)
    with pytest.raises(ValueError, match="beyond the input"):
        overlap_areas(x, x, BrownConrady(-0.1), x, x)
