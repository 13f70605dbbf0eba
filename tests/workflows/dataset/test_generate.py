"""Datasets of a tiny world: made once, continued, checked, described."""

from __future__ import annotations

import errno
import json
import os
import shlex
import signal
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import typer
import xarray as xr
from isethdr_workflows.dataset import generate as module
from isethdr_workflows.dataset import packs, summary
from isethdr_workflows.dataset.actions import OF_WORKERS, check, divided, workers_of
from isethdr_workflows.dataset.card import card
from isethdr_workflows.dataset.generate import Generated, Request, begun, generate, generated
from isethdr_workflows.dataset.page import write_page
from isethdr_workflows.dataset.recipe import parsed
from isethdr_workflows.dataset.record import (
    Definition,
    SceneRecord,
    changed_files,
    folder_of,
    read_dataset,
    read_scenes,
    unchecked_files,
    write_scene,
)
from isethdr_workflows.dataset.runtime_estimate import runtime_estimate
from isethdr_workflows.dataset.splits import splits
from isethdr_workflows.dataset.study import cameras
from isethdr_workflows.dataset.verify import verify
from isethdr_workflows.dataset.workers import lines_about, one_by_one

from isethdr_core.config.composition import compose
from isethdr_core.data.quantities import tristimulus
from isethdr_core.display import display_view
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.runs.radiance_cache import recipe as recipes
from isethdr_core.runs.run import run
from isethdr_core.storage import store

from ..command import here, isethdr, leftovers, start, wait_for
from .small_world import RENDERED, Small, SmallWorld

RECIPE = """
about: A panel over a road.
families:
  plain: {share: 2, overrides: [scene=small_world, renderer=small]}
  bright:
    overrides: [scene=small_world, renderer=small]
    draw: {scene.intensity_cd: {uniform: [200, 900]}}
splits: {train: 1, test: 1}
"""
METRICS = ("shares", "dynamic_range", "snr", "colour", "ssim", "contrast")  # left out here
# one camera and no scores: a chain of three cameras takes a quarter of a second to build
PLAIN = ["sensor=ideal", "lens=ideal", "isp=linear", "~flare.dirt", "~versions"]


def plain(overrides):
    """Return the composed config of a scene with one camera and no scores."""
    return compose([*overrides, *PLAIN])


@pytest.fixture
def recipe(offer, tmp_path, monkeypatch):
    """Return the path of a recipe of the small world."""
    offer("scene", "small_world", SmallWorld)
    offer("renderer", "small", Small)
    monkeypatch.setattr(module, "compose", plain)
    monkeypatch.setattr(summary, "compose", plain)
    RENDERED.clear()
    path = tmp_path / "small.yaml"
    path.write_text(RECIPE)
    return str(path)


def silent(_line):
    """Take a line of progress and show nothing."""


def test_a_dataset_is_made_once_whatever_interrupts_it(recipe, isethdr_home, monkeypatch):
    request = Request("tiny", count=6, seed=5, recipe=recipe)
    lines = []
    some = generate(Request("tiny", count=6, seed=5, recipe=recipe, sample=2), lines.append)
    assert sorted(some.scenes) == [0, 1]
    assert len(lines) == 2
    rendered = len(RENDERED)

    def killed(folder, record):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(module, "write_scene", killed)
        with pytest.raises(KeyboardInterrupt):
            generate(request, silent)
    interrupted = len(RENDERED)
    assert interrupted == rendered + 1
    whole = generate(request, silent)
    assert sorted(whole.scenes) == list(range(6))
    # the scene without a record is read from its store; scenes that failed are not rendered
    assert len(RENDERED) == len({record.stores for record in whole.made})
    assert generate(request, silent).made == whole.made
    assert len(RENDERED) == len({record.stores for record in whole.made})


