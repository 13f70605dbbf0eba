"""Settings of a detector's training, its patches and its targets, tested without PyTorch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_workflows.dataset.generate import Generated, Request, generate
from isethdr_workflows.dataset.record import Definition, SceneRecord, read_dataset
from isethdr_workflows.dataset.study.cameras import settings_of
from isethdr_workflows.detection.lit_scene import LitScene, joined_stores, lit
from isethdr_workflows.detectors.objects import TruthObject, truth_objects
from isethdr_workflows.detectors.picture_input import View, displayed
from isethdr_workflows.training.detector import pictures
from isethdr_workflows.training.detector.patches import STRIDE, batch, patch, targets_of
from isethdr_workflows.training.detector.pictures import records_of, shrunk
from isethdr_workflows.training.detector.settings import parsed

from isethdr_core.config.composition import compose
from isethdr_core.errors import ConfigError
from isethdr_core.runs.run import run

from ..dataset.small_world import Small, SmallWorld
from .drawn_roads import drawn

RECIPE = """
about: A panel over a road.
families:
  plain: {overrides: [scene=small_world, scene.fails=false, renderer=small, lighting=day]}
splits: {train: 1}
"""
# few pixels, and no kernels to make
SMALL = ("sensor=typical_bayer", "sensor.rows=24", "sensor.columns=32", "lens=ideal", "~flare.dirt")


@pytest.mark.parametrize(
    ("typed", "match"),
    [
        ([], "a dataset is needed"),
        (["dataset=a", "minutes=many"], "minutes is 'many'; expected a number"),
        (["dataset=a", "steps=1e3"], "steps is '1e3'; expected a whole number"),
        (["dataset=a", "size=smal"], "size is 'smal'; did you mean 'small'"),
        (["dataset=a", "patch_px=100"], "multiples of 16"),
        (["dataset=a", "realisations=0"], "realisations is 0; expected at least 1"),
        (["dataset=a", "rate=2"], "rate is 2"),
        (["dataset=a", "minutes=3", "steps=3"], "expected one of them"),
        (["dataset=a", "fast"], "'fast' is no setting"),
    ],
)
def test_settings_that_make_no_sense_are_named(typed, match):
    with pytest.raises(ConfigError, match=match):
        parsed(typed)


def test_other_keys_are_overrides_of_the_config():
    settings, overrides = parsed(["dataset=streets", "lens=ideal", "~flare.dirt"])
    assert overrides == ["lens=ideal", "~flare.dirt"]
    assert (settings.minutes, settings.folder_name) == (40.0, "streets_small")


def test_targets_have_one_peak_for_each_object_and_state_its_sides():
    boxes = np.array([[8.0, 4, 24, 36], [40, 40, 56, 48]])
    targets = targets_of(boxes, np.array([0, 3]), np.array([True, True]), 64)
    assert targets.heat.shape == (5, 16, 16)
    assert [(targets.heat[k] == 1).sum() for k in range(5)] == [1, 0, 0, 1, 0]
    for box, kind in zip(boxes, (0, 3)):
        j, i = np.argwhere(targets.heat[kind] == 1)[0]
        x = (i + 0.5) * STRIDE
        y = (j + 0.5) * STRIDE
        left, top, right, bottom = np.exp(targets.sides[:, j, i])
        np.testing.assert_allclose([x - left, y - top, x + right, y + bottom], box, rtol=1e-5)
        assert targets.inside[0, j, i] == 1
    assert targets.asked.all()


def test_nothing_is_asked_of_hidden_objects_and_of_those_cut_off():
    boxes = np.array([[8.0, 8, 24, 24], [-30, 40, 10, 56]])
    targets = targets_of(boxes, np.array([0, 1]), np.array([False, True]), 64)
    assert not targets.heat.any() and not targets.inside.any()
    asked = targets.asked[0].astype(bool)
    assert not asked[2:6, 2:6].any() and not asked[10:14, :2].any()
    assert asked.sum() == 16 * 16 - 4 * 4 - 4 * 2  # places with their middle in a box


def test_patches_show_what_their_targets_state():
    """At the centre of each object, the patch has the colour of the object's class."""
    colours = {0: 0, 1: 1, 2: 2}  # classes that are red, green, blue
    random = np.random.default_rng(3)
    seen = 0
    for k in range(30):
        rgb, targets = patch(drawn(k, "a"), 64, random)
        assert rgb.shape == (3, 64, 64) and rgb.dtype == np.float32
        assert 0 <= rgb.min() and rgb.max() <= 1
        for kind, channel in colours.items():
            for j, i in np.argwhere(targets.heat[kind] == 1):
                middle = rgb[:, j * STRIDE : (j + 1) * STRIDE, i * STRIDE : (i + 1) * STRIDE]
                seen += 1
                assert middle.mean((1, 2)).argmax() == channel
    assert seen > 10


