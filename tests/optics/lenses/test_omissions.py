"""Omissions of a lens: rows of the plan, and the change of the light when an omitted effect is
forced in, which is at most the stated bound.
"""

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, IdealLens, WavefrontLens
from isethdr_optics.field import lateral_colour
from isethdr_optics.field.lateral_colour import Course
from isethdr_optics.imaging import sensor_plane

from isethdr_core import compose
from isethdr_core.data import quantities
from isethdr_core.ledger import Ledger
from isethdr_core.physics.optics.distortion import BrownConrady
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.pipeline.imaging_plan import FieldAhead, LightBudget
from isethdr_core.uncertainty import ledger

SMALL = [
    "scene=macbeth",
    "~renderer",
    "scene.width=16",
    "scene.height=12",
    "sensor=ideal",
    "isp=ideal",
    "report=false",
]


def rows_of(*overrides):
    rows = Ledger()
    plan(chain(compose([*SMALL, *overrides])), rows)
    return {o.what: o for o in rows[0].left_out}


def scene(bands=(450.0, 550.0, 650.0)):
    """Return mixed radiance that spans 10 decades."""
    values = (10 ** np.random.default_rng(2).uniform(-8, 2, (len(bands), 20, 30))).astype(
        np.float32
    )
    x, y = (quantities.centres(n, 0.002 * n) for n in (30, 20))
    return quantities.plane(values, list(bands), x, y, quantities.RADIANCE)


def stated(lens, light):
    rows = Ledger()
    with ledger.stage(rows, "lens"):
        out = lens(light)
    return out, {o.what: o for o in rows[0].left_out}


def ahead(lens):
    return {o.what: o for o in lens.outline((), FieldAhead(), LightBudget()).left_out}


@pytest.mark.slow
def test_the_plan_names_what_the_lens_spares_each_with_its_bound():
    rows = rows_of("lens=diffraction_limited")
    for what in (
        "distortion of the image",
        "lateral colour",
        "variation of the point spread over the field",
    ):
        assert 0 < rows[what].bound < 1e-5 and rows[what].unit == "relative"
    bent = rows_of(
        "lens=wavefront",
        "lens.distortion={model:brown_conrady,k1:-0.1}",
        "lens.field_zernike_um={0:{},30:{8:0.1}}",
        "lens.lateral_colour_percent={300:0.1,900:0}",
    )
    assert not any("moving" in what or "off the axis" in what for what in bent)
    traced = rows_of("lens=prescription", "scene.horizontal_field_deg=20")
    assert not any("moving" in what or "off the axis" in what for what in traced)
    assert "variation of the point spread over the field" in rows_of(
        "lens=prescription", "lens.wavefront=none"
    )


def test_the_lens_at_work_says_the_same_as_the_plan():
    lens = DiffractionLimitedLens()
    planned = ahead(lens)
    _, worked = stated(lens, scene((550.0,))[:, :6, :8])
    assert planned and planned == {what: o for what, o in worked.items() if what in planned}


def test_light_moved_along_a_distortion_that_is_none_is_the_same_within_the_bound(monkeypatch):
    lens = IdealLens()
    plain, rows = stated(lens, scene())
    monkeypatch.setattr(
        sensor_plane.camera_geometry, "distortion_map", lambda *given: BrownConrady()
    )
    forced, without = stated(lens, scene())
    assert "distortion of the image" not in without and forced.attrs["distortion"] == "none"
    assert forced.shape == plain.shape
    np.testing.assert_allclose(
        forced.values, plain.values, rtol=rows["distortion of the image"].bound
    )


def test_bands_moved_along_a_lateral_colour_that_is_none_are_the_same_within_the_bound(monkeypatch):
    plain, rows = stated(IdealLens(), scene())
    light = plain.values[0].astype(float)
    bound = rows["lateral colour"].bound
    for forced in (
        lateral_colour.magnified(light, 1.0, light.shape),
        lateral_colour.displaced(
            light, Course(np.array([0.0, 9.0]), np.ones(2), (0.01, 0.01)), light.shape
        ),
    ):
        np.testing.assert_allclose(forced, light, rtol=bound)


def test_bands_that_no_sensor_sees_are_not_sent_through_the_lens_and_the_plan_says_so():
    """The plan's row states the number of bands that a run drops.

    `test_seen_bands` checks the bound by forcing these bands in.
    """
    known = [
        "scene.first_nm=400",
        "scene.last_nm=1100",
        "scene.step_nm=50",
        "lens=ideal",
        "~flare.dirt",
    ]
    rows = rows_of(*known, "sensor=bayer")
    [row] = [o for o in rows.values() if "through the lens" in o.what]
    dropped = int(row.what.split()[0])
    parts = chain(compose([*SMALL, *known, "sensor=bayer"]))
    from isethdr_core.pipeline import bands

    offered = bands.offered_nm(parts.scene)
    assert dropped == len(offered) - len(bands.sensed_nm(parts.cameras.values(), offered)) > 0
    assert row.bound == pytest.approx(1e-6)
    # every band is seen
    assert not any("through the lens" in what for what in rows_of("lens=ideal", "~flare.dirt"))


def test_a_wavefront_that_varies_states_no_such_row():
    rows = ahead(WavefrontLens(field_zernike_um={0: {}, 30: {8: 0.1}}))
    assert (
        "variation of the point spread over the field" not in rows
        and "distortion of the image" in rows
    )
