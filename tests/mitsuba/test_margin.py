"""Rendering without overscan: tiles of the camera's field have the same bits, labels included."""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from dataclasses import replace

from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_mitsuba.world.view import view_of

from isethdr_core.demand import Demand
from isethdr_core.quantities import LABELS
from isethdr_core.scene import Camera

SIZE = {"width": 20, "height": 12, "step_nm": 100.0, "samples": 4}
LABELLED = Demand(labels=frozenset(LABELS))


def test_a_tile_of_the_field_does_not_depend_on_the_margin(make):
    whole, part = (
        MitsubaRenderer(margin=0.2, **SIZE)(make.street(3), replace(LABELLED, margin=margin))
        for margin in (True, False)
    )
    assert whole["radiance"].shape[2:] == (16, 28) and part["radiance"].shape[2:] == (12, 20)
    for name in ("radiance", "depth", "instance", "normal"):
        kept = whole[name].isel(y=slice(2, -2), x=slice(4, -4))
        np.testing.assert_array_equal(kept.values, part[name].values, err_msg=name)
        np.testing.assert_array_equal(kept.x.values, part.x.values)
    assert float(whole["radiance"].isel(x=0).max()) > 0, "the margin holds light"
    assert whole.attrs["objects"] and len(whole.attrs["objects"]) == len(part.attrs["objects"])
    for a, b in zip(whole.attrs["objects"], part.attrs["objects"], strict=True):
        assert [a["box"][0] - 4, a["box"][1] - 2, *a["box"][2:]] == b["box"] and a[
            "visible_fraction"
        ] == b["visible_fraction"]


@pytest.mark.parametrize(
    ("width", "height", "margin"), [(64, 36, 0.1), (33, 7, 0.25), (5, 3, 0.0), (1, 1, 2.0)]
)
def test_what_is_left_are_the_tiles_of_the_field(width, height, margin):
    whole = view_of(Camera((0, 0, 0), (1, 0, 0), 40.0, width / height), width, height, margin)
    part = whole.within_field()
    assert (
        part.shape == (height, width)
        and part.whole == whole.shape
        and whole.within_field().within_field().shape == part.shape
    )
    assert abs(part.x).max() < part.field[0] / 2 and abs(part.y).max() < part.field[1] / 2