def test_a_batch_is_the_same_for_the_same_key():
    pictures = [drawn(k, "a") for k in range(3)]
    first = batch(pictures, 4, 64, np.random.default_rng((1, 2)))
    again = batch(pictures, 4, 64, np.random.default_rng((1, 2)))
    assert [a.shape[0] for a in first] == [4] * 5
    for a, b in zip(first, again):
        np.testing.assert_array_equal(a, b)


def test_shrinking_keeps_boxes_on_their_objects():
    known = {"distance_m": 1.0, "illuminance_lx": 1.0, "lamp_near": False, "truncation": 0.0}
    rgb = np.zeros((40, 80, 3), np.uint8)
    rgb[8:24, 40:56] = 255
    one = TruthObject(1, "car", "car", "car", (40.0, 8.0, 56.0, 24.0), **known, visible_fraction=1)
    two = TruthObject(2, "car", "car", "car", (0.0, 0.0, 2.0, 2.0), **known, visible_fraction=1)
    picture = shrunk(rgb, [one, two], 40)
    assert picture.rgb.shape == (20, 40, 3)
    np.testing.assert_array_equal(picture.boxes[0], [20, 4, 28, 12])
    assert picture.asked.tolist() == [True, False]
    assert picture.rgb[5:11, 21:27].min() == 255


def records(count: int, **fields) -> Generated:
    """Return a dataset of `count` scenes, about half of them for training."""
    recipe = "families: {f: {overrides: [a=1]}}\nsplits: {train: 1, validation: 1}\n"
    definition = Definition("few", 1, count, "r", recipe, (), {}, "")
    made = {
        scene.number: SceneRecord(scene.number, "f", scene.road, (), ("s",), **fields)
        for scene in definition.scenes()
    }
    return Generated(definition, made)


def test_a_dataset_of_one_scene_or_without_objects_is_refused():
    with pytest.raises(ConfigError, match="has no scene yet; expected several roads"):
        records_of(records(1))
    with pytest.raises(ConfigError, match="scenes show no car, truck"):
        records_of(records(12))
    car = {"category": "car", "name": "car 1", "instance": 1}
    parts = records_of(records(12, objects=(car,)))
    assert len(parts["train"]) + len(parts["validation"]) == 12


def test_a_part_without_a_picture_is_refused(monkeypatch):
    """Every lighting fails, for example because the scenes lack its light groups."""
    car = {"category": "car", "name": "car 1", "instance": 1}
    dataset = records(12, objects=(car,))
    monkeypatch.setattr(pictures, "read_dataset", lambda name: name)
    monkeypatch.setattr(pictures, "generated", lambda name: dataset)
    monkeypatch.setattr(pictures, "chosen_cameras", lambda *asked: (["bayer"], []))
    monkeypatch.setattr(pictures, "scenes_at_once", lambda *asked: 1)
    monkeypatch.setattr(pictures, "scene_pictures", lambda *asked: [])
    settings, overrides = parsed(["dataset=few", "lightings=dawn"])
    with pytest.raises(ConfigError, match="'train' could be imaged.*not lightings=dawn"):
        pictures.data_of(settings, overrides, lambda line: None)
    # the card and the description of the detector name the overrides
    monkeypatch.setattr(pictures, "scene_pictures", lambda *asked: [drawn(0, "a")])
    assert pictures.data_of(settings, ["lens=ideal"], print).about.endswith(
        "; overrides lens=ideal"
    )


