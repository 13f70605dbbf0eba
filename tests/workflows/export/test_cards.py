"""STAC and Croissant records have the required fields, and their own validators accept them."""

from __future__ import annotations

import csv
import hashlib
import json
import re

import pytest
from isethdr_workflows.export.cards.stac import _assets
from isethdr_workflows.export.exporting import exported
from isethdr_workflows.export.job import Written

from isethdr_core.results.stored import open_run

from .stored_runs import COLUMNS, LABELLED, ROWS

ALL = ["png,exr,dng,stac,croissant"]
WHY = "validators of records are in the extra test-cards; type make test-extras"


@pytest.fixture
def folder(home, tmp_path):
    """Return an export of two runs with both cards."""
    exported(["two"], tmp_path / "out", ALL, title="two nights", licence="CC-BY-4.0")
    return tmp_path / "out"


def links(content, rel):
    """Return the addresses of links of one relation."""
    return [link["href"] for link in content["links"] if link["rel"] == rel]


def test_a_stac_collection_has_the_required_fields(folder):
    """Required by STAC 1.1.0, collection and item specification, tables of fields."""
    place = folder / "stac"
    collection = json.loads((place / "collection.json").read_text())
    required = {"type", "stac_version", "id", "description", "license", "extent", "links"}
    assert required <= collection.keys() and collection["type"] == "Collection"
    assert collection["license"] == "CC-BY-4.0" and collection["id"] == "two nights"
    [[start, end]] = collection["extent"]["temporal"]["interval"]
    items = links(collection, "item")
    assert len(items) == 2
    for href in items:
        path = place / href
        item = json.loads(path.read_text())
        required = {"type", "stac_version", "id", "geometry", "properties", "links", "assets"}
        assert required <= item.keys() and item["type"] == "Feature" and "bbox" not in item
        assert item["collection"] == collection["id"]
        assert start <= item["properties"]["datetime"] <= end
        assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", item["properties"]["datetime"])
        assert [(path.parent / up).resolve() for up in links(item, "collection")] == [
            place / "collection.json"
        ]
        captures = open_run(item["properties"]["isethdr:run"]).open("captures/bayer")
        names = {f"dng_{name}" for name in captures["capture"].values}
        assert item["assets"].keys() == {"png", "exr", "exr_reference", *names}
        assert all((path.parent / asset["href"]).is_file() for asset in item["assets"].values())
        assert (item["properties"]["width"], item["properties"]["height"]) == (COLUMNS, ROWS)


def test_files_of_several_pictures_have_assets_of_their_own():
    paths = {
        "animation": ["animation/bayer.png", "animation/rgbw.png"],
        "coco": ["coco.json"],
        "radiance": ["radiance/0123.exr"],
    }
    files = [Written(path, name, "") for name, of in paths.items() for path in of]
    assert {name: asset["href"] for name, asset in _assets(files, "../").items()} == {
        "animation_bayer": "../animation/bayer.png",
        "animation_rgbw": "../animation/rgbw.png",
        "coco": "../coco.json",
        "radiance_0123": "../radiance/0123.exr",
    }


def test_croissant_has_the_required_fields(folder):
    """Required by Croissant 1.0, tables of dataset-level information and resources."""
    data = json.loads((folder / "croissant.json").read_text())
    required = {"@context", "@type", "conformsTo", "name", "description", "license"}
    assert required | {"distribution", "recordSet", "datePublished", "version"} <= data.keys()
    assert data["conformsTo"] == "http://mlcommons.org/croissant/1.0"
    resources = {row["@id"]: row for row in data["distribution"]}
    table = resources["pictures.csv"]
    content = (folder / table["contentUrl"]).read_bytes()
    assert table["sha256"] == hashlib.sha256(content).hexdigest()
    for name, ending in (("png", "png"), ("exr", "exr"), ("dng", "dng"), ("stac-items", "json")):
        matched = resources[f"{name}-{ending}"]["includes"]
        assert list(folder.glob(matched)), matched
    rows = list(csv.DictReader((folder / "pictures.csv").read_text().splitlines()))
    assert {row["file"] for row in rows} == {
        f"png/{path.name}" for path in (folder / "png").iterdir()
    }
    assert {row["run"]: row["lighting"] for row in rows}[LABELLED] == "night"
    fields = {row["name"]: row for row in data["recordSet"][0]["field"]}
    assert list(fields) == list(rows[0])
    assert fields["width"]["dataType"] == "sc:Integer" and fields["run"]["dataType"] == "sc:Text"
    assert set(fields["width"]["source"]["extract"].values()) == {"width"}


@pytest.mark.slow
def test_pystac_accepts_the_collection(folder):
    pystac = pytest.importorskip("pystac", reason=WHY)
    pytest.importorskip("jsonschema", reason=WHY)
    collection = pystac.Collection.from_file(str(folder / "stac" / "collection.json"))
    collection.validate()
    assert collection.validate_all() == 2, "two items"


@pytest.mark.slow
def test_mlcroissant_reads_the_table(folder):
    mlcroissant = pytest.importorskip("mlcroissant", reason=WHY)
    data = mlcroissant.Dataset(str(folder / "croissant.json"))
    rows = list(data.records("pictures"))
    assert [row["pictures/width"] for row in rows] == [COLUMNS] * 2
    assert not data.metadata.ctx.issues.errors
