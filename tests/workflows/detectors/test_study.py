"""The study of detectors: from a dataset and a detector to tables, and requests that fail."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
import xarray as xr
from isethdr_workflows.dataset.generate import Generated, Request, generate
from isethdr_workflows.dataset.record import Definition, SceneRecord, folder_of
from isethdr_workflows.dataset.study.cameras import Imaged, Shot
from isethdr_workflows.detectors import bootstrap, objects, study
from isethdr_workflows.detectors.objects import nearest_lamp_deg, truth_objects
from isethdr_workflows.detectors.study import detector_scores
from omegaconf import OmegaConf

from isethdr_core.data.reference_picture import make_picture
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage.store import write_store

from ..dataset.small_world import Small, SmallWorld

pytest.importorskip("onnx", reason="stand-in detectors are written by onnx")
pytest.importorskip("onnxruntime", reason="detectors are computed by onnxruntime")
pytest.importorskip("hotcoco", reason="detections are matched by hotcoco")

from .standins import bright_cells, described

ROWS = 24
COLUMNS = 32
DEEP = 8  # side of a cell of the detector in these pictures, pixels
FOCAL_MM = 4.0
PITCH_UM = 40.0  # 0.573 degrees per pixel on the axis


def panel_picture(cells, red: float, instances=()) -> xr.Dataset:
    """Return a dark picture with red cells; a cell with an instance above 0 is an object."""
    xyz = np.full((ROWS, COLUMNS, 3), 0.01)
    instance = np.zeros((ROWS, COLUMNS), np.uint32)
    for (row, column), number in zip(cells, instances, strict=True):
        at = np.s_[DEEP * row : DEEP * (row + 1), DEEP * column : DEEP * (column + 1)]
        xyz[at] = np.array([0.41, 0.21, 0.02]) * red  # the red of sRGB
        instance[at] = number
    y = (np.arange(ROWS) - (ROWS - 1) / 2) * PITCH_UM * 1e-6
    x = (np.arange(COLUMNS) - (COLUMNS - 1) / 2) * PITCH_UM * 1e-6
    picture = make_picture(
        xyz,
        np.zeros_like(xyz),
        np.ones(xyz.shape[:2], bool),
        x,
        y,
        focal_length_mm=FOCAL_MM,
        pitch_um=PITCH_UM,
    )
    picture["instance"] = (("y", "x"), instance)
    picture.attrs["objects"] = [
        {
            "instance": int(number),
            "category": "car",
            "name": f"car {number}",
            "box": [0, 0, 1, 1],
            "visible_fraction": 1.0,
            "distance_m": 20.0 * number,
            "illuminance_lx": {"sky": 2.0},
        }
        for number in instances
        if number
    ]
    return picture


STRICT = {"struct": True}  # like the main config, which has no key `sensor`
RECORDS = {}
SHOTS = []


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Return a home with the runs of three roads behind two cameras; the second one shows no red.

    Every picture has a car in the cell (1, 2), and the last one has a second car in (0, 0).
    """
    home = tmp_path_factory.mktemp("detectors")
    for number in range(3):
        cells = [(1, 2), (0, 0)] if number == 2 else [(1, 2)]
        instances = list(range(1, len(cells) + 1))
        shown = {
            "red": panel_picture(cells, 1.0, instances),
            "dark": panel_picture(cells, 0.01, instances),
        }
        groups = {f"picture/{c}": p[["xyz", "variance", "valid"]] for c, p in shown.items()}
        groups |= {f"truth/{c}": shown["red"] for c in shown}
        key = f"{number:016d}"
        write_store(home / "runs", key, groups, {"kind": "run", "cameras": list(shown)})
        road = f"road-{number}"
        rows = tuple(shown["red"].attrs["objects"])
        RECORDS[number] = SceneRecord(number, "f", road, (), ("s",), objects=rows)
        SHOTS.append(Shot(number, road, key, (), (), {"sky": 1.0}))
    (home / "datasets" / "cars").mkdir(parents=True)
    return home


class World:
    """A dataset of three roads in place of a rendered one."""

    def __init__(self, monkeypatch) -> None:
        self.records = dict(RECORDS)
        self.asked: list[str] = []
        monkeypatch.setattr(study, "read_dataset", lambda name: name)
        monkeypatch.setattr(study, "generated", self.generated)
        monkeypatch.setattr(study, "imaged", self.imaged)
        monkeypatch.setattr(study, "compose", self.compose)
        monkeypatch.setattr(bootstrap, "DRAWS", 20)

    def generated(self, name: str) -> Generated:
        """Return the dataset."""
        recipe = "families: {f: {overrides: [a=1]}}\nsplits: {train: 1, test: 1}\n"
        definition = Definition(name, 1, 3, "r", recipe, (), {}, "")
        return Generated(definition, self.records)

    def imaged(self, dataset: Generated, overrides, tell) -> Imaged:
        """Return the stored runs of the scenes."""
        self.asked = list(overrides)
        return Imaged(tuple(s for s in SHOTS if s.number in dataset.scenes), ())

    def compose(self, overrides):
        """Return a config with the two cameras and a third one."""
        return OmegaConf.create({"cameras": {"red": 1, "dark": 1, "third": 1}}, flags=STRICT)


