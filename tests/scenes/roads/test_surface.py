"""Meshes of roads and land: no holes, overlaps or open steps; markings just above the road."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.roads import kinds
from isethdr_scenes.roads.surface import PAINT_M, surface

PAINTED = ("line", "crosswalk", "stop_line", "parking_line", "arrow")


def pieces(found):
    return [p for a in (found.roads, found.land) for p in a.parts if p.name not in PAINTED]


def closed(name, seed):
    """Return the sides of triangles that only one triangle has, and the area in plan, m2."""
    found = surface(kinds.kind(name, seed).network)
    corners = np.concatenate([p.vertices[p.faces] for p in pieces(found)])
    keys = np.round(corners * [1000, 1000, 2000]).astype(np.int64)
    upright = np.ptp(corners[:, :, 0], 1) + np.ptp(corners[:, :, 1], 1)
    assert upright.min() > 0
    sides = np.concatenate([keys[:, [0, 1]], keys[:, [1, 2]], keys[:, [2, 0]]])[:, :, :2]
    sides = sides[(sides[:, 0] != sides[:, 1]).any(1)]  # upright sides of kerbs
    flat = np.sort(sides.view([("x", np.int64), ("y", np.int64)])[..., 0], 1)
    _, inverse, count = np.unique(flat, axis=0, return_inverse=True, return_counts=True)
    single = sides[count[inverse.ravel()] == 1]
    a, b, c = (corners[:, k, :2] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return single / 1000.0, twice.sum() / 2


@pytest.mark.parametrize(
    "name", ["country_curve", pytest.param("city_crossing", marks=pytest.mark.slow)]
)
def test_ground_has_no_hole(name):
    single, area = closed(name, 1)
    # Only the rim of the land is open, and a rim that goes round once encloses the area in plan. A
    # hole, an overlap or a missing triangle would change the rim or the area.
    a = single[:, 0]
    b = single[:, 1]
    rim = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2
    centre = single.reshape(-1, 2).mean(0)
    assert np.linalg.norm(single - centre, axis=-1).min() > 200
    assert area == pytest.approx(rim, rel=1e-9)


@pytest.mark.slow
def test_markings_lie_just_above_the_road():
    base = kinds.kind("city_4_lanes", 1)
    found = surface(base.network)
    for piece in (p for p in found.roads.parts if p.name in PAINTED):
        above = piece.vertices[:, 2] - base.network.height(*piece.vertices[:, :2].T)
        assert np.abs(above - PAINT_M).max() < 1e-6
        assert (piece.normals[:, 2] > 0.9).all()
