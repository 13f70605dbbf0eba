"""The renderer's margin is left out if none of its light can reach the camera's field, and only
then.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from isethdr_optics import IdealLens

from isethdr_core import build
from isethdr_core.demand import Demand
from isethdr_core.pipeline.chain import Chain, union
from isethdr_core.pipeline.imaging_plan import FieldAhead, LightBudget, outlined
from isethdr_core.pipeline.overscan import left_out_where_unseen
from isethdr_core.runs.radiance_cache import stored_radiance
from isethdr_core.storage import store
from isethdr_core.uncertainty import ledger

RENDERER = SimpleNamespace(margin=0.1)
WEIGHTS = build("lighting", "weights")
TARGETS = build("lighting", "targets")


def wanted(lens, flares=(), lightings=(WEIGHTS,), renderer=RENDERER):
    outline = outlined(lens, flares, FieldAhead(), LightBudget())
    return left_out_where_unseen(Demand(), renderer, outline, lightings).margin


def test_only_a_lens_that_spreads_nothing_needs_no_margin():
    rows = ledger.Ledger()
    with ledger.stage(rows, "plan"):
        assert wanted(build("lens", "ideal"), lightings=(WEIGHTS, TARGETS)) is False
    [left] = rows[0].left_out
    assert left.what == "tiles beyond the camera's field, 10% on each side" and left.bound == 0.0
    with ledger.stage(rows, "plan"):
        assert wanted(build("lens", "diffraction_limited"))
        assert wanted(build("lens", "ideal"), flares=(build("flare", "haze"),))
        assert wanted(build("lens", "ideal", lateral_colour_percent={450.0: 0.1, 650.0: 0.0}))
        assert wanted(build("lens", "ideal", distortion={"model": "brown_conrady", "k1": -0.1}))
        assert wanted(build("lens", "ideal"), renderer=SimpleNamespace(margin=0.0)) and wanted(
            build("lens", "ideal"), renderer=None
        )
    assert not rows[1].left_out


def test_a_lens_or_lighting_that_says_nothing_keeps_the_margin():
    assert wanted(SimpleNamespace()) and wanted(
        build("lens", "ideal"), lightings=(WEIGHTS, SimpleNamespace())
    )


def test_a_lens_that_makes_its_own_light_is_not_outlined_by_what_it_inherits():
    """Otherwise light from beyond the field would be lost without a statement."""

    @dataclass(frozen=True)
    class Spreading(IdealLens):
        """A lens that inherits `keeps_light`, but spreads light."""

        def __call__(self, mixed, flares=(), error_allowed=0.0):
            """Return irradiance, the same everywhere."""
            light = super().__call__(mixed, flares, error_allowed)
            return light.copy(data=light.values * 0 + light.values.mean((1, 2), keepdims=True))

    @dataclass(frozen=True)
    class Outlined(IdealLens):
        """A lens that overrides `keeps_light` only."""

        def keeps_light(self, flares):
            """Return False, where the base class returns True."""
            return False

    assert not wanted(IdealLens()) and wanted(Spreading()) and wanted(Outlined())


def test_a_lens_without_a_plan_may_say_that_it_keeps_light_in_place():
    class Plain:
        """A lens without a plan."""

        def __call__(self, mixed, flares=()):
            """Return irradiance."""

        def keeps_light(self, flares):
            """Return whether nothing is spread."""
            return not flares

    assert not wanted(Plain()) and wanted(Plain(), flares=(build("flare", "haze"),))


def test_one_camera_that_needs_the_margin_is_enough():
    assert (
        union([Demand(margin=False), Demand()]).margin
        and not union([Demand(margin=False), Demand(margin=False)]).margin
    )


@pytest.mark.parametrize(
    ("stored", "asked", "held"),
    [(True, True, 1), (True, False, 1), (False, True, 0), (False, False, 1)],
)
def test_radiance_with_a_margin_serves_whoever_needs_none_and_not_the_other_way(
    monkeypatch, tmp_path, stored, asked, held
):
    attributes = {
        "id": "a",
        "labels": [],
        "effort": {},
        "groups": ["sky"],
        "all_groups": ["sky"],
        "absent_groups": [],
        "bands_asked": None,
        "wavelength_nm": [500.0],
        "margin": stored,
    }
    monkeypatch.setattr(stored_radiance, "stored", lambda folder, recipe: [attributes])
    monkeypatch.setattr(stored_radiance, "recipe_hash", lambda parts: "r")
    monkeypatch.setattr(store, "home", lambda: tmp_path)
    parts = Chain(None, SimpleNamespace(), None, {}, None, {}, {}, None, {})
    found, missing = stored_radiance.held_and_missing(parts, Demand(groups=("sky",), margin=asked))
    assert len(found) == held and (missing is None) == bool(held)
    if missing:
        assert missing.margin is asked
    # groups that are missing next to stored radiance with a margin are rendered with a margin too:
    # all stores of a run have the same grid
    assert stored_radiance.held_and_missing(parts, Demand(groups=("sky", "lamps"), margin=asked))[
        1
    ].margin is (asked or stored)
