"""Distortion: inverses, closed forms, energy and uniform light through the resampling, labels and boxes on the same map."""

import numpy as np
import pytest
from isethdr_optics.distortion import BrownConrady, KannalaBrandt, RadialTable, of_prescription
from isethdr_optics.distortion_resample import overlap_areas, resample_box, resample_labels, resample_light
from isethdr_optics.prescription import load

from isethdr_core.quantities import centres

TABLE = RadialTable((0.1, 0.3, 0.5, 0.8), (0.0995, 0.289, 0.46, 0.69))
MAPS = [
    BrownConrady(-0.25, 0.05),
    BrownConrady(0.1, 0.02, -0.003, 2e-3, -1e-3),
    KannalaBrandt(0.02, -0.01, 0.001),
    KannalaBrandt(),
    TABLE,
    of_prescription(load("double_gauss"), 0.25),
]


class Same:
    def forward(self, x, y):
        return x, y

    inverse = forward


@pytest.mark.parametrize("which", range(len(MAPS)))
def test_inverse_and_forward_undo_each_other(which):
    limit = 0.17 if which == 5 else 0.5
    x, y = np.random.default_rng(1).uniform(-limit, limit, (2, 2000))
    x[0] = y[0] = 0.0
    there = MAPS[which].forward(x, y)
    back = MAPS[which].inverse(*there)
    assert np.abs(np.array(back) - [x, y]).max() < 1e-11 * limit  # a hundred times better than 1e-9 of the field
    assert there[0][0] == there[1][0] == 0


def test_closed_forms():
    x, y = BrownConrady(k1=-0.1, p1=0.01, p2=0.02).forward(0.3, 0.4)
    assert x == pytest.approx(0.3 * 0.975 + 2 * 0.01 * 0.12 + 0.02 * (0.25 + 0.18), rel=1e-14)
    assert y == pytest.approx(0.4 * 0.975 + 0.01 * (0.25 + 0.32) + 2 * 0.02 * 0.12, rel=1e-14)
    x, _ = KannalaBrandt().forward(1.0, 0.0)
    assert x == pytest.approx(np.pi / 4, rel=1e-12)  # equidistant
    assert float(KannalaBrandt(0.05).angle_rad(2.0 + 0.05 * 8)) == pytest.approx(2.0, rel=1e-13)  # beyond 90 degrees
    at = TABLE.forward(np.array(TABLE.tangent), 0.0)[0]
    np.testing.assert_allclose(at, TABLE.radius, rtol=1e-12)


def test_maps_that_fold_or_end_are_refused():
    with pytest.raises(ValueError, match="folds back"):
        BrownConrady(-0.5).inverse(0.9, 0.0)  # the largest radius is 0.544
    with pytest.raises(ValueError, match="stops to grow"):
        KannalaBrandt(-0.2).inverse(1.5, 0.0)
    with pytest.raises(ValueError, match="no tangent"):
        KannalaBrandt().inverse(1.7, 0.0)
    with pytest.raises(ValueError, match="beyond the distortion table"):
        TABLE.forward(1.0, 0.0)
    with pytest.raises(ValueError, match="rising"):
        RadialTable((0.1, 0.2), (0.1, 0.05))
    with pytest.raises(ValueError, match="finite"):
        TABLE.inverse(np.nan, 0.0)


def grids(n_in=60, n_out=48):
    return centres(n_in, 1.2), centres(n_in, 1.2), centres(n_out, 0.7), centres(n_out, 0.7)


@pytest.mark.parametrize("which", [0, 1, 2, 4])
def test_energy_is_kept(which):
    """Lamps of 1e9 inside: every watt that the map sends into the output arrives, whatever tiles it crosses."""
    x_in, y_in, x_out, y_out = grids()
    rng = np.random.default_rng(2)
    light = np.zeros((2, 60, 60))
    inner = slice(22, 38)
    light[:, inner, inner] = 10 ** rng.uniform(0, 9, (2, 16, 16))
    out = resample_light(light, x_in, y_in, MAPS[which], x_out, y_out)
    flux_in = light.sum(axis=(1, 2)) * (x_in[1] - x_in[0]) ** 2
    np.testing.assert_allclose(
        out.sum(axis=(1, 2)) * (x_out[1] - x_out[0]) ** 2, flux_in, rtol=1e-9
    )  # slivers below 1e-11 of a tile
    assert out.min() >= 0