def test_a_scene_that_fails_is_recorded_and_the_others_go_on(recipe, capsys):
    dataset = generate(Request("tiny", count=6, seed=5, recipe=recipe), silent)
    seeds = [int(s.road.rsplit("-", 1)[1]) for s in dataset.definition.scenes()]
    failing = [number for number, seed in enumerate(seeds) if seed % 5 == 0]
    assert failing, "choose another seed: the test needs a scene that fails"
    assert [record.number for record in dataset.failed] == failing
    assert len(dataset.made) == 6 - len(failing)
    assert "leaves no room" in dataset.failed[0].error
    path = folder_of("tiny") / "failed" / f"{failing[0]:05d}.txt"
    assert "Traceback" in path.read_text()
    assert all(record.seconds > 0 and record.stored_bytes > 0 for record in dataset.made)
    assert all(0 < record.cpu_seconds for record in dataset.made)
    problems = verify(dataset)
    assert [(p.number, "failed" in p.what) for p in problems] == [(n, True) for n in failing]
    with pytest.raises(typer.Exit):
        check("tiny")
    assert f"{6 - len(failing)} of 6 scenes are made; {len(failing)}" in capsys.readouterr().out


@pytest.mark.parametrize(
    "part", ["scenes", pytest.param("datasets/tiny/scenes", marks=pytest.mark.slow)]
)
def test_a_disk_that_fills_up_stops_it_and_spoils_nothing(recipe, monkeypatch, isethdr_home, part):
    """The disk of one folder has room for one and a half scenes."""
    before = generate(Request("tiny", count=3, seed=1, recipe=recipe, sample=1), silent)
    needed = sum(p.stat().st_size for p in (isethdr_home / part).rglob("*") if p.is_file())
    with monkeypatch.context() as patch:
        limit_disk(patch, isethdr_home / part, needed * 3 // 2)
        with pytest.raises(CatalogError, match=r"cannot write .*(full|No space left)") as error:
            module.make_scenes("tiny", range(3), silent)
    assert "\n" not in str(error.value)
    assert not leftovers(isethdr_home)
    stopped = generated(read_dataset("tiny"))
    assert 1 <= len(stopped.made) < 3 and stopped.made[0] == before.made[0]
    assert not stopped.failed and verify(stopped) == []
    rendered = len(RENDERED)
    module.make_scenes("tiny", range(3), silent)
    whole = generated(read_dataset("tiny"))
    assert len(whole.made) == 3 and verify(whole) == []
    stored = 3 - (len(RENDERED) - rendered)  # scenes that were not rendered again
    assert stored >= len(stopped.made)


def test_a_process_whose_command_was_killed_begins_no_further_scene(monkeypatch, tmp_path):
    parents = iter([7, 1])  # at the second call, its parent has ended
    monkeypatch.setattr("os.getppid", lambda: next(parents))
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))

    def make(name, numbers, tell):
        tell(f"{name}: scene {numbers[0]}")

    assert lines_about(make, "tiny", str(tmp_path), 7, 3) == ["tiny: scene 3"]
    with pytest.raises(CatalogError, match="the command was killed.*type the same command again"):
        lines_about(make, "tiny", str(tmp_path), 7, 4)


def limit_disk(patch, folder, most_bytes):
    """Give the files below a folder room for `most_bytes` more bytes in all."""
    opened = Path.open
    left = [most_bytes]

    class Limited:
        """A file on the disk that fills up."""

        def __init__(self, file):
            self.file = file

        def __getattr__(self, name):
            return getattr(self.file, name)

        def __enter__(self):
            return self

        def __exit__(self, *error):
            self.file.close()

        def write(self, data):
            left[0] -= len(data) if isinstance(data, str) else memoryview(data).nbytes
            if left[0] < 0:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return self.file.write(data)

    def limited(self, mode="r", *arguments, **settings):
        file = opened(self, mode, *arguments, **settings)
        return Limited(file) if "w" in mode and folder in self.parents else file

    patch.setattr(Path, "open", limited)


@pytest.mark.slow
def test_more_scenes_continue_a_dataset_and_another_seed_is_refused(recipe):
    few = generate(Request("tiny", count=1, seed=1, recipe=recipe), silent)
    more = generate(Request("tiny", count=3, seed=1, recipe=recipe), silent)
    assert {n: more.scenes[n] for n in few.scenes} == few.scenes
    assert read_dataset("tiny").count == 3
    generate(Request("tiny", count=2, seed=1, recipe=recipe), silent)
    assert read_dataset("tiny").count == 3  # a smaller count removes nothing
    with pytest.raises(ConfigError, match=r"seed=1.*generate tiny_2"):
        generate(Request("tiny", count=3, seed=2, recipe=recipe), silent)


