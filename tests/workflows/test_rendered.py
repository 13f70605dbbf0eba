"""Stored radiance with the real renderer: a second light group is rendered alone and stored next to
the first; an interrupted rendering leaves stored radiance as it was.
"""

from __future__ import annotations

import os
import shutil
import signal

import pytest

from isethdr_core.storage import store

from .command import FAST, installed_trouble, isethdr, leftovers, start, stores, wait_for

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


BY_NEED = [
    *(o for o in TINY if not o.startswith(("renderer.samples", "sensor", "lighting", "isp"))),
    "sensor=typical_bayer",
    "lighting=ideal",
]


@pytest.mark.slow
def test_a_rendering_by_need_that_ends_in_the_middle_leaves_what_was_there(tmp_path):
    """The rendering is killed, or stopped by Ctrl-C, between its paths. The radiance stored before
    is still there, and the same run then gives the same as without an interruption.
    """
    home = tmp_path / "home"
    beside = tmp_path / "beside"
    plugins = [installed_trouble(tmp_path / "plugins")]
    first = isethdr("run", *BY_NEED, "renderer.noise_share_allowed=50", ISETHDR_HOME=str(home))
    assert first.returncode == 0, first.stderr
    made = stores(home)
    shutil.copytree(home, beside)
    finer = ["run", *BY_NEED, "renderer.noise_share_allowed=0.5"]
    for number, code in ((signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 130)):
        mark = tmp_path / f"mark-{number}"
        variables = {"ACME_WAIT": "paths", "ACME_MARK": str(mark), "ISETHDR_HOME": str(home)}
        process = start(*finer, plugins=plugins, **variables)
        wait_for(mark, process)
        os.killpg(process.pid, number)
        process.communicate(timeout=600)
        assert process.returncode == code
        # the claim of a killed process stays, and is ignored
        assert stores(home) == made and all(".claim-" in name for name in leftovers(home))
        mark.with_name("passed-1").unlink()
    found = []
    for folder in (home, beside):
        done = isethdr(*finer, ISETHDR_HOME=str(folder))
        assert done.returncode == 0, done.stderr
        [new] = [p for p in (folder / "scenes").glob("*.zarr") if p.name not in made]
        found.append(store.read_attrs(new))
    assert all(attributes["limit_share"] == 0.5 for attributes in found)
    # neither home follows the earlier paths again
    first = [{g: span[0] for g, span in a["path_span"].items()} for a in found]
    assert first[0] == first[1] and min(first[0].values()) > 0
