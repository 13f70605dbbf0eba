"""The study of detection: bad input ends it before any work; its command studies a tiny dataset."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from isethdr_workflows.dataset.generate import Generated, Request, generate
from isethdr_workflows.dataset.record import Definition, SceneRecord, folder_of
from isethdr_workflows.detection import study, without
from isethdr_workflows.detection.exposing import even
from isethdr_workflows.detection.frame import Layout, SceneObjects, Thing
from isethdr_workflows.detection.imaging import camera_names, condition_of, overrides_of
from isethdr_workflows.detection.questions import QUESTIONS
from isethdr_workflows.detection.study import chosen, detection
from isethdr_workflows.detection.threads import COMPOSING, threads_of
from isethdr_workflows.study_command import run_study
from omegaconf import OmegaConf

from isethdr_core.conformance.renderer import world
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.plugins.registry import build
from isethdr_core.quantities import centres, scene_radiance

RECIPE = """
about: Persons before drawn clutter.
families:
  plain: {overrides: [scene=drawn_world, renderer=drawn, lighting=day]}
splits: {train: 1}
"""


def dataset(*objects) -> Generated:
    definition = Definition("mine", 0, 1, "r", "", (), {}, "")
    record = SceneRecord(0, "plain", "plain-1", (), stores=("a-b",), objects=objects)
    return Generated(definition, {0: record})


def test_a_dataset_without_objects_is_refused():
    tree = {"instance": 1, "name": "tree 1", "category": "tree"}
    for made in (dataset(), dataset(tree)):
        with pytest.raises(ConfigError, match="'mine' has no car, truck, person.*type for example"):
            chosen(made, QUESTIONS[""])
    car = {"instance": 1, "name": "car 1", "category": "car"}
    assert len(chosen(dataset(car), QUESTIONS[""])) == 1
    with pytest.raises(ConfigError, match="has no person in 1 scenes"):
        chosen(dataset(car), QUESTIONS["dark"])


def test_daylight_questions_leave_tunnels_out():
    car = {"instance": 1, "name": "car 1", "category": "car"}
    made = dataset(car)
    tunnels = {
        1: replace(made.scenes[0], number=1, overrides=("scene.road=tunnel",)),
        2: replace(made.scenes[0], number=2, overrides=("scene=tunnel", "lighting=tunnel")),
    }
    both = replace(made, scenes={**made.scenes, **tunnels})
    assert len(chosen(both, QUESTIONS[""])) == 3
    assert [one.number for one in chosen(both, QUESTIONS["filters"])] == [0]


def test_a_sun_before_the_camera_is_a_light_of_its_own():
    def light(lighting: str, **scene: object) -> str:
        config = {"scene": scene, "choices": {"lighting": lighting}}
        return condition_of(OmegaConf.create(config))

    assert light("ideal", sky="noon", hour={"sun_elevation_deg": 6.0}) == "low sun"
    assert light("ideal", sky="noon", hour={"sun_elevation_deg": 20.0}) == "ideal"
    assert light("ideal", sky="night_rural", hour={}) == "ideal"
    assert light("night_rural", sky="noon", hour={"sun_elevation_deg": 6.0}) == "night"
    assert light("day") == "day"


def test_a_dataset_without_scenes_is_refused():
    empty = Generated(dataset().definition, {})
    with pytest.raises(ConfigError, match="has no scene yet.*isethdr dataset generate mine"):
        chosen(empty, QUESTIONS[""])


def test_an_unknown_camera_is_named_before_any_work():
    with pytest.raises(ConfigError, match="no camera 'rgbx'.*rgbw.*type for example cameras="):
        overrides_of(camera_names("bayer,rgbx"))
    with pytest.raises(ConfigError, match="cameras is empty"):
        camera_names(" , ")
    assert overrides_of(camera_names("bayer:HCG,typical_rgbw")) == [
        "+sensor@cameras.typical_rgbw=typical_rgbw"
    ]


def test_mistakes_in_settings_are_named():
    with pytest.raises(ConfigError, match="dataset is empty.*type for example"):
        detection()
    with pytest.raises(CatalogError, match="no dataset 'nowhere'"):
        detection(dataset="nowhere")
    for settings in ({"false_alarms": 0.0}, {"order": 9}, {"windows": 1}):
        with pytest.raises(ConfigError, match="expected false alarms a picture above 0"):
            detection(dataset="nowhere", **settings)
    for override in ("seed=1", "draws=2", "device=B"):
        with pytest.raises(ConfigError, match=f"{override} has no effect.*type for example lens"):
            detection(override, dataset="nowhere")


def test_an_even_field_has_the_mean_light_of_the_scene():
    values = np.random.default_rng(0).uniform(0, 9, (3, 4, 2))
    dims = ("y", "x", "wavelength")
    light = xr.DataArray(values, {"y": [0.0, 1, 2]}, dims, attrs={"focal_length_mm": 6.0})
    flat = even(light)
    assert flat.dims == dims and flat.attrs == light.attrs
    assert flat.values == pytest.approx(np.broadcast_to(values.mean((0, 1)), (3, 4, 2)))


@dataclass(frozen=True)
class DrawnWorld:
    """A world that differs from others by its seed alone."""

    seed: int = 0

    def __call__(self):
        """Return the conformance kit's road, lamp and sky, and a person.

        The intensity of the lamp encodes the seed.
        """
        made = world(intensity_cd=1.0 + self.seed % 1000)
        person = replace(made.objects[0], name="person", category="person")
        return replace(made, objects=(*made.objects, person))


@dataclass(frozen=True)
class Drawn:
    """Give each tile a random level, seeded by the lamp's intensity, and draw a person."""

    def __call__(self, description, demand):
        """Return 60 x 36 tiles in 7 bands with all labels."""
        groups = description.light_groups()
        lamps = (part.lamp for model in description.models.values() for part in model.parts)
        seed = int(next(lamp.intensity_cd for lamp in lamps if lamp is not None))
        shape = (36, 60)
        level = np.exp(np.random.default_rng(seed).normal(0, 0.3, shape)) * 1e-4
        instance = np.zeros(shape, np.uint32)
        stands = any(one.category == "person" for one in description.objects)
        instance[12:24, 27:33] = int(stands)
        level[instance == 1] *= 3
        radiance = np.ones((len(groups), 7, 1, 1)) * level
        ds = scene_radiance(
            radiance,
            groups,
            np.linspace(400, 700, 7),
            centres(60, 0.6),
            centres(36, 0.36),
            instance=instance,
            category=instance.astype(np.uint16),
            depth=np.full(shape, 20.0, np.float32),
            distance=np.full(shape, 21.0, np.float32),
            normal=np.zeros((*shape, 3), np.float32),
        )
        person = {"instance": 1, "category": "person", "name": "person", "box": [27, 12, 6, 12]}
        lit = {"illuminance_lx": dict.fromkeys(groups, 10.0)}
        ds.attrs["objects"] = [person | lit | {"visible_fraction": 1.0, "distance_m": 40.0}]
        ds.attrs["noise"] = dict.fromkeys(groups, 0.01)
        return ds


