"""Field of a prescription: a camera with a wider field than the lens transmits is refused before
any computation.
"""

import re

import numpy as np
import pytest
from isethdr_optics import PrescribedLens

from isethdr_core import compose
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.pipeline.field_check import camera_field

CHART = [
    "scene=macbeth",
    "~renderer",
    "scene.width=16",
    "scene.height=9",
    "sensor=ideal",
    "isp=ideal",
    "report=false",
    "lens=prescription",
]


def corner_deg(horizontal_deg, aspect, projection="tangent"):
    width, height, _ = camera_field(horizontal_deg, aspect, projection)
    half = np.hypot(width, height) / 2
    return float(np.degrees(np.arctan(half) if projection == "tangent" else half))


@pytest.mark.parametrize(
    "projection", ["tangent", pytest.param("equidistant", marks=pytest.mark.slow)]
)
def test_a_field_whose_corners_stay_dark_is_refused_and_the_one_proposed_is_not(projection):
    """The double Gauss is designed for 14 degrees and transmits no light beyond 25 degrees."""
    lens = PrescribedLens()
    assert lens.beam(np.tan(np.radians(14.0))) > 0.9 and lens.beam(np.tan(np.radians(25.3))) == 0
    with pytest.raises(ConfigError, match="sends no light to the corners") as told:
        lens.image_size_m(*camera_field(45.0, 16 / 9, projection))
    said = float(re.search(r"scene.horizontal_field_deg=([\d.]+)", str(told.value))[1])
    assert 13.8 < corner_deg(said, 16 / 9, projection) <= 14
    width, height = lens.image_size_m(*camera_field(said, 16 / 9, projection))
    assert 0.9 < width / (4e-3 * np.radians(said)) < 1.05 and width / height == pytest.approx(
        16 / 9, rel=0.01
    )


def test_a_run_is_refused_when_it_is_put_together():
    with pytest.raises(
        ConfigError, match="25.4 degrees off the axis; expected a field within the 14 degrees"
    ):
        chain(compose([*CHART, "scene.horizontal_field_deg=45"]))


def test_a_field_whose_margin_cannot_be_traced_is_refused():
    """Refuse a field whose overscan contains angles at which rays miss a surface.

    The triplet transmits light at 28 degrees, the corner of this field. The overscan of a tenth on
    each side extends the corner to 32.6 degrees, where rays miss a surface.
    """
    lens = PrescribedLens(prescription="cooke_triplet", f_number=8.0)
    wide = camera_field(49.8, 16 / 9)
    assert (
        corner_deg(49.8, 16 / 9) == pytest.approx(28.0, abs=0.1)
        and lens.beam(np.tan(np.radians(28.0))) > 0.05
    )
    with pytest.raises(ConfigError, match="32.6 degrees off the axis miss a surface"):
        lens.image_size_m(*wide)


@pytest.mark.slow
def test_the_plan_says_what_rims_take_from_the_corners_of_too_wide_a_field():
    def corners(degrees):
        rows = Ledger()
        plan(chain(compose([*CHART, f"scene.horizontal_field_deg={degrees}"])), rows)
        return [o for o in rows[0].left_out if "corners" in o.what]

    [row] = corners(36.0)
    assert (
        row.bound
        == pytest.approx(
            1 - PrescribedLens().beam(np.tan(np.radians(corner_deg(36.0, 16 / 9)))), abs=1e-9
        )
        and 0.3 < row.bound < 0.7
    )
    assert "ends 14 degrees off the axis" in row.why and corners(24.0) == []