@pytest.fixture
def world(monkeypatch, runs):
    """Return the dataset."""
    monkeypatch.setenv("ISETHDR_HOME", str(runs))
    return World(monkeypatch)


@pytest.fixture
def detector(tmp_path) -> str:
    """Return the path of a detector that finds red cells."""
    fields = {"input": {"size_px": [16, 12], "tone": "srgb"}, "select": {"least_score": 0.5}}
    return str(described(bright_cells(tmp_path / "d.onnx"), **fields))


def test_the_study_finds_the_cars_of_the_camera_that_shows_them(world, detector):
    rows = detector_scores("draws=1", detector=detector, dataset="cars", cameras="red,dark")
    assert world.asked == ["draws=1", "~sensor@cameras.third"]
    all_of = {(r["camera"], r["score"]): r for r in rows if r["table"] == r["class"] == "all"}
    for score in ("mAP", "mAP50", "AR"):
        assert all_of["red", score]["value"] == pytest.approx(1.0)
        assert all_of["dark", score]["value"] == 0.0
        assert all_of["dark - red", score]["high"] == pytest.approx(-1.0)
    assert all_of["red", "mAP"]["objects"] == 4 and all_of["red", "mAP"]["roads"] == 3
    distances = {r["row"]: r["objects"] for r in rows if r["table"] == "distance"}
    assert distances == {"15 to 30 m": 3, "30 to 60 m": 1}
    with (folder_of("cars") / study.OBJECTS).open() as file:
        stored = list(csv.DictReader(file))
    found = [(row["scene"], row["instance"], row["camera"], row["found"]) for row in stored]
    assert ("2", "2", "red", "1") in found and ("2", "2", "dark", "0") in found
    assert len(stored) == 8 and {row["illuminance_lx"] for row in stored} == {"2.0"}
    assert (folder_of("cars") / study.TABLE).exists()
    shown = study.of_everything(rows)
    assert 0 < len(shown) < len(rows) and "table" not in shown[0]


def test_roads_that_a_detector_was_trained_on_are_left_out(world, tmp_path, capsys):
    fields = {"input": {"size_px": [16, 12]}, "trained_roads": ["road-0", "road-7"]}
    path = str(described(bright_cells(tmp_path / "d.onnx"), **fields))
    rows = detector_scores(detector=path, dataset="cars", cameras="red")
    assert rows[0]["roads"] == 2 and math.isnan(rows[0]["low"])
    out = capsys.readouterr().out
    assert "left out: 1 scene on roads" in out
    assert "no interval from 2 roads; expected at least 3" in out
    fields["trained_roads"] = [f"road-{k}" for k in range(3)]
    path = str(described(bright_cells(tmp_path / "d.onnx"), **fields))
    more = "'cars' is left .* type for example isethdr dataset generate cars count=6"
    with pytest.raises(ConfigError, match=more):
        detector_scores(detector=path, dataset="cars", cameras="red")
    fields["trained_roads"] = ["road-0", "road-2"]  # the part `train`
    path = str(described(bright_cells(tmp_path / "d.onnx"), **fields))
    with pytest.raises(ConfigError, match="'cars' is left .* type for example part=test$"):
        detector_scores(detector=path, dataset="cars", cameras="red", part="train")


def test_each_camera_may_have_detectors_of_its_own(world, tmp_path, detector):
    """The detector of the second camera responds to green, so it finds none of the red cells."""
    fields = {"input": {"size_px": [16, 12], "tone": "srgb"}, "select": {"least_score": 0.5}}
    for camera, channel in (("red", 0), ("dark", 1)):
        (tmp_path / camera).mkdir()
        described(bright_cells(tmp_path / camera / "d.onnx", channel), **fields)
    path = f"{tmp_path}/{{camera}}/d.yaml"
    rows = detector_scores(
        detector=f"{path},{path}", dataset="cars", cameras="red,dark", part="train"
    )
    value = {r["camera"]: r["value"] for r in rows if r["table"] == r["class"] == "all"}
    assert value["red"] == pytest.approx(1.0) and value["dark"] == 0.0