def test_a_lens_that_is_not_thread_safe_is_called_by_one_thread_at_a_time(monkeypatch):
    """Bundled components may be called by several threads; others only if they declare it."""
    monkeypatch.setattr("os.cpu_count", lambda: 3)
    monkeypatch.setattr("os.sched_getaffinity", lambda _process: {0, 1, 2}, raising=False)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    kinds = ("lighting", "lens", "isp")
    bundled = {kind: build(kind, "ideal") for kind in kinds}
    rest = {"flares": {}, "cameras": {"ideal": build("sensor", "ideal")}, "metrics": {}}
    assert threads_of(SimpleNamespace(**bundled, **rest)) == 3
    assert threads_of(SimpleNamespace(**bundled | {"lens": object()}, **rest)) == 1
    drawn = SimpleNamespace(**bundled, **rest, scene=DrawnWorld(), renderer=Drawn())
    assert (threads_of(drawn), threads_of(drawn, rendering=True)) == (3, 1)


def test_views_without_people_are_composed_one_at_a_time(monkeypatch, isethdr_home):
    """Threads prepare several scenes at once, and Hydra has one global state."""
    locked = []

    def composed(_overrides):
        locked.append(COMPOSING.locked())
        raise ConfigError("no config")

    monkeypatch.setattr(without, "compose", composed)
    with pytest.raises(ConfigError, match="no config"):
        without.without_people(dataset().scenes[0])
    assert locked == [True] and not COMPOSING.locked()