def test_uniform_light_becomes_the_inverse_jacobian():
    """Squeezed light is brighter: irradiance goes with the area of ideal plane per area of sensor."""
    x_in, y_in, x_out, y_out = grids(120, 96)
    k = -0.2
    out = resample_light(np.ones((120, 120)), x_in, y_in, BrownConrady(k), x_out, y_out)
    u, v = BrownConrady(k).inverse(*np.meshgrid(x_out, y_out))
    r2 = u**2 + v**2
    np.testing.assert_allclose(out, 1 / ((1 + k * r2) * (1 + 3 * k * r2)), rtol=2e-4)  # straight sides, tiles of 0.007
    assert out[0, 0] > out[48, 48] > 0.999


def test_without_distortion_nothing_changes_and_halves_are_halved():
    x = centres(12, 1.2)
    light = np.random.default_rng(4).random((12, 12))
    np.testing.assert_allclose(resample_light(light, x, x, Same(), x, x), light, rtol=1e-9)
    shifted = resample_light(light, x, x, Same(), x[:-1] + 0.05, x)
    np.testing.assert_allclose(shifted, (light[:, :-1] + light[:, 1:]) / 2, rtol=1e-9)


def test_overlaps_match_counted_points():
    x_in, y_in, x_out, y_out = grids(20, 9)
    matrix = overlap_areas(x_in, y_in, MAPS[1], x_out, y_out).toarray()
    fine = centres(9 * 200, 0.7)
    u, v = MAPS[1].inverse(*np.meshgrid(fine[1000:1200], fine[600:800]))  # one output tile: column 5, row 3
    pitch = x_in[1] - x_in[0]
    column, row = (np.rint((w - x_in[0]) / pitch).astype(int) for w in (u, v))
    jac = matrix[3 * 9 + 5].sum() / u.size
    counted = np.bincount((row * 20 + column).ravel(), minlength=400) * jac
    np.testing.assert_allclose(matrix[3 * 9 + 5], counted, atol=0.01 * matrix[3 * 9 + 5].sum())  # 200 x 200 points of even weight


def test_labels_and_boxes_follow_the_light():
    x_in, y_in, x_out, y_out = grids(300, 240)
    labels = np.zeros((300, 300), np.uint16)
    box = (180, 170, 40, 30)
    labels[170:200, 180:220] = 7
    out = resample_labels(labels, x_in, y_in, MAPS[0], x_out, y_out)
    assert out.dtype == np.uint16 and set(np.unique(out)) == {0, 7}
    light = resample_light((labels > 0).astype(float), x_in, y_in, MAPS[0], x_out, y_out)
    assert np.mean((light > 0.5) == (out == 7)) > 0.998  # borders may differ by a tile
    x, y, width, height = resample_box(box, x_in, y_in, MAPS[0], x_out, y_out)
    rows, columns = np.nonzero(out == 7)
    assert x == pytest.approx(columns.min(), abs=1) and x + width == pytest.approx(columns.max() + 1, abs=1)
    assert y == pytest.approx(rows.min(), abs=1) and y + height == pytest.approx(rows.max() + 1, abs=1)


def test_output_beyond_the_input_is_refused():
    x = centres(20, 1.0)
    with pytest.raises(ValueError, match="beyond the input"):
        resample_light(np.ones((20, 20)), x, x, BrownConrady(-0.1), x, x)
    with pytest.raises(ValueError, match="beyond the labels"):
        resample_labels(np.ones((20, 20)), x, x, BrownConrady(-0.3), x, x)