@pytest.mark.parametrize(
    ("asked", "match"),
    [
        ({}, "a detector and a dataset are needed"),
        ({"cameras": "rde"}, "no camera 'rde'; did you mean 'red'"),
        ({"part": "tset"}, "no part 'tset'; did you mean 'test'"),
        ({"tell": 0.0}, "tell above 0"),
        ({"false_alarms": math.nan}, "false_alarms from 0 up"),
        ({"detector": "none.yaml"}, "the detector is none.yaml; expected a YAML file"),
    ],
)
def test_requests_that_make_no_sense_are_refused_before_the_work(world, detector, asked, match):
    known = {"detector": detector, "dataset": "cars"} if asked else {}
    with pytest.raises(ConfigError, match=match):
        detector_scores(**(known | asked))
    assert not world.asked


def test_a_dataset_without_objects_or_scenes_is_refused(world, detector):
    objects_of = world.records[0].objects
    world.records = {k: SceneRecord(k, "f", f"r-{k}", (), ("s",)) for k in range(2)}
    assert objects_of
    with pytest.raises(ConfigError, match="the 2 scenes show no car, truck"):
        detector_scores(detector=detector, dataset="cars")
    world.records = {}
    with pytest.raises(ConfigError, match="has no scene yet"):
        detector_scores(detector=detector, dataset="cars")
    assert not world.asked


def test_pictures_without_an_object_that_counts_are_refused(world, detector, monkeypatch):
    monkeypatch.setattr(objects, "LEAST_HEIGHT_PX", 100.0)
    with pytest.raises(ConfigError, match="no picture has an object that counts"):
        detector_scores(detector=detector, dataset="cars", cameras="red")


def test_roads_of_other_parts_are_not_reported_as_left_out(world, tmp_path, capsys):
    """The part `train` has the scenes 0 and 2, the part `test` has the scene 1."""
    fields = {"input": {"size_px": [16, 12]}, "trained_roads": ["road-0", "road-2"]}
    path = str(described(bright_cells(tmp_path / "d.onnx"), **fields))
    rows = detector_scores(detector=path, dataset="cars", cameras="red", part="test")
    assert rows[0]["roads"] == 1 and "left out" not in capsys.readouterr().out


def test_lamps_are_near_within_three_degrees_and_own_lamps_do_not_count():
    """A pixel spans 0.573 degrees, so a lamp 4 pixels from the car is near, and one 9 pixels away
    is not. The distance counts from the last pixel of the box to the pixel of the lamp.
    """
    for beside, near in ((4, True), (9, False)):
        picture = panel_picture([(1, 1)], 1.0, [1])
        lamp = 2 * DEEP - 1 + beside
        picture["xyz"][12, lamp] = 1e6
        lamps = np.array([[12, lamp]])
        angle = nearest_lamp_deg(picture, lamps, (DEEP, DEEP, 2 * DEEP, 2 * DEEP))
        pixel = math.degrees(math.atan(PITCH_UM * 1e-3 / FOCAL_MM))
        assert angle == pytest.approx(beside * pixel, rel=0.05)  # tangents for angles
        [one] = truth_objects(picture, {"sky": 1.0})
        assert one.lamp_near is near
    picture["xyz"][12, lamp] = 0.01
    picture["xyz"][12, DEEP] = 1e6
    [one] = truth_objects(picture, {"sky": 1.0})
    assert not one.lamp_near, "it is the car's own"
    assert (one.height_px, one.counted, one.illuminance_lx) == (DEEP, True, 2.0)


def test_a_run_without_a_map_of_objects_is_refused():
    picture = panel_picture([(1, 1)], 1.0, [1]).drop_vars("instance")
    with pytest.raises(CatalogError, match="object_contrast"):
        truth_objects(picture, {})


RECIPE = """
about: A panel over a road.
families:
  plain: {overrides: [scene=small_world, scene.fails=false, renderer=small]}
splits: {train: 1, test: 1}
"""


@pytest.mark.slow
def test_the_study_runs_on_a_dataset_of_a_tiny_world(
    offer, isethdr_home, tmp_path, monkeypatch, detector
):
    """The functions that the commands call make the dataset, the runs and the tables."""
    offer("scene", "small_world", SmallWorld)
    offer("renderer", "small", Small)
    monkeypatch.setattr(objects, "LEAST_HEIGHT_PX", 0.0)
    recipe = tmp_path / "small.yaml"
    recipe.write_text(RECIPE)
    generate(Request("tiny", count=3, seed=1, recipe=str(recipe)), lambda line: None)
    overrides = ("sensor=ideal", "lens=ideal", "~flare.dirt", "isp=linear", "draws=1")
    rows = detector_scores(*overrides, detector=detector, dataset="tiny")
    assert {row["camera"] for row in rows} == {"ideal"}
    assert {row["roads"] for row in rows} == {3}
    assert {row["class"] for row in rows} == {"all", "car"}
