"""docs/reference/public_names.md lists what plugins may import and subclass, as the code has it."""

from __future__ import annotations

import ast
import importlib
import re

import pytest

from isethdr_core.plugins.registry import components

from .source import ROOT

PAGE = (ROOT / "docs" / "reference" / "public_names.md").read_text()
ROW = re.compile(r"^\| `([\w.]+)` \| [^|]+ \| (`[^|]*`) \|$", re.MULTILINE)
STAYING = {module: " ".join(re.findall(r"`(\w+)`", names)) for module, names in ROW.findall(PAGE)}
EARLIER = re.findall(r"^\| `([\w.]+)\.(\w+)` \| `([\w.]+)\.(\w+)` \|$", PAGE, re.MULTILINE)
# modules of which the page lists a part: the rest is for the catalog and other bundled code
PARTLY = {"isethdr_core.store"}
PAGE_SAYS = "docs/reference/public_names.md is the list of what plugins may import"


def test_the_page_lists_all_that_a_public_module_offers():
    assert len(STAYING) > 25
    for module, listed in STAYING.items():
        offered = getattr(importlib.import_module(module), "__all__", None)
        if offered is not None and module not in PARTLY:
            assert set(listed.split()) == set(offered), f"{module}: {PAGE_SAYS}"


def test_the_page_lists_every_module_that_is_a_public_path():
    folders = (ROOT / "isethdr_core", ROOT / "isethdr_core" / "physics")
    public = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts)
        for folder in folders
        for file in folder.glob("*.py")
        if (ast.get_docstring(ast.parse(file.read_text())) or "").startswith("Public path of")
    }
    assert len(public) > 15 and public <= STAYING.keys(), PAGE_SAYS


def test_every_bundled_component_can_be_imported_from_its_package():
    """The page says so, for authors who subclass a component."""
    for component in components().values():
        package = component.package
        place = "isethdr_core.lighting" if package == "isethdr_core" else package
        assert f"`{place}`" in PAGE
        assert getattr(importlib.import_module(place), component.class_name) is component.cls


def imports_of(text: str) -> set[tuple[str, str]]:
    """Return (module, name) of every name that a text imports from `isethdr_core`, directly or as
    an attribute of the package.
    """
    pattern = re.compile(r"^ *from (isethdr_core[\w.]*) import (?:\(([^)]+)\)|(.+))$", re.MULTILINE)
    return {
        (module, name.split(" as ")[0].strip())
        for module, several, one in pattern.findall(text)
        for name in (several or one.partition("#")[0]).split(",")
        if name.strip()
    }


def test_documents_and_templates_import_what_the_page_lists():
    pages = ("how-to/plugins.md", "tutorials/sensor_plugin.md", "reference/contracts.md")
    files = [ROOT / "docs" / page for page in pages]
    files += (ROOT / "isethdr_core" / "cli" / "plugin_template").rglob("*.py.jinja")
    found = {file.name: imports_of(file.read_text()) for file in files}
    assert sum(map(len, found.values())) > 80
    missing = [
        f"{file}: {module} {name}"
        for file, imported in found.items()
        for module, name in imported
        if name not in STAYING.get(module, "").split() and f"{module}.{name}" not in STAYING
    ]
    assert not missing, PAGE_SAYS


@pytest.mark.parametrize(("module", "earlier", "place", "name"), EARLIER)
def test_earlier_names_are_accepted_with_a_warning(module, earlier, place, name):
    assert name in STAYING[place].split()
    with pytest.warns(DeprecationWarning, match=name):
        found = getattr(importlib.import_module(module), earlier)
    assert found is getattr(importlib.import_module(place), name)
