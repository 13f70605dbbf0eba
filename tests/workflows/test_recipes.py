"""Stored radiance is reused where it suffices, extended by missing light groups, and rendered again
only for more effort.
"""

from __future__ import annotations

import errno
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import pytest
from omegaconf import open_dict

from isethdr_core import compose, run
from isethdr_core.conformance.renderer import world
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.runs.radiance_cache import scene_radiance as scene_radiance_of
from isethdr_core.storage import store

from .command import FAST

CALLS: list[tuple] = []


@dataclass(frozen=True)
class World:
    """Two light groups: sky and headlights."""

    def __call__(self):
        """Return the road, lamp and sky of the conformance kit."""
        return world()


@dataclass(frozen=True)
class Recorder:
    """Give each group a level of its own, and record the groups and samples of each call."""

    samples: int = 8
    bounces: int = 3

    effort_fields = ("samples",)

    def __call__(self, description, demand):
        """Return 12 x 8 tiles in 7 bands."""
        groups = description.light_groups() if demand.groups is None else demand.groups
        CALLS.append((tuple(groups), self.samples))
        levels = np.array([{"sky": 1e-3, "headlights": 1e-2}[g] for g in groups])
        labels = {"instance": np.zeros((8, 12), np.uint32)} if "instance" in demand.labels else {}
        return scene_radiance(
            np.broadcast_to(levels[:, None, None, None], (len(groups), 7, 8, 12)),
            groups,
            np.linspace(400, 700, 7),
            centres(12, 0.6),
            centres(8, 0.4),
            **labels,
        )


@dataclass(frozen=True)
class GoesOn(Recorder):
    """Give light that depends on the paths followed. Each path has a level of its own, and the
    number of paths determines the noise of their mean.
    """

    error_allowed: float | None = None

    effort_fields = ("samples", "error_allowed")

    def enough(self, paths, noise):
        """Return whether this number of paths, with this noise, suffices."""
        return paths >= self.samples and (self.error_allowed is None or noise <= self.error_allowed)

    def __call__(self, description, demand, known):
        """Return the mean of the paths that are not known yet."""
        groups = description.light_groups() if demand.groups is None else demand.groups
        spans = {}
        for group in groups:
            least = (
                self.samples
                if self.error_allowed is None
                else max(self.samples, round(self.error_allowed**-2))
            )
            spans[group] = [known[group].next, known[group].next + least - known[group].paths]
        ds = super().__call__(description, demand)
        CALLS[-1] = (tuple(groups), spans[groups[0]])
        for k, group in enumerate(groups):
            ds["radiance"][k] = LEVELS[slice(*spans[group])].mean()
        noise = {g: (b - a) ** -0.5 for g, (a, b) in spans.items()}
        return ds.assign_attrs(path_span=spans, noise=noise)


STARTED = threading.Event()
GO = threading.Event()


@dataclass(frozen=True)
class Slow(Recorder):
    """Render only when a test allows it."""

    def __call__(self, description, demand):
        """Wait, and render as the recorder does."""
        STARTED.set()
        assert GO.wait(600)
        return super().__call__(description, demand)


LEVELS = np.random.default_rng(4).gamma(2.0, 1e-3, 4096)


@pytest.fixture
def config(offer):
    """Return a function that makes the config of the world, its renderer, and a lighting of fixed
    weights.
    """
    offer("scene", "world", World)
    offer("renderer", "recorder", Recorder)
    offer("renderer", "goes_on", GoesOn)
    offer("renderer", "slow", Slow)
    CALLS.clear()

    def make(weights, name="recorder", **renderer):
        made = compose(
            [
                "scene=uniform",
                *FAST,
                "~metric.contrast",
                "sensor=ideal",
                "sensor.rows=4",
                "sensor.columns=4",
                "lighting=weights",
            ]
        )
        with open_dict(made):
            made.scene = {"name": "world"}
            made.renderer = {"name": name, **renderer}
            made.lighting.weights = weights
        return made

    return make


def scenes(home):
    """Return the groups of each stored scene."""
    return sorted(store.read_attrs(p)["groups"] for p in (home / "scenes").glob("*.zarr"))


def luminance(result):
    """Return the mean luminance of the picture, cd/m2."""
    return float(result.open("picture/ideal")["xyz"].values[..., 1].mean())


@pytest.mark.slow
def test_a_wider_demand_renders_what_is_missing_and_no_more(isethdr_home, config):
    night = run(config({"headlights": 1.0}))
    assert CALLS == [(("headlights",), 8)]
    both = run(config({"headlights": 1.0, "sky": 1.0}))
    assert CALLS[1:] == [(("sky",), 8)], "the headlights are stored already"
    assert scenes(isethdr_home) == [["headlights"], ["sky"]]
    other = run(config({"headlights": 0.5, "sky": 2.0}))
    sky = run(config({"sky": 1.0}))
    assert len(CALLS) == 2, "weights are no reason to render"
    # the joined stores are one scene, so light adds up; 2e-3: stores keep 12 bits of the mantissa
    assert luminance(both) == pytest.approx(luminance(night) + luminance(sky), rel=2e-3)
    assert luminance(other) == pytest.approx(0.5 * luminance(night) + 2 * luminance(sky), rel=2e-3)


@pytest.mark.slow
def test_more_effort_renders_again_and_less_takes_what_is_there(isethdr_home, config):
    run(config({"sky": 1.0}, samples=8))
    run(config({"sky": 1.0}, samples=4))
    assert CALLS == [(("sky",), 8)]
    run(config({"sky": 1.0}, samples=16))
    assert CALLS[1:] == [(("sky",), 16)] and len(scenes(isethdr_home)) == 2
    run(config({"sky": 1.0}, samples=2))
    assert len(CALLS) == 2
    run(config({"sky": 1.0}, samples=2, bounces=4))
    assert len(CALLS) == 3, "a field that changes the answer is no effort"


