"""Catalogs: entities that a scenario names by catalog and entry."""

from __future__ import annotations

from pathlib import Path

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
        for file in sorted((scenario.file.parent / folder.text("path")).glob("*.xosc")):
            found = _in_file(file, catalog, name)
            if found is not None:
                given = assigned(reference.element)
                put_values(found.element, declared(found.element, given) | given)
                return found
    scenario.notes.add("entities of catalogs that were not found are left out", f"{catalog} {name}")
    return None


def _in_file(file: Path, catalog: str, name: str) -> Node | None:
    top = opened(file, "OpenSCENARIO", KIND)
    for held in top.all("Catalog"):
        if held.text("name", "") != catalog:
            continue
        for item in held.element:
            if item.get("name") == name:
                return Node(item, file, f"catalog {catalog}, entry {name}", top.notes)
    return None
