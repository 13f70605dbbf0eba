"""Results of earlier versions, named by digests of whole packages, are served while their code is
the same.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np
import pytest
from omegaconf import open_dict

from isethdr_core import compose, open_scene, run
from isethdr_core.conformance.renderer import world
from isethdr_core.identity import earlier_names
from isethdr_core.pipeline.chain import chain
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.runs import provenance
from isethdr_core.runs.radiance_cache import recipe_hash
from isethdr_core.runs.run import find_run, whole
from isethdr_core.storage import store

CHOSEN = ["scene=uniform", "lens=ideal", "lighting=ideal", "~versions", "~flare.dirt"]
CHOSEN += ["sensor=bayer", "sensor.rows=8", "sensor.columns=12", "isp=linear", "draws=1"]
OLD_CLASS = {"scene/world": "isethdr_scenes.old.World", "renderer/flat": "isethdr_mitsuba.old.Flat"}
OLD_BYTES = {  # digests of an earlier commit; those of modules of the core named radiance
    "isethdr_core": "00c0",
    "isethdr_core.scene": "00c1",
    "isethdr_core.quantities": "00c2",
    "isethdr_core.categories": "00c3",
    "isethdr_core.physics.photometry": "00c4",
    "isethdr_core.physics.radiometry": "00c5",
    "isethdr_scenes": "00d0",
    "isethdr_mitsuba": "00d1",
    "isethdr_optics": "00d2",
    "isethdr_sensors": "00d3",
    "isethdr_isp": "00d4",
    "isethdr_metrics": "00d5",
}


@dataclass(frozen=True)
class World:
    """A road, a lamp and a sky."""

    made: ClassVar[int] = 0
    size_m: float = 1.0
    detail: str = "fine"  # the earlier edition below does not have this field

    def __call__(self):
        """Return the description."""
        return world()


@dataclass(frozen=True)
class Flat:
    """A renderer of one level."""

    rendered: ClassVar[list] = []
    effort_fields: ClassVar[tuple] = ("samples",)
    samples: int = 4

    def __call__(self, description, demand):
        """Return 12 x 8 tiles of 1e-5 W m-2 sr-1 nm-1."""
        self.rendered.append(demand)
        groups = demand.groups or description.light_groups()
        bands = np.linspace(400, 700, 7)
        level = np.full((len(groups), 7, 8, 12), 1e-5)
        labels = np.zeros((8, 12), np.uint32)
        return scene_radiance(
            level, groups, bands, centres(12, 0.6), centres(8, 0.4), instance=labels
        )


@pytest.fixture
def config(offer):
    offer("scene", "world", World)
    offer("renderer", "flat", Flat)
    Flat.rendered.clear()
    dropped = "contrast detection ssim colour snr dynamic_range log_luminance".split()
    config = compose([*CHOSEN, *(f"~metric.{name}" for name in dropped)])
    with open_dict(config):
        config.scene = {"name": "world"}
        config.renderer = {"name": "flat"}
    return config


@pytest.fixture
def table(monkeypatch, tmp_path, config):
    """Yield the table of a commit that had the same code under other paths, and a function that
    writes the table.
    """
    parts = chain(config)
    known = {provenance.identity(c): c for c in parts.components()}
    codes = provenance.fingerprint(*known.values(), frame=True)
    edition = {
        "commit": "0ld",
        "version": "0.0.9",
        "packages": OLD_BYTES,
        "components": {
            name: {
                "class": OLD_CLASS.get(name, f"{type(c).__module__}.{type(c).__qualname__}"),
                "fields": [f for f in asdict(c) if f != "detail"],
                "code": codes[name],
            }
            for name, c in known.items()
        },
        "frame": codes["core"],
        "settings": {k: v for k, v in whole(config).items() if k not in earlier_names.COMPONENTS},
    }
    found = {"editions": [edition], "new_settings": {}, "unchanged": [], "not_claimed": []}
    path = tmp_path / "earlier_names.json"
    monkeypatch.setattr(earlier_names, "TABLE", path)

    def write():
        path.write_text(json.dumps(found))
        for kept in (earlier_names._table, earlier_names.editions):
            kept.cache_clear()

    write()
    yield found, write
    monkeypatch.undo()
    for kept in (earlier_names._table, earlier_names.editions):
        kept.cache_clear()


def old_hash(data) -> str:
    """Return the name that the earlier version gave to `data`, computed by a copy of its code."""
    text = json.dumps(store.jsonable(data), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def old_versions():
    return provenance.versions() | {"isethdr": "0.0.9"}


def old_recipe(**fields) -> str:
    core = {name: OLD_BYTES[name] for name in OLD_BYTES if name.startswith("isethdr_core.")}
    return old_hash(
        {
            "scene": {"class": "isethdr_scenes.old.World", "size_m": 1.0} | fields,
            "renderer": {"class": "isethdr_mitsuba.old.Flat"},
            "code": core | {n: OLD_BYTES[n] for n in ("isethdr_scenes", "isethdr_mitsuba")},
            "versions": old_versions(),
        }
    )


def old_run(config) -> str:
    return old_hash(
        {
            "config": whole(config),
            "code": {n: d for n, d in OLD_BYTES.items() if not n.startswith("isethdr_core.")},
            "versions": old_versions(),
            "inputs": {},
        }
    )


@pytest.fixture(scope="module")
def home_of_now(tmp_path_factory):
    """Return the home of a run that all tests read; the first test computes the run."""
    return tmp_path_factory.mktemp("now")


@pytest.fixture
def old_stores(config, table, isethdr_home, home_of_now, monkeypatch):
    """Write the radiance and the run of `config` as an earlier version did; return their names."""
    monkeypatch.setenv("ISETHDR_HOME", str(home_of_now))
    result = run(config)
    scene = open_scene(next((home_of_now / "scenes").glob("*.zarr")))
    monkeypatch.setenv("ISETHDR_HOME", str(isethdr_home))
    recipe = old_recipe()
    name = old_run(config)
    described = {"scene": {"class": OLD_CLASS["scene/world"], "size_m": 1.0}}
    described |= {"renderer": {"class": OLD_CLASS["renderer/flat"], "samples": 4}}
    del scene.attrs["content"]  # stores of the earlier version lack it
    attributes = {k: v for k, v in scene.attrs.items() if k not in ("format", "complete", "code")}
    old = attributes | described | {"recipe": recipe}
    store.write_store(isethdr_home / "scenes", f"{recipe}-01234567", {"": scene}, old, None)
    attributes = {k: v for k, v in result.attributes.items() if k not in ("format", "complete")}
    old = attributes | {"key": name, "code": {"isethdr_core": "00c0"}, "scene": described["scene"]}
    store.write_store(isethdr_home / "runs", name, {}, old)
    Flat.rendered.clear()
    return recipe, name


def test_stored_radiance_and_runs_of_before_are_served(config, old_stores):
    recipe, name = old_stores
    result = run(config)
    assert not result.computed and result.path.stem == name
    config.seed = 1
    other = run(config)
    assert other.computed and not Flat.rendered
    assert other.attributes["scene_ids"] == [f"{recipe}-01234567"]


def test_what_is_missing_of_radiance_of_before_is_rendered_beside_it(config, old_stores):
    with open_dict(config):
        config.renderer.samples = 8  # more than the stored radiance has
    result = run(config)
    assert Flat.rendered and result.attributes["scene_ids"][0].startswith(f"{old_stores[0]}-")


def test_nothing_of_before_has_the_new_name(config, table):
    first = run(config)
    assert first.computed and recipe_hash(chain(config)) != old_recipe()
    assert not run(config).computed and len(Flat.rendered) == 1


@pytest.mark.parametrize(
    "of",
    [
        pytest.param("scene/world", marks=pytest.mark.slow),
        "renderer/flat",
        "sensor/bayer",
        pytest.param("core", marks=pytest.mark.slow),
    ],
)
def test_what_was_made_by_other_code_is_not_served(config, old_stores, table, of):
    found, write = table
    edition = found["editions"][0]
    if of == "core":
        edition["frame"] = "another"
    else:
        edition["components"][of]["code"] = "another"
    write()
    result = run(config)
    assert result.computed and bool(Flat.rendered) == (of in ("scene/world", "renderer/flat"))


@pytest.mark.parametrize(
    ("tested", "served"), [({"size_m": ["number"], "detail": ['"fine"']}, True), ({}, False)]
)
def test_other_code_serves_where_the_table_says_that_results_are_the_same(
    config, old_stores, table, tested, served
):
    found, write = table
    world = found["editions"][0]["components"]["scene/world"]
    entry = {"of": "scene/world", "from": "another", "to": world["code"], "tested": tested}
    world["code"] = "another"
    found["unchanged"].append(entry)
    write()
    assert run(config).computed is not served
    entry["to"] = "changed again"
    write()
    assert find_run(config, chain(config)) is None or not served


def test_a_field_that_is_new_must_have_its_default(config, old_stores):
    with open_dict(config):
        config.scene.detail = "fine"
    assert not run(config).computed
    config.scene.detail = "coarse"
    assert run(config).computed and Flat.rendered


def test_a_setting_that_is_new_must_change_nothing(config, old_stores, table):
    with open_dict(config):
        config.new_setting = 3
    assert find_run(config, chain(config)) is None
    found, write = table
    found["new_settings"]["new_setting"] = 3
    write()
    assert find_run(config, chain(config)) is not None
    config.new_setting = 4
    assert find_run(config, chain(config)) is None


def test_a_record_of_before_is_known_by_its_class(config, table):
    scene = chain(config).scene
    assert earlier_names.same_class({"class": OLD_CLASS["scene/world"]}, scene)
    assert earlier_names.same_class({"component": "scene/world"}, scene)
    assert not earlier_names.same_class({"class": "isethdr_scenes.old.Other"}, scene)
    assert not earlier_names.same_class({"component": "scene/other"}, scene)


@pytest.mark.slow
def test_the_catalog_reads_both_records(config, old_stores, isethdr_home):
    from isethdr_catalog.query import find

    config.seed = 1
    run(config)
    found = find(isethdr_home, kind="run")
    assert len(found) == 2


def test_bytes_of_a_package_are_digested_as_before(tmp_path):
    (tmp_path / "conf").mkdir()
    for name, text in (("__init__.py", "A = 1\n"), ("t.csv", "1"), ("conf/p.yaml", "a: 1")):
        (tmp_path / name).write_text(text)
    want = hashlib.sha256(b"__init__.pyA = 1\nt.csv1").hexdigest()[:16]
    assert earlier_names.folder_digest([tmp_path]) == want
    first = hashlib.sha256(b"A = 1\n").hexdigest()[:16]
    assert earlier_names.file_digest(tmp_path / "__init__.py") == first


def test_the_table_names_every_component_of_its_commits_once():
    editions = earlier_names.editions()
    assert {e.commit for e in editions} == {"32bac9b", "841e2ee"}
    for edition in editions:
        assert len(edition.components) == 50 and len(edition.packages) == 12
        classes = {c["class"].partition(".")[0] for c in edition.components.values()}
        assert classes <= edition.packages.keys()