def test_of_two_that_want_the_same_scene_one_renders_and_the_other_waits(
    isethdr_home, config, capsys
):
    """Two lightings use one scene. Threads stand in for processes; test_claims tests processes."""
    both = [config({"sky": 1.0, "headlights": w}, "slow") for w in (1.0, 2.0)]
    with ThreadPoolExecutor() as pool:
        first = pool.submit(run, both[0])
        assert STARTED.wait(600)
        second = pool.submit(run, both[1])
        said = ""
        while "waiting for " not in said and not second.done():
            said += capsys.readouterr().err
            time.sleep(0.01)
        GO.set()
        assert first.result().key != second.result().key
    assert "waiting for" in said
    assert CALLS == [(("sky", "headlights"), 8)] and len(scenes(isethdr_home)) == 1
    assert not list((isethdr_home / "scenes").glob(".*"))


def test_a_damaged_scene_store_is_named_before_rendering_again_and_kept(isethdr_home, config):
    run(config({"sky": 1.0}))
    [path] = (isethdr_home / "scenes").glob("*.zarr")
    (path / "zarr.json").write_text("{}")
    with pytest.raises(CatalogError, match=f"{path.name} is damaged"):
        run(config({"sky": 0.5}))
    assert len(CALLS) == 1 and (path / "zarr.json").read_text() == "{}"


def test_a_group_that_the_scene_lacks_is_refused_before_rendering(isethdr_home, config):
    with pytest.raises(ConfigError, match="no light group 'headlamps'; did you mean 'headlights'"):
        run(config({"sky": 1.0, "headlamps": 1.0}))
    assert CALLS == [] and not list((isethdr_home / "scenes").glob("*"))


def test_what_is_rendered_is_kept_when_a_later_stage_fails(isethdr_home, config):
    wrong = config({"sky": 1.0})
    wrong.sensor.columns = 60_000
    with pytest.raises(ConfigError, match="type sensor.columns="):
        run(wrong)
    run(config({"sky": 1.0}))
    assert len(CALLS) == 1


def radiance(config):
    """Return the scene radiance that a run of `config` would start from, its light level, the notes
    of the ledger about stored paths, and the ledger.
    """
    parts = chain(config)
    rows = Ledger()
    scene, _ = scene_radiance_of(parts, plan(parts, rows), rows, config)
    said = [o.what for row in rows for o in row.left_out if "samples" in o.what]
    return scene, float(scene.radiance[0].values.ravel()[0]), said, rows


def test_more_paths_are_pooled_with_those_that_are_stored(isethdr_home, config):
    sky = {"weights": {"sky": 1.0}, "name": "goes_on"}
    rounded = {"rel": 1e-3}  # stores keep 12 bits of the mantissa
    _, level, reused, _ = radiance(config(**sky, samples=8))
    assert (
        CALLS == [(("sky",), [0, 8])]
        and reused == []
        and level == pytest.approx(LEVELS[:8].mean(), **rounded)
    )
    _, level, reused, _ = radiance(config(**sky, samples=32))
    assert CALLS[1:] == [(("sky",), [8, 32])], "none of the first paths is followed again"
    assert reused == ["8 of 32 samples per tile of light group sky"] and level == pytest.approx(
        LEVELS[:32].mean(), **rounded
    )
    # light that is known well enough is not rendered again, whichever field asks for it
    _, same, reused, _ = radiance(config(**sky, samples=4, error_allowed=0.2))
    assert (
        len(CALLS) == 2
        and reused == ["32 of 32 samples per tile of light group sky"]
        and same == level
    )
    scene, level, reused, rows = radiance(config(**sky, samples=4, error_allowed=0.1))
    assert CALLS[2:] == [(("sky",), [32, 100])] and reused == [
        "32 of 100 samples per tile of light group sky"
    ]
    assert level == pytest.approx(LEVELS[:100].mean(), **rounded) and scene.attrs["paths"] == {
        "sky": 100
    }
    stated = [
        e
        for row in rows
        for e in row.errors
        if row.stage == "radiance" and "light group sky" in e.label
    ]
    # three renderings have a noise of 1 / sqrt(paths) each; pooled, it is that of all their paths
    assert [e.value for e in stated] == [pytest.approx(0.1)] and "100 samples" in stated[0].label


def test_a_new_group_begins_with_its_own_first_path(isethdr_home, config):
    radiance(config({"sky": 1.0}, "goes_on", samples=8))
    radiance(config({"sky": 1.0, "headlights": 1.0}, "goes_on", samples=8))
    assert CALLS == [(("sky",), [0, 8]), (("headlights",), [0, 8])]


def test_a_rendering_that_breaks_leaves_the_old_state(isethdr_home, config, monkeypatch):
    first, *_ = radiance(config({"sky": 1.0}, "goes_on", samples=8))
    before = sorted((isethdr_home / "scenes").iterdir())

    def full(*anything):
        raise OSError(errno.ENOSPC, "full")

    with monkeypatch.context() as broken:
        broken.setattr(store, "_write", full)
        with pytest.raises(CatalogError, match="the disk is full"):
            radiance(config({"sky": 1.0}, "goes_on", samples=16))
    assert sorted((isethdr_home / "scenes").iterdir()) == before
    again, *_ = radiance(config({"sky": 1.0}, "goes_on", samples=8))
    assert np.array_equal(first.radiance.values, again.radiance.values) and len(CALLS) == 2
