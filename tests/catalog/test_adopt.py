"""Stores of format 1 open as before. Adopted stores are protected, and damaged stores are not
adopted.
"""

import json
import shutil
import sys
import tarfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from isethdr_catalog import adopt as adoption
from isethdr_catalog.adopt import adopt, adopt_store
from isethdr_catalog.commands import catalog
from isethdr_catalog.query import find
from isethdr_catalog.verify import verify, verify_store
from typer.testing import CliRunner

from isethdr_core.errors import CatalogError
from isethdr_core.storage import store
from isethdr_core.storage.manifest import read_manifest

SCENE = "scenes/0123456789abcdef-00000001.zarr"
RUN = "runs/fedcba9876543210.zarr"
GROUPS = {SCENE: [""], RUN: ["captures/bayer", "picture/bayer"]}
ROWS = 4
COLUMNS = 6


@pytest.fixture
def home(tmp_path):
    """Return a home folder with a scene and a run in format 1, which has no manifests."""
    with tarfile.open(Path(__file__).parent / "data" / "format_1.tar.xz") as archive:
        # Python before 3.11.4 has no extraction filters; this archive is a part of the tests
        filters = {"filter": "data"} if sys.version_info >= (3, 11, 4) else {}
        archive.extractall(tmp_path, **filters)
    return tmp_path


def content(home):
    """Return all values of both stores."""
    return {
        (path, group): store.open_store(home / path, group).load()
        for path, groups in GROUPS.items()
        for group in groups
    }


def test_stores_of_format_1_open_and_are_found(home):
    found = content(home)
    light = np.arange(2 * 2 * ROWS * COLUMNS, dtype="f4").reshape(2, 2, ROWS, COLUMNS) + 1
    assert np.array_equal(found[SCENE, ""].radiance.values, light)
    xyz = found[RUN, "picture/bayer"].xyz.values
    assert np.array_equal(xyz.ravel(), np.arange(3.0 * ROWS * COLUMNS))
    assert [row["id"] for row in find(home, kind="run", ssim__ge=0.5)] == [Path(RUN).stem]
    assert {r.state for r in verify(home)} == {
        "readable, but without a manifest: type isethdr catalog adopt"
    }


def test_adoption_changes_no_value_and_protects(home):
    before = content(home)
    assert [one.reason for one in adopt(home)] == ["", ""]
    assert adopt(home) == [], "a second time there is nothing to do"
    after = content(home)
    for key, ds in after.items():
        ds.attrs.pop("format", None)
        before[key].attrs.pop("format", None)
        xr.testing.assert_identical(ds, before[key])
    assert {r.state for r in verify(home)} == {"whole"}
    for path, file in ((SCENE, "instance/c/0/0"), (RUN, "captures/bayer/saturated/c/0/0/0")):
        (home / path / file).unlink()
        with pytest.raises(CatalogError, match=f"{home / path}.*{file} is missing"):
            store.read_attrs(home / path)
            store.open_store(home / path)


def test_an_adopted_store_has_the_manifest_of_a_new_one(home, tmp_path):
    """Adopt a store, and write its data again: both manifests list the same files.

    Only chunks of arrays with a single value are missing from the new store.
    """
    adopt_store(home / SCENE)
    old = read_manifest(home / SCENE)
    attrs = {
        k: v for k, v in store.read_attrs(home / SCENE).items() if k not in ("format", "complete")
    }
    data = store.open_store(home / SCENE).load().assign_attrs({})
    again = store.write_store(
        tmp_path / "again", Path(SCENE).stem, {"": data}, attrs, keepbits=None
    )
    new = read_manifest(again)
    assert all("/c/" not in key for key in new.files)
    # format 1 has a folder level for each axis of a chunk; the new format has one file name
    old_names = {key: key.replace("/c/", "/c.") for key in old.files}
    flat = {
        k.partition("/c.")[0] + "/c." + k.partition("/c.")[2].replace("/", ".") if "/c." in k else k
        for k in old_names.values()
    }
    missing = flat - set(new.files)
    assert set(new.files) <= flat
    assert all(np.unique(data[key.partition("/")[0]]).size == 1 for key in missing)


def damage_flip(path):
    file = path / "radiance/c/0/0/0/0"
    data = bytearray(file.read_bytes())
    data[40] ^= 1
    file.write_bytes(data)


def damage_incomplete(path):
    text = (path / "zarr.json").read_text()
    (path / "zarr.json").write_text(text.replace('"complete": true', '"complete": false'))


@pytest.mark.parametrize(
    "damage, reason",
    [
        (damage_flip, "radiance"),
        (damage_incomplete, "incomplete"),
        (
            lambda p: (p / "instance/c/0/0").unlink(),
            "instance/c/0/0 is missing: it was deleted, or never",
        ),
        (lambda p: (p / "radiance/c/1/0/0/0").unlink(), "radiance: NaN at index 1"),
        (lambda p: (p / "zarr.json").write_text("{"), "zarr.json cannot be read"),
        (lambda p: (p / "instance/zarr.json").write_text("{"), "instance"),
    ],
)
def test_what_cannot_be_trusted_is_not_adopted(home, monkeypatch, damage, reason):
    damage(home / SCENE)
    done = {one.path: one.reason for one in adopt(home)}
    assert reason in done[home / SCENE] and done[home / RUN] == ""
    assert read_manifest(home / SCENE) is None
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    called = CliRunner().invoke(catalog, ["adopt"])
    assert called.exit_code == 1 and "0 stores adopted, 1 not" in called.output
    assert f"not adopted: {home / SCENE}" in called.output


def test_an_interrupted_adoption_is_finished_and_damage_is_not_mistaken_for_one(home, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(adoption, "_replace_root", interrupt)
        with pytest.raises(KeyboardInterrupt):
            adopt_store(home / SCENE)
    with pytest.raises(CatalogError, match=r"zarr\.json .*catalog adopt` finishes"):
        store.read_attrs(home / SCENE)
    shutil.copytree(home / SCENE, home / "edited" / Path(SCENE).name)
    assert adopt_store(home / SCENE) and not verify_store(home / SCENE).problems
    root = home / "edited" / Path(SCENE).name / "zarr.json"
    text = json.loads(root.read_text())
    text["attributes"]["created"] = "yesterday"
    root.write_text(json.dumps(text))
    with pytest.raises(CatalogError, match="holds other bytes than the manifest says"):
        adopt_store(root.parent)
