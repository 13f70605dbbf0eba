"""The pages of docs/reference that are made from docstrings, annotations and presets are current,
and every link between pages leads to a file.
"""

from __future__ import annotations

import importlib.util
import re
import sys

import pytest

from .source import ROOT, name_of

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


def script():
    """Return the module scripts/reference_pages.py."""
    path = ROOT / "scripts" / "reference_pages.py"
    spec = importlib.util.spec_from_file_location("reference_pages", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there for the module of a class
    spec.loader.exec_module(module)
    return module


def test_the_reference_pages_are_current():
    stale = [
        name_of(path)
        for path, text in script().pages().items()
        if not path.exists() or path.read_text() != text
    ]
    assert not stale, f"{stale} are not current; type python scripts/reference_pages.py"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_to_files(page):
    links = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text())
    missing = [link for link in links if "://" not in link and not (page.parent / link).exists()]
    assert not missing


MAY_BE_WIDE = ("|", "![")  # a row of a table and an image cannot be continued on the next line
GENERATED = ROOT / "docs" / "reference" / "components"  # as wide as in comments and presets


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_no_line_of_a_page_is_wider_than_100_columns(page):
    if page.parent == GENERATED:
        return
    lines = enumerate(page.read_text().splitlines(), 1)
    wide = [k for k, line in lines if len(line) > 100 and not line.startswith(MAY_BE_WIDE)]
    assert not wide, f"lines {wide} of {name_of(page)}"


def test_the_index_names_every_page():
    index = (ROOT / "docs" / "README.md").read_text()
    pages = [page.relative_to(ROOT / "docs").as_posix() for page in (ROOT / "docs").rglob("*.md")]
    missing = [page for page in pages if page != "README.md" and f"({page})" not in index]
    assert not missing, f"docs/README.md names none of {missing}"