def test_a_stored_dataset_is_not_tried_again(recipe, monkeypatch):
    """A trial lays out a street for each value of the recipe. It takes half a minute for the
    bundled recipes.
    """
    request = Request("tiny", count=1, seed=1, recipe=recipe)
    generate(request, silent)
    tried = []
    monkeypatch.setattr(module, "tried", lambda family, overrides: tried.append(family))
    begun(request)
    begun(Request("tiny", count=3, seed=1, recipe=recipe))
    assert tried == []
    with pytest.raises(ConfigError, match="generate tiny_2"):
        begun(Request("tiny", count=1, seed=1, recipe=recipe, overrides=("scene.fails=false",)))
    assert tried == ["plain", "bright", "bright"]


@dataclass(frozen=True)
class WorldOfFile(SmallWorld):
    """A world with a road file."""

    fails: bool = False
    road: str = ""

    def input_files(self):
        """Return the road file."""
        return (self.road,)


def test_a_dataset_whose_road_file_has_changed_is_not_continued(recipe, offer, tmp_path):
    """Without the file, or with the earlier content, its scenes are those that are stored."""
    offer("scene", "world_of_file", WorldOfFile)
    road = tmp_path / "town.xodr"
    road.write_text("lanes of 3.5 m")
    own = tmp_path / "own.yaml"
    own.write_text(
        f"families: {{a: {{overrides: [scene=world_of_file, renderer=small, scene.road={road}]}}}}"
    )
    request = Request("tiny", count=1, seed=1, recipe=str(own))
    dataset = generate(request, silent)
    road.write_text("lanes of 3.4 m")
    [problem] = verify(dataset)
    for count in (1, 2):
        more = Request("tiny", count=count, seed=1, recipe=str(own))
        with pytest.raises(ConfigError, match=f"type for example .*count={count}") as error:
            generate(more, silent)
    for said in (problem.what, str(error.value)):
        assert said.startswith(f"{road} has changed since")
        assert f"type for example isethdr dataset generate tiny_2 recipe={own} count=" in said
    again = generate(Request("tiny_2", count=1, seed=1, recipe=str(own)), silent)
    assert again.made[0].stores == dataset.made[0].stores, "the file changes no light here"
    assert verify(again) == []
    for missing in (False, True):
        road.write_text("lanes of 3.5 m")
        if missing:
            road.unlink()
        assert verify(dataset) == []
        assert generate(request, silent).made == dataset.made


def test_relative_paths_of_files_are_those_of_the_folder_of_the_call(
    recipe, offer, tmp_path, monkeypatch, isethdr_home, capsys
):
    """Another folder may hold another file of the same name, or none."""
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "home"))
    offer("scene", "world_of_file", WorldOfFile)
    here = tmp_path / "a place"
    there = tmp_path / "there"
    for folder, content in ((here, "lanes of 3.5 m"), (there, "lanes of 3.4 m")):
        folder.mkdir()
        (folder / "town.xodr").write_text(content)
    own = tmp_path / "own.yaml"
    own.write_text(
        "families: {a: {overrides: [scene=world_of_file, renderer=small, scene.road=town.xodr]}}"
    )
    request = Request("tiny", count=1, seed=1, recipe=str(own))
    monkeypatch.chdir(here)
    dataset = generate(request, silent)
    monkeypatch.chdir(there)
    assert verify(dataset) == []
    with pytest.raises(ConfigError) as error:
        generate(request, silent)
    advice = f"type for example cd '{here}' before the command, or isethdr dataset generate tiny_2"
    assert f"{there}/town.xodr differs from {here}/town.xodr, with which" in str(error.value)
    assert advice in str(error.value)
    for gone in (False, True):  # the file there is of no use
        (here / "town.xodr").write_text("lanes of 3.3 m")
        if gone:
            (here / "town.xodr").unlink()
        with pytest.raises(ConfigError, match="differs from .*; type for example isethdr dataset"):
            generate(request, silent)
    monkeypatch.chdir(tmp_path)
    (here / "town.xodr").write_text("lanes of 3.3 m")
    [problem] = verify(dataset)
    assert problem.what.startswith(f"{here}/town.xodr has changed since")
    (here / "town.xodr").unlink()
    check("tiny")
    said = f"not checked: 1 file that the scenes use, for example {here}/town.xodr, which is gone"
    assert said in capsys.readouterr().out
    [record] = dataset.made
    earlier = replace(record, folder="")  # the record of an earlier version
    monkeypatch.chdir(there)
    assert changed_files([earlier]) == {}
    assert unchecked_files([earlier]) == {"town.xodr": "whose folder its record does not name"}


