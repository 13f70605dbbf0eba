"""Rendered roads for training: the parts of a dataset, and datasets that are refused."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from isethdr_workflows.dataset.record import SCENES, SceneRecord
from isethdr_workflows.dataset.splits import part_of
from isethdr_workflows.training.learned_picture import learned_picture
from isethdr_workflows.training.learned_picture.study import levels
from isethdr_workflows.training.picture import sources
from isethdr_workflows.training.picture.roads import Road, cropped, relit_weights, roads_of

from isethdr_core.errors import CatalogError, ConfigError

RECIPE = "families: {night: {overrides: [scene=night_drive]}}"
SHARES = {"train": 0.7, "validation": 0.15, "test": 0.15}


def dataset(home, roads):
    """Write a dataset with one scene for each of `roads`, and return its folder."""
    folder = home / "datasets" / "few"
    (folder / SCENES).mkdir(parents=True)
    definition = {
        "name": "few",
        "seed": 1,
        "count": len(roads),
        "recipe_name": "few",
        "recipe_text": RECIPE,
        "overrides": [],
        "versions": {},
        "created": "",
    }
    (folder / "dataset.json").write_text(json.dumps(definition))
    for number, road in enumerate(roads):
        record = {
            "number": number,
            "family": "night",
            "road": road,
            "overrides": [],
            "stores": [f"store-{number}"],
            "objects": [],
        }
        (folder / SCENES / f"{number:05d}.json").write_text(json.dumps(record))
    return folder


def named(part, count):
    """Return names of `count` roads that belong to a part."""
    names = (f"road-{k}" for k in range(1000))
    return [name for name in names if part_of(name, SHARES) == part][:count]


def test_a_road_is_in_one_part_and_two_are_needed(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    train = named("train", 2)
    held_out = named("validation", 1)
    folder = dataset(tmp_path, [train[0], *held_out, train[1], train[0]])
    found = roads_of("few")
    assert [road.record.road for road in found.of("train")] == [train[0], train[1], train[0]]
    assert [road.record.road for road in found.of("validation")] == held_out
    assert found.of("train")[0].path == tmp_path / "scenes" / "store-0.zarr"
    assert roads_of(str(folder)) == found or roads_of(str(folder)).parts == found.parts


@pytest.mark.parametrize(
    "parts",
    [
        {"train": 1},  # a training set of one scene
        {"train": 1, "validation": 2},
        {"train": 3},  # nothing is held out
    ],
)
def test_a_training_set_of_one_scene_is_refused(tmp_path, monkeypatch, parts):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    dataset(tmp_path, [name for part, count in parts.items() for name in named(part, count)])
    with pytest.raises(ConfigError, match="expected at least 2 and 1; type for example isethdr"):
        roads_of("few")


def test_a_dataset_that_is_not_there_is_named(tmp_path):
    with pytest.raises(CatalogError, match="no dataset in .*nowhere"):
        roads_of(str(tmp_path / "nowhere"))


def test_relit_groups_are_about_equally_bright():
    rng = np.random.default_rng(0)
    radiance = (
        rng.uniform(0.5, 1.5, (3, 4, 20, 20)) * np.array([1.0, 1e-4, 0.0])[:, None, None, None]
    )
    scene = xr.Dataset(
        {"radiance": (("light_group", "wavelength", "y", "x"), radiance)},
        coords={"light_group": ["sky", "lamps", "dark"], "wavelength": [450.0, 520, 590, 660]},
    )
    weights = relit_weights(scene, rng)
    assert weights["dark"] == 0
    # weights make the groups equally bright, up to a random factor exp(x), where x is normal with a
    # sigma of 1
    ratio = weights["lamps"] / weights["sky"] * 1e-4
    assert np.exp(-4 * 2**0.5) < ratio < np.exp(4 * 2**0.5)


def test_the_overscan_is_cut_off_evenly():
    planes = np.arange(12 * 16, dtype=float).reshape(1, 12, 16)
    mixed = xr.DataArray(
        attrs={"field_width": 1.2, "pitch_x": 0.1, "field_height": 0.8, "pitch_y": 0.1}
    )
    assert np.array_equal(cropped(planes, mixed), planes[:, 2:10, 2:14])


def test_a_study_without_a_model_or_with_wrong_light_is_refused():
    with pytest.raises(ConfigError, match="type model=FILE.onnx"):
        learned_picture()
    assert levels("0.01,10") == [0.01, 10.0]
    for wrong in ("", "dark", "0.1,-1", "nan,1", "inf"):
        with pytest.raises(ConfigError, match="expected numbers above 0"):
            levels(wrong)


def test_roads_under_another_light_are_other_pictures(monkeypatch):
    """Datasets that differ in their lighting alone share the stores of their scenes."""
    recipes = []
    monkeypatch.setattr(sources, "bank", lambda _title, recipe, *_, **__: recipes.append(recipe))
    bands = xr.Dataset(coords={"wavelength": [500.0]})
    monkeypatch.setattr(sources, "open_scene", lambda _path: bands)
    camera = SimpleNamespace(plane_weights=lambda _nm: np.ones((4, 1)))
    for lighting in ("day", "night_rural"):
        record = SceneRecord(0, "night", "road", (f"lighting={lighting}",), stores=("s",))
        sources.roads_source([Road(record, Path("s.zarr"))], camera, [], 1.0)
    assert recipes[0] != recipes[1]


def test_noise_of_rendering_that_is_0_or_not_known_has_no_electrons():
    assert sources.as_of_sensor(0.01) == ", that of a sensor at 10000 e"
    assert sources.as_of_sensor(0.0) == sources.as_of_sensor(float("nan")) == ""