def test_light_has_another_name_once_a_run_has_added_radiance(isethdr_home):
    """All stores of a recipe are joined when a scene is opened."""
    record = SceneRecord(0, "f", "r", (), ("ab-2",))
    for name in ("ab-2.zarr", "abc-1.zarr"):
        (isethdr_home / "scenes" / name).mkdir(parents=True)
    assert joined_stores(record) == ["ab-2"]
    (isethdr_home / "scenes" / "ab-1.zarr").mkdir()
    assert joined_stores(record) == ["ab-1", "ab-2"]


def test_as_many_scenes_are_imaged_at_once_as_fit_into_the_memory(monkeypatch):
    monkeypatch.setattr(pictures, "built_for", lambda *asked: (None, None))
    monkeypatch.setattr(pictures, "pixel_bytes", lambda built: {"bayer": 1e9, "rgbw": 1e9})
    monkeypatch.setattr(pictures, "threads_of", lambda built: 8)
    for free_bytes, scenes in ((5e9, 2), (1e9, 1), (1e12, 8)):
        monkeypatch.setattr(pictures, "free_memory", lambda free=free_bytes: free)
        assert pictures.scenes_at_once(SceneRecord(0, "f", "r", ()), []) == scenes


@pytest.fixture
def panel(offer, isethdr_home, tmp_path) -> SceneRecord:
    """Return a stored scene with one car."""
    offer("scene", "small_world", SmallWorld)
    offer("renderer", "small", Small)
    recipe = tmp_path / "small.yaml"
    recipe.write_text(RECIPE)
    return generate(Request("tiny", count=1, seed=1, recipe=str(recipe)), print).made[0]


def test_pictures_are_those_of_a_run_with_the_same_noise(panel):
    """The stored picture of a run is rounded by less than its noise: at most one code of 255."""
    only_labels = [f"~metric.{name}" for name in compose([]).metric if name != "contrast"]
    result = run(compose([*settings_of(panel, SMALL), *only_labels]))
    [camera] = result.cameras
    reference = result.open(f"truth/{camera}").load()
    rgb = displayed(result.open(f"picture/{camera}").load(), View.of(reference), "png")
    objects = truth_objects(reference, result.attributes["weights"])
    # the noise of the run has the name of the recipe of the radiance
    recipe = panel.stores[0].partition("-")[0]
    [found] = pictures.camera_pictures(lit(panel, SMALL), [camera], 0, 640, recipe)
    np.testing.assert_allclose(found.rgb.astype(float), 255 * rgb, rtol=0, atol=1.5)
    assert found.rgb.std() > 2, "the picture shows the car, or noise"
    np.testing.assert_array_equal(found.boxes, [one.box for one in objects])
    assert found.classes.tolist() == [0]


def test_kept_pictures_are_read_again_and_each_realisation_has_noise_of_its_own(panel, monkeypatch):
    settings, overrides = parsed(["dataset=tiny", "realisations=2", "lightings=recipe", *SMALL])
    asked = (panel, settings, list(lit(panel, SMALL).built.cameras), overrides, print)
    first = pictures.scene_pictures(*asked)
    assert len(first) == 2
    assert (first[0].rgb != first[1].rgb).any()

    def imaged_again(seen: LitScene):
        raise AssertionError("the pictures are kept")

    monkeypatch.setattr(LitScene, "light", property(imaged_again))
    for one, again in zip(first, pictures.scene_pictures(*asked), strict=True):
        assert again.road == panel.road
        for before, after in zip(one.arrays(), again.arrays(), strict=True):
            np.testing.assert_array_equal(before, after)


def test_overrides_that_ask_for_other_radiance_are_refused(panel):
    moving = "motion.within_exposure=true"
    for text in ("renderer.width=9", "scene=night_drive", "+experiment=dusk", moving):
        settings, overrides = parsed(["dataset=tiny", text])
        with pytest.raises(ConfigError, match="changes the radiance.*type for example lens"):
            pictures.data_of(settings, overrides, print)
    assert read_dataset("tiny").count == 1
    with pytest.raises(ConfigError, match="scene 1 moves during a shot"):
        lit(replace(panel, overrides=(*panel.overrides, moving)), SMALL)
