"""Catalogs: entities that a scenario names by catalog and entry."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

from ..roads.opendrive.elements import Node, opened
from .parameters import assigned, declared, put_values

KIND = "an OpenSCENARIO file (.xosc)"


def entry(scenario: Node, reference: Node) -> Node | None:
    """Return the entry that a CatalogReference names; if there is none, note it and return None.

    All files in the scenario's catalog locations are searched.
    """
    catalog = reference.text("catalogName")
    name = reference.text("entryName")
    for folder in scenario.all("CatalogLocations/*/Directory"):
        for file in sorted(path_in(scenario.file, folder.text("path")).glob("*.xosc")):
            found = _in_file(file, catalog, name)
            if found is not None:
                given = assigned(reference.element)
                put_values(found.element, declared(found.element, given) | given)
                return found
    scenario.notes.add("entities of catalogs that were not found are left out", f"{catalog} {name}")
    return None


def path_in(file: Path, text: str) -> Path:
    """Return a path that a file states: a path of Unix or Windows, or a URL of the scheme `file`.

    Parameters
    ----------
    file : file that states it; relative paths begin in its folder.
    text : the path as stated.
    """
    told = text
    if told.startswith("file:"):
        url = urlsplit(told)
        told = url2pathname(url.path if url.netloc in ("", "localhost") else url.netloc + url.path)
    path = file.parent / told
    return path if path.exists() else file.parent / told.replace("\\", "/")


def _in_file(file: Path, catalog: str, name: str) -> Node | None:
    top = opened(file, "OpenSCENARIO", KIND)
    for held in top.all("Catalog"):
        if held.text("name", "") != catalog:
            continue
        for item in held.element:
            if item.get("name") == name:
                return Node(item, file, f"catalog {catalog}, entry {name}", top.notes)
    return None