def test_a_view_that_cannot_be_rendered_without_people_is_not_filled_from_the_ring(monkeypatch):
    monkeypatch.setattr(study, "rows_read", lambda _scene, _search: slice(None))
    monkeypatch.setattr(study, "limited", lambda scene, _asked: scene)
    monkeypatch.setattr(study, "examined", lambda _frame, _search, bare=None: bare)

    def seen(number):
        frame = SimpleNamespace(number=number)
        scene = SimpleNamespace(
            prepared=SimpleNamespace(condition="day"), scene_objects=lambda: frame
        )
        return SimpleNamespace(**vars(scene), frame=lambda _factor, _rows: frame)

    bare = {1: seen(1)}
    forms = [study._forms(seen(n), bare, QUESTIONS["removal"], 1.0, {"day": None}) for n in (0, 1)]
    assert [list(one) for one in forms] == [[""], ["", study.RENDERED]]

    def failing(_records, _settings, _transfer, bare=False):
        return [], [(0, "ValueError: no light")] if bare else []

    monkeypatch.setattr(study, "all_prepared", failing)
    monkeypatch.setattr(study, "_through", lambda *_: ([], {}, {}))
    found = study.studied([], camera_names("bayer"), [], QUESTIONS["removal"], study.Observer())
    assert found.failed == ((0, "rendered without people: ValueError: no light"),)


def test_a_class_that_only_a_later_camera_shows_has_places(monkeypatch):
    thing = Thing(1, "deer 1", "animal", 40.0, math.nan, False, (2, 2, 2, 2), 2.0)
    layout = Layout(np.zeros((8, 8), np.int32))
    scene = SceneObjects(number=0, road="r", condition="day", layout=layout, things=(thing,))
    of_camera = SimpleNamespace(
        prepared=SimpleNamespace(condition="day"), scene_objects=lambda: scene
    )
    given = []

    def observed(_known, _how, _row_of, places):
        given.append(places)
        return [], study.Check()

    monkeypatch.setattr(study, "view", lambda *_: of_camera)
    monkeypatch.setattr(study, "_forms", lambda *_: {"": None})
    monkeypatch.setattr(study, "observed", observed)
    ready = [SimpleNamespace(record=SimpleNamespace(number=0), light=None)]
    [name] = camera_names("rgbw:W")
    before = {"car": 7.0}
    study._through(name, study.Scenes(ready, [], 1), QUESTIONS[""], study.Observer(), before)
    assert set(given[0]) == {"car", "animal"} and given[0]["car"] == 7.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("question", "cameras"),
    [
        ("", "bayer,split_pixel,split_pixel:LPLG"),
        ("filters", ""),
        ("dark", "bayer,rgbw"),
        ("removal", "bayer"),
    ],
)
def test_a_tiny_dataset_goes_through(offer, tmp_path, monkeypatch, question, cameras):
    """The dataset has five roads. A person three times as bright as clutter of 30 % is found by
    daylight. Less light lowers the d' that noise alone allows.
    """
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "home"))
    offer("scene", "drawn_world", DrawnWorld)
    offer("renderer", "drawn", Drawn)
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text(RECIPE)
    generate(Request("tiny", count=5, seed=3, recipe=str(recipe)), lambda text: None)
    plain = ["lens=ideal", "~flare.dirt", "~versions"]
    settings = ["dataset=tiny", "order=1", f"question={question}", *plain]
    rows = run_study("detection", settings + ([f"cameras={cameras}"] if cameras else []))
    folder = folder_of("tiny")
    stem = f"detection_{question}" if question else "detection"
    for name in (f"{stem}.html", f"{stem}.md", f"{stem}.csv", f"{stem}_objects.csv"):
        assert (folder / name).stat().st_size > 100
    objects = list(csv.DictReader((folder / f"{stem}_objects.csv").open()))
    assert {row["kind"] for row in objects} == {"person"}
    if question == "removal":
        whole = [row for row in rows if row["table"] == "all"]
        assert [row["camera"] for row in whole] == ["bayer", "bayer, rendered without"]
        assert whole[0]["median_d"] == pytest.approx(whole[1]["median_d"], rel=0.5)
        return
    if not question:
        whole = [row for row in rows if row["table"] == "all"]
        assert [row["camera"] for row in whole] == cameras.split(",")
        assert all(row["objects"] == 5 and 0.5 < row["found"] <= 1 for row in whole)
        assert all(row["found"] <= row["noise_only"] for row in whole)
        assert [math.isnan(row["contrast_transfer"]) for row in whole] == [False, False, True]
        return
    assert {row["camera"] for row in rows} == {row["camera"] for row in objects}
    for camera in {row["camera"] for row in objects}:
        alone: dict[float, list[float]] = {}
        for row in objects:
            if row["camera"] == camera:
                alone.setdefault(float(row["level"]), []).append(float(row["noise_only"]))
        d = [np.mean(alone[level]) for level in sorted(alone)]
        assert d[0] < 0.5 * max(d) and np.all(np.diff(d[:4]) > 0)  # exposure is at its limit