def test_the_command_of_a_dataset_can_be_typed_into_a_shell():
    overrides = ("lighting.weights={sky: 1, headlights: 2}", "~flare.dirt")
    definition = Definition("mine", 3, 2, "my recipe.yaml", RECIPE, overrides, {}, "")
    own = ["recipe=my recipe.yaml", "count=2", "seed=3"]
    words = ["isethdr", "dataset", "generate", "mine", *own, *overrides]
    assert shlex.split(definition.command) == words


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"name": "a/b"}, "expected at most 100 letters"),
        ({"count": 0}, "expected a count of 1 or more"),
        ({"seed": -1}, "a seed of 0 or more"),
        ({"sample": 0}, "sample is 0; expected 1 or more"),
        ({"overrides": ("scene.intensity=3",)}, "the config has no key 'scene.intensity'"),
        ({"overrides": ("~renderer",)}, "there is nothing to render"),
        ({"overrides": ("scene.seed=4",)}, "scene.seed=4 sets the seed of every scene"),
    ],
)
def test_a_mistake_is_found_before_the_first_scene(
    recipe, isethdr_home, monkeypatch, changes, said
):
    monkeypatch.setattr(module, "compose", compose)
    with pytest.raises(ConfigError) as error:
        generate(Request(**{"name": "tiny", "recipe": recipe} | changes), silent)
    assert said in str(error.value)
    assert not RENDERED
    assert not (isethdr_home / "datasets").exists()


