"""The same through the real renderer: a second light group is rendered alone, beside the first."""

from __future__ import annotations

import pytest

from isethdr_core.storage import store

from .command import FAST, isethdr, stores

TINY = [
    "scene=night_drive",
    "scene.trees=[1,2]",
    "renderer=mitsuba",
    "renderer.width=32",
    "renderer.height=18",
    "renderer.samples=4",
    "renderer.step_nm=50",
    "sensor=ideal",
    "lighting=weights",
    *(o for o in FAST if o != "~renderer" and not o.startswith("scene.")),
]


@pytest.mark.slow
def test_a_second_group_is_rendered_beside_the_first(isethdr_home):
    first = isethdr("run", *TINY, "+lighting.weights.sky=1")
    assert first.returncode == 0, first.stderr
    made = stores(isethdr_home)
    wrong = isethdr("run", *TINY, "+lighting.weights.moon=1")
    assert (
        wrong.returncode == 2
        and "no light group 'moon'" in wrong.stderr
        and stores(isethdr_home) == made
    )
    second = isethdr("run", *TINY, "+lighting.weights.sky=1", "+lighting.weights.headlights=1")
    assert second.returncode == 0 and made.items() <= stores(isethdr_home).items()
    assert sorted(
        store.read_attrs(p)["groups"] for p in (isethdr_home / "scenes").glob("*.zarr")
    ) == [["headlights"], ["sky"]]
