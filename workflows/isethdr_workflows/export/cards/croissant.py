"""Croissant 1.0 metadata, `croissant.json`, with a table of the pictures in the same folder.

The table is the record set `pictures`: one row for each picture, with its path and its properties.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from typing import Any

from ..job import Item, Job, sha256
from .properties import properties

SPECIFICATION = "http://mlcommons.org/croissant/1.0"
TABLE = "pictures.csv"
TYPES: dict[type, str] = {str: "sc:Text", int: "sc:Integer", float: "sc:Float", bool: "sc:Boolean"}
# terms that the Croissant specification defines, in the order of its JSON-LD context
TERMS = tuple(
    """
    citeAs column dataBiases dataCollection equivalentProperty extract field fileProperty fileObject
    fileSet format includes isLiveDataset jsonPath key md5 parentField path
    personalSensitiveInformation recordSet references regex repeated replace samplingRate separator
    source subField transform
    """.split()
)
CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "dct": "http://purl.org/dc/terms/",
    "sc": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    **{term: f"cr:{term}" for term in TERMS},
}


def check(job: Job) -> None:
    """Accept all pictures, because every picture can be described."""


def write(job: Job) -> None:
    """Write the table and the metadata."""
    rows = [table_row(item) for item in job.each()]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with job.new_file(TABLE, "text/csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)
    job.write_json("croissant.json", metadata(job, columns, rows), "application/ld+json")


def table_row(item: Item) -> dict[str, Any]:
    """Return the row of a picture. Its tags are joined by spaces."""
    height, width = item.size
    row = {"id": item.number, "file": item.png, "width": width, "height": height}
    found = row | properties(item)
    return found | {"tags": " ".join(found["tags"])}


def metadata(job: Job, columns: Iterable[str], rows: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the metadata of a folder, after all of its other files were written.

    Parameters
    ----------
    job : the export, with the list of files written so far.
    columns : names of the columns of the table of pictures.
    rows : rows of that table; a row may lack columns.
    """
    table = {
        "@type": "cr:FileObject",
        "@id": TABLE,
        "name": TABLE,
        "contentUrl": TABLE,
        "encodingFormat": "text/csv",
        "sha256": sha256(job.folder / TABLE),
    }
    values = list(rows)
    fields = [_field(name, [row[name] for row in values if name in row]) for name in columns]
    found = {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": SPECIFICATION,
        "name": job.title,
        "description": f"{len(job.items)} simulated camera pictures of isethdr",
        "datePublished": job.created,
        "version": "1.0.0",
        "distribution": [table, *_single_files(job), *_file_sets(job)],
        "recordSet": [
            {
                "@type": "cr:RecordSet",
                "@id": "pictures",
                "name": "pictures",
                "key": {"@id": "pictures/id"},
                "field": fields,
            }
        ],
    }
    return found | ({"license": job.licence} if job.licence else {})


def _field(name: str, values: list[Any]) -> dict[str, Any]:
    kinds = {type(value) for value in values}
    kind = kinds.pop() if len(kinds) == 1 else float if kinds <= {int, float} else str
    return {
        "@type": "cr:Field",
        "@id": f"pictures/{name}",
        "name": name,
        "dataType": TYPES.get(kind, "sc:Text"),
        "source": {"fileObject": {"@id": TABLE}, "extract": {"column": name}},
    }


def _single_files(job: Job) -> Iterable[dict[str, Any]]:
    """Yield the files at the top of the folder, such as labels."""
    for written in job.files:
        if "/" not in written.path and written.path != TABLE:
            yield {
                "@type": "cr:FileObject",
                "@id": written.path,
                "name": written.path,
                "contentUrl": written.path,
                "encodingFormat": written.media_type,
                "sha256": sha256(job.folder / written.path),
            }


def _file_sets(job: Job) -> Iterable[dict[str, Any]]:
    """Yield one set for the files of each folder; the manifest lists them one by one."""
    folders = {
        (w.path.rpartition("/")[0], w.path.rpartition(".")[2]): w.media_type
        for w in job.files
        if "/" in w.path
    }
    for (folder, ending), media_type in folders.items():
        name = f"{folder.replace('/', '-')}-{ending}"
        yield {
            "@type": "cr:FileSet",
            "@id": name,
            "name": name,
            "encodingFormat": media_type,
            "includes": f"{folder}/*.{ending}",
        }