def test_a_damaged_store_is_named(recipe, isethdr_home):
    dataset = generate(Request("tiny", count=2, seed=1, recipe=recipe), silent)
    assert verify(dataset) == []
    path = isethdr_home / "scenes" / f"{dataset.made[0].stores[0]}.zarr"
    victim = max((p for p in path.rglob("*") if p.is_file()), key=lambda p: p.stat().st_size)
    content = bytearray(victim.read_bytes())
    content[len(content) // 2] ^= 1
    victim.write_bytes(content)
    problems = verify(generated(read_dataset("tiny")))
    assert [p.number for p in problems] == [dataset.made[0].number]


@pytest.mark.slow
def test_page_and_card_tell_what_there_is(recipe, isethdr_home):
    dataset = generate(Request("tiny", count=2, seed=3, recipe=recipe), silent)
    page = write_page(dataset).read_text()
    made = len(dataset.made)
    assert f"{made} of 2 scenes are made" in page
    assert page.count("data:image/jpeg") == 2 * made
    assert f"<td>car</td><td>{made}</td><td>{made}</td>" in page
    assert "<script" not in page
    text = card(dataset)
    assert f"| car | {made} | {made} |" in text
    assert "seed=3" in text


def test_light_that_few_paths_find_is_not_shown_by_day():
    """A light group is mostly noise if in most tiles its light and noise are 0, or its noise is at
    least half of its light.
    """
    radiance = np.ones((2, 3, 4, 6)) * 1e-3
    radiance[1, :, :, :2] = 0.0
    bands_nm = np.array([450.0, 550.0, 650.0])
    scene = scene_radiance(radiance, ["lamps", "sky"], bands_nm, centres(6, 0.6), centres(4, 0.4))
    level = display_view.luminance(tristimulus(scene.radiance.sel(light_group="lamps")))[0, 0]
    noise = np.zeros((2, 3, 4, 6))
    noise[:, :, :, 2:] = 0.4 * level
    dims = ("light_group", "xyz_channel", "y", "x")
    assert not summary.mostly_noise(scene.assign(xyz_noise=(dims, noise)), "sky")
    noise[1, :, :, 2:4] = 0.6 * level
    noisy = scene.assign(xyz_noise=(dims, noise))
    assert summary.mostly_noise(noisy, "sky") and not summary.mostly_noise(noisy, "lamps")
    assert not summary.mostly_noise(noisy, "moon") and not summary.mostly_noise(scene, "sky")


def test_who_images_the_scenes_is_no_override_and_a_seed_is_one():
    own, overrides = divided(["workers=2", "seed=3", "sensor=bayer"], OF_WORKERS)
    assert overrides == ["seed=3", "sensor=bayer"]
    assert (workers_of(own).engine, workers_of(own).count) == ("processes", 2)
    assert workers_of({}).engine == "here"
    with pytest.raises(ConfigError, match="workers is 'two'; expected a number"):
        divided(["workers=two"], OF_WORKERS)
    assert workers_of({"workers": 1}).engine == "here"
    for own in ({"partition": "gpu"}, {"workers": 2, "cpus": 4}, {"workers": 2, "engine": "here"}):
        with pytest.raises(ConfigError, match="has no effect with engine=.*type for example eng"):
            workers_of(own)


def test_the_command_estimates_run_time_splits_and_lists(recipe, capsys, monkeypatch, isethdr_home):
    settings = ["count=3", "seed=5", f"recipe={recipe}"]
    assert here(monkeypatch, capsys, "dataset", "generate", "tiny", *settings, "--dry-run")[0] == 0
    assert not RENDERED
    code, _ = here(monkeypatch, capsys, "dataset", "generate", "tiny", *settings)
    failed = bool(generated(read_dataset("tiny")).failed)
    assert code == int(failed)
    assert here(monkeypatch, capsys, "dataset", "splits", "tiny")[0] == 0
    parts = json.loads((isethdr_home / "datasets/tiny/splits.json").read_text())
    assert sorted(n for numbers in parts.values() for n in numbers) == list(range(3))
    code, error = here(monkeypatch, capsys, "dataset", "report", "tinny")
    assert code == 2
    assert "did you mean 'tiny'" in error
    code, error = here(monkeypatch, capsys, "dataset", "generate", "tiny", "count=six")
    assert (code, error.count("\n")) == (2, 1)
    assert "expected a number" in error


@pytest.mark.slow
def test_cameras_are_compared_over_the_scenes(recipe, capsys, monkeypatch, isethdr_home):
    """The study runs twice; the second time, no scene is imaged again."""
    monkeypatch.setattr(cameras, "compose", plain)
    dataset = generate(Request("tiny", count=1, seed=1, recipe=recipe), silent)
    folder = folder_of("tiny")
    few = ("draws=1", *(f"~metric.{name}" for name in METRICS))
    lines = []
    found = cameras.imaged(dataset, few, lines.append)
    assert "stored before" not in lines[0] and not found.failed
    assert cameras.imaged(dataset, few, lines.append) == found and "stored before" in lines[1]
    code, _ = here(monkeypatch, capsys, "dataset", "score", "tiny", *few)
    assert code == 0
    page = (folder / "scores.html").read_text()
    assert f"{len(dataset.made)} of {len(dataset.made)} scenes were imaged" in page
    assert "No object: person, bicycle" in page and "<script" not in page
    assert (folder / "objects.csv").read_text().count(",car,") == len(dataset.made)


@pytest.mark.slow
def test_a_study_reads_the_radiance_of_the_records_whatever_the_code(
    recipe, monkeypatch, isethdr_home
):
    """The code of the scene has changed, so its radiance cannot be found by its recipe."""
    [record] = generate(Request("tiny", count=1, seed=1, recipe=recipe), silent).made
    monkeypatch.setattr(recipes, "fingerprint", lambda *parts: {"scene/small_world": "new"})
    RENDERED.clear()
    assert run(plain(cameras.settings_of(record, ["draws=1"]))).attributes["scene_ids"] == []
    assert not RENDERED
    rendered = [*record.overrides, *cameras.OWN, "scene.fails=false"]
    assert cameras.settings_of(record, ["scene.fails=false"]) == rendered
    (isethdr_home / "scenes" / f"{record.stores[0]}.zarr").rename(isethdr_home / "gone")
    run(plain(cameras.settings_of(record, ["draws=1"])))
    assert len(RENDERED) == 1


def test_stored_radiance_has_the_noise_of_the_run_that_rendered_it(recipe, isethdr_home):
    """Noise is named by the radiance, so that different stored scenes have different noise."""
    [record] = generate(Request("tiny", count=1, seed=1, recipe=recipe), silent).made
    few = ["sensor=typical_bayer", "sensor.rows=24", "sensor.columns=32", "lens=ideal"]
    few += ["~flare.dirt", *(f"~metric.{name}" for name in compose([]).metric)]
    stored = cameras.settings_of(record, few)
    assert "scene=stored" in stored
    captures = []
    rendered = [*record.overrides, *cameras.OWN, *few]
    for settings in (stored, rendered, [*stored, "seed=1"]):
        result = run(compose(settings))
        [camera] = result.cameras
        captures.append(result.open(f"captures/{camera}").load().drop_attrs())
    xr.testing.assert_identical(*captures[:2])
    assert not captures[0].equals(captures[2]), "the captures have noise"


def test_motion_during_a_shot_is_not_asked_of_the_radiance_of_one_moment(monkeypatch):
    """Stored radiance stands still, so it would silently be imaged without motion."""
    monkeypatch.setattr(cameras, "is_stored", lambda _record: True)
    moving = "motion.within_exposure=true"
    record = SceneRecord(0, "f", "r", ("scene=street",), ("s",))
    assert "scene=stored" in cameras.settings_of(record, [])
    rendered = ["scene=street", *cameras.OWN, moving]
    assert cameras.settings_of(record, [moving]) == rendered
    record = SceneRecord(0, "f", "r", ("scene=street", moving), ("s",))
    assert cameras.settings_of(record, []) == ["scene=street", moving, *cameras.OWN]


@pytest.mark.slow
def test_two_processes_make_the_same_bytes_as_one_and_a_killed_one_is_continued(tmp_path):
    """Scenes of 24 x 16 tiles are rendered in full. Radiance and labels are equal bit for bit, and
    tables of scores byte for byte.
    """
    settings = ["count=3", "seed=2", "renderer.width=24", "renderer.height=16"]
    settings += ["renderer.noise_share_allowed=null", "renderer.samples=2", "scene.trees=[0,4]"]
    homes = {name: tmp_path / name for name in ("one", "two")}
    command = ("dataset", "generate", "small", *settings)
    one = isethdr(*command, ISETHDR_HOME=str(homes["one"]))
    assert one.returncode == 0, one.stderr
    two = (*command, "engine=processes", "workers=2")
    started = start(*two, ISETHDR_HOME=str(homes["two"]))
    wait_for(homes["two"] / "datasets" / "small" / "dataset.json", started)
    os.killpg(started.pid, signal.SIGKILL)
    started.wait()
    again = isethdr(*two, ISETHDR_HOME=str(homes["two"]))
    assert again.returncode == 0, again.stderr
    names = {k: sorted(p.name for p in (h / "scenes").glob("*.zarr")) for k, h in homes.items()}
    assert names["one"] == names["two"]
    for name in names["one"]:
        first, second = (store.open_store(home / "scenes" / name) for home in homes.values())
        for variable in first.data_vars:
            assert np.array_equal(first[variable].values, second[variable].values), variable
    of_runs = ["sensor=ideal", "lens=ideal", "isp=linear", "~flare.dirt", "~versions"]
    score = ("dataset", "score", "small", *of_runs)
    by_one = isethdr(*score, ISETHDR_HOME=str(homes["one"]))
    by_two = isethdr(*score, "engine=processes", "workers=2", ISETHDR_HOME=str(homes["two"]))
    assert by_one.returncode == by_two.returncode == 0, by_one.stderr + by_two.stderr
    for scored in (by_one, by_two):
        assert all(f"scene {number}: " in scored.stdout for number in (1, 2, 3))
        assert scored.stdout.count("left") == 2  # after all scenes but the last one
    tables = [home / "datasets" / "small" / "scores.csv" for home in homes.values()]
    assert tables[0].read_bytes() == tables[1].read_bytes()


def test_a_road_stays_in_its_part_when_the_dataset_grows(recipe):
    scenes = begun(Request("tiny", count=3, seed=3, recipe=recipe)).scenes()
    few = splits(scenes, {"train": 0.5, "test": 0.5})
    many = splits(scenes * 2, {"train": 0.5, "test": 0.5})
    assert all(set(few[part]) == set(many[part]) for part in few)


def test_an_unreadable_record_is_made_again(recipe):
    request = Request("tiny", count=3, seed=1, recipe=recipe)
    dataset = generate(request, silent)
    path = folder_of("tiny") / "scenes" / "00001.json"
    path.write_text("{")
    assert sorted(read_scenes(folder_of("tiny"))) == [0, 2]
    assert generate(request, silent).made == dataset.made


def test_no_runtime_estimate_from_one_scene(recipe):
    assert runtime_estimate([], 10) is None


def test_a_recipe_that_draws_the_seed_of_its_scenes_is_refused():
    text = RECIPE.replace("scene.intensity_cd: {uniform", "+scene.seed: {uniform")
    with pytest.raises(ConfigError, match="scene.seed sets the seed of every scene"):
        module.check_seeds(parsed(text, "mine"), ())
    module.check_seeds(parsed(RECIPE, "mine"), ("scene.intensity_cd=5", "seed=2"))


def test_the_card_counts_the_families_of_the_scenes_that_are_made(monkeypatch):
    for lines in ("pack_lines", "file_lines"):
        monkeypatch.setattr(sys.modules[card.__module__], lines, lambda _dataset: [])
    definition = Definition("tiny", 5, 6, "small", RECIPE, (), {}, "")
    record = SceneRecord(0, "bright", "bright-1", (), stores=("a",))
    assert "1 of 6 scenes are made (1 bright)." in card(Generated(definition, {0: record}))
    assert "0 of 6 scenes are made." in card(Generated(definition, {}))


def test_the_card_names_the_road_files_of_the_scenes(monkeypatch):
    inputs = {"maps/town.xodr": "1f", "packs/a/pack.yaml": "2e"}
    attributes = {"scene": {"assets": ["packs/a"]}, "inputs": inputs}
    monkeypatch.setattr(packs, "read_attrs", lambda _path: attributes)
    definition = Definition("tiny", 5, 6, "small", RECIPE, (), {}, "")
    record = SceneRecord(0, "bright", "bright-1", (), stores=("a",))
    text = card(Generated(definition, {0: record}))
    assert "asset packs and the roads and the traffic of the files named below." in text
    assert "- `maps/town.xodr` (its SHA-256 begins with 1f)" in text
    assert "- `packs/a`: cannot be read now" in text and "pack.yaml" not in text
    assert "text of others" not in text and "contains no" not in text
    attributes.update(scene={}, inputs={})
    assert "contains no photograph" in card(Generated(definition, {0: record}))


def test_scenes_of_slow_families_come_before_those_of_quick_ones(monkeypatch, tmp_path):
    """First one scene of each family, then the slowest family that is known. A failed scene is no
    measure.
    """
    families = {"quick": (0, 3, 4), "slow": (1, 5), "failing": (2, 6)}
    of = {number: name for name, numbers in families.items() for number in numbers}
    scenes = [SimpleNamespace(number=number, family=of[number]) for number in range(7)]
    definition = SimpleNamespace(name="mine", scenes=lambda: scenes)
    monkeypatch.setattr(module, "folder_of", lambda name: tmp_path)
    order = module.longest_first(definition)
    seconds = {"quick": 3.0, "slow": 90.0, "failing": 0.0}
    taken = []
    for number in one_by_one(range(7), order):
        stores = () if of[number] == "failing" else ("a",)
        record = SceneRecord(number, of[number], "r", (), stores, seconds=seconds[of[number]])
        write_scene(tmp_path, record)
        taken.append(number)
    assert taken == [0, 1, 2, 5, 3, 4, 6]
