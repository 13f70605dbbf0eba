"""A STAC 1.1.0 collection in `stac/`, with one item for each picture. The assets of an item are the
files of the picture.

Simulated scenes have no place on Earth, so their geometry is null. STAC demands an extent of the
collection, so it is the whole Earth. The time of an item is that of its run.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from urllib.parse import quote

from ..job import Item, Job, Written
from .properties import properties

VERSION = "1.1.0"
FOLDER = "stac"
COLLECTION = "collection.json"
OF_JSON = "application/json"
OF_ITEMS = "application/geo+json"
EARTH = [-180.0, -90.0, 180.0, 90.0]
ROLES = {"png": "overview", "exr": "data", "dng": "data", "panoptic": "labels"}


def check(job: Job) -> None:
    """Accept all pictures, because every picture can be described."""


def write(job: Job) -> None:
    """Write the collection and its items, which list the files that were written before."""
    files: dict[tuple[str, str], list[Written]] = {}
    for written in job.files:
        files.setdefault((written.run, written.camera), []).append(written)
    times = []
    links = []
    for item in job.each():
        times.append(utc(str(item.attributes["created"])))
        path = f"items/{item.name}.json"
        links.append(_link("item", f"./{quote(path)}", OF_ITEMS))
        content = stac_item(item, files.get((item.key, item.camera), []), job.title)
        job.write_json(f"{FOLDER}/{path}", content, OF_ITEMS)
    collection = {
        "type": "Collection",
        "stac_version": VERSION,
        "id": job.title,
        "title": job.title,
        "description": f"{len(job.items)} simulated camera pictures of isethdr",
        "license": "other" if "://" in job.licence else job.licence or "other",
        "extent": {
            "spatial": {"bbox": [EARTH]},
            "temporal": {"interval": [[min(times), max(times)]]},
        },
        "links": [_link("root", f"./{COLLECTION}", OF_JSON), *links],
    }
    if "://" in job.licence:
        collection["links"].append(_link("license", job.licence, "text/html"))
    shared = _assets(files.get(("", ""), []), "../")
    job.write_json(f"{FOLDER}/{COLLECTION}", collection | ({"assets": shared} if shared else {}))


def stac_item(item: Item, files: Iterable[Written], collection: str) -> dict[str, Any]:
    """Return the STAC item of a picture in a collection.

    Parameters
    ----------
    item : the picture.
    files : files of that picture, with paths below the folder of the export.
    collection : name of the collection.
    """
    height, width = item.size
    up = f"../{COLLECTION}"
    return {
        "type": "Feature",
        "stac_version": VERSION,
        "stac_extensions": [],
        "id": item.name,
        "geometry": None,
        "properties": {
            "datetime": utc(str(item.attributes["created"])),
            "width": width,
            "height": height,
            **{f"isethdr:{name}": value for name, value in properties(item).items()},
        },
        "links": [_link(rel, up, OF_JSON) for rel in ("root", "parent", "collection")],
        "collection": collection,
        "assets": _assets(files, "../../"),
    }


def _assets(files: Iterable[Written], up: str) -> dict[str, Any]:
    assets = {}
    for written in files:
        stem = written.path.rpartition("/")[2].rpartition(".")[0]
        part = stem.removeprefix(f"{written.run}_{written.camera}").strip("_")
        # a file that no single picture owns is in the folder of its format, or alone at the top
        told = part if written.run or "/" in written.path else ""
        name = f"{written.format}_{told}" if told else written.format
        assets[name] = {
            "href": up + quote(written.path),
            "type": written.media_type,
            "roles": [ROLES.get(written.format, "metadata")],
        }
    return assets


def _link(rel: str, href: str, media_type: str) -> dict[str, str]:
    return {"rel": rel, "href": href, "type": media_type}


def utc(created: str) -> str:
    """Return an ISO 8601 time in UTC in the form of STAC, with Z."""
    return created.replace("+00:00", "Z")
