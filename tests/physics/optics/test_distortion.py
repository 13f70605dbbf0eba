"""Distortion: inverses, closed forms, area ratios against finite differences, refusal of maps that
fold or end.
"""

import numpy as np
import pytest

from isethdr_core.physics.optics.distortion import (
    AngleTable,
    BrownConrady,
    KannalaBrandt,
    on_projection,
)

TABLE = AngleTable((5.0, 17.0, 27.0, 39.0, 60.0), (0.0872, 0.296, 0.467, 0.668, 1.0))
MAPS = [
    BrownConrady(-0.25, 0.05),
    BrownConrady(0.1, 0.02, -0.003, 2e-3, -1e-3),
    KannalaBrandt(0.02, -0.01, 0.001),
    KannalaBrandt(),
    TABLE,
]


@pytest.mark.parametrize("projection", ["tangent", "equidistant"])
@pytest.mark.parametrize("which", range(len(MAPS)))
def test_inverse_and_forward_undo_each_other(which, projection):
    lens = on_projection(MAPS[which], projection)
    limit = 0.5
    x, y = np.random.default_rng(1).uniform(-limit, limit, (2, 2000))
    x[0] = y[0] = 0.0
    there = lens.forward(x, y)
    back = lens.inverse(*there)
    # 1e-11 of the field: a hundred times better than the promised 1e-9
    assert np.abs(np.array(back) - [x, y]).max() < 1e-11 * limit
    assert there[0][0] == there[1][0] == 0


@pytest.mark.parametrize("projection", ["tangent", "equidistant"])
@pytest.mark.parametrize("which", range(len(MAPS)))
def test_area_ratio_is_the_determinant_of_the_differences(which, projection):
    lens = on_projection(MAPS[which], projection)
    h = 1e-5
    x, y = np.random.default_rng(2).uniform(-0.5, 0.5, (2, 50))
    across, down = (
        np.subtract(lens.forward(x + a, y + b), lens.forward(x - a, y - b)) / (2 * h)
        for a, b in ((h, 0), (0, h))
    )
    # central differences err by 1e-9: by h^2 and by rounding / h
    np.testing.assert_allclose(
        lens.area_ratio(x, y), across[0] * down[1] - across[1] * down[0], rtol=1e-8
    )
    assert float(lens.area_ratio(0.0, 0.0)) == pytest.approx(
        float(lens.forward(1e-6, 0.0)[0] / 1e-6) ** 2, rel=1e-6
    )


def test_the_projection_of_the_field_does_not_matter():
    angle = np.radians([3.0, 20.0, 45.0])
    for lens in MAPS:
        by_tangent = lens.forward(np.tan(angle), 0.0)[0]
        by_angle = on_projection(lens, "equidistant").forward(angle, 0.0)[0]
        np.testing.assert_allclose(by_tangent, by_angle, rtol=1e-12)


def test_closed_forms():
    x, y = BrownConrady(k1=-0.1, p1=0.01, p2=0.02).forward(0.3, 0.4)
    assert x == pytest.approx(0.3 * 0.975 + 2 * 0.01 * 0.12 + 0.02 * (0.25 + 0.18), rel=1e-14)
    assert y == pytest.approx(0.4 * 0.975 + 0.01 * (0.25 + 0.32) + 2 * 0.02 * 0.12, rel=1e-14)
    x, _ = KannalaBrandt().forward(1.0, 0.0)
    assert x == pytest.approx(np.pi / 4, rel=1e-12)  # equidistant
    # an angle of 2 rad, beyond 90 degrees
    assert float(KannalaBrandt(0.05).angle_rad(2.0 + 0.05 * 8)) == pytest.approx(2.0, rel=1e-13)
    at = TABLE.forward(np.tan(np.radians(TABLE.angle_deg)), 0.0)[0]
    np.testing.assert_allclose(at, TABLE.radius_per_focal_length, rtol=1e-12)


def test_a_table_of_a_known_lens_is_that_lens_between_its_points():
    angle = np.radians(np.linspace(1.5, 45, 30))
    table = AngleTable(tuple(np.degrees(angle)), tuple(2 * np.sin(angle / 2)))  # equisolid
    between = np.radians(np.linspace(0.1, 45, 1001))
    # a cubic spline of a smooth ratio over 30 points errs by 1e-8; the worst interval is the first
    # one, extrapolated to the axis
    np.testing.assert_allclose(table.radius(between), 2 * np.sin(between / 2), rtol=1e-7)


def test_maps_that_fold_or_end_are_refused():
    with pytest.raises(ValueError, match="folds back"):
        BrownConrady(-0.5).inverse(0.9, 0.0)  # the largest radius is 0.544
    assert BrownConrady(-0.5).area_ratio(0.9, 0.0) <= 0 < BrownConrady(-0.5).area_ratio(0.7, 0.0)
    with pytest.raises(ValueError, match="stops growing"):
        KannalaBrandt(-0.2).inverse(1.5, 0.0)
    with pytest.raises(ValueError, match="no tangent"):
        KannalaBrandt().inverse(1.7, 0.0)
    with pytest.raises(ValueError, match="no tangent"):
        on_projection(BrownConrady(-0.01), "equidistant").forward(1.6, 0.0)
    with pytest.raises(ValueError, match="beyond the distortion table"):
        TABLE.forward(2.0, 0.0)
    with pytest.raises(ValueError, match="rising"):
        AngleTable((5.0, 10.0), (0.1, 0.05))
    with pytest.raises(ValueError, match="finite"):
        TABLE.inverse(np.nan, 0.0)


@pytest.mark.parametrize("k1", [-0.4, -0.15, -0.04])
def test_a_fisheye_is_inverted_up_to_where_it_stops_to_grow(k1):
    fisheye = KannalaBrandt(k1)
    edge = 1 / np.sqrt(-3 * k1)  # the slope 1 + 3 k1 angle^2 is 0 there
    largest = fisheye.radius(np.minimum(edge, np.pi))
    radius = largest * (1 - np.logspace(-6, 0, 50))
    angle = fisheye.angle_rad(radius)
    assert np.all(angle <= edge)
    np.testing.assert_allclose(fisheye.radius(angle), radius, atol=1e-12)  # promised by the module
