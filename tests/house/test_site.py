"""The documentation as a site: every page is in its menu, and nothing is loaded from a network."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys

import pytest
import yaml

from .source import ROOT

DOCS = ROOT / "docs"
SITE = yaml.safe_load((ROOT / "mkdocs.yml").read_text())


def pages_of(menu) -> list[str]:
    """Return the pages below a menu of mkdocs.yml."""
    if isinstance(menu, str):
        return [menu]
    parts = menu.values() if isinstance(menu, dict) else menu
    return [page for part in parts for page in pages_of(part)]


def script(name: str):
    """Return the module of a file in scripts."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_page_is_in_the_menu_once():
    listed = pages_of(SITE["nav"])
    pages = [path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")]
    moved = ["about.md", "changelog.md", "contributing.md"]  # scripts/site_hooks.py
    assert sorted(listed) == sorted([*pages, *moved]), "see nav in mkdocs.yml"


def test_every_page_is_listed_for_readers_of_the_source():
    index = (DOCS / "README.md").read_text()
    pages = {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")} - {"README.md"}
    assert pages <= set(re.findall(r"\]\(([^)#]+)", index)), "see docs/README.md"


def test_the_gallery_shows_commands_that_exist():
    from isethdr_workflows import STUDIES

    text = (DOCS / "gallery.md").read_text()
    sections = text.split("\n## ")[1:]
    assert len(sections) > 8
    for section in sections:
        assert "](images/" in section, section[:40]
        commands = re.findall(r"^    ((?:isethdr|python) .*)$", section, re.MULTILINE)
        assert commands, section[:40]
        for command in commands:
            study = re.match(r"isethdr study (\w+)", command)
            assert study is None or study[1] in STUDIES, command


def test_what_a_page_loads_is_found(tmp_path):
    (tmp_path / "index.html").write_text(
        '<script src="https://a.example/x.js"></script><img src="images/own.png">'
        '<link rel="stylesheet" href="//b.example/y.css"><link rel="canonical" href="http://c.d">'
        '<a href="https://hydra.cc">a link</a><p style="background: url(http://e.f/z.png)">'
    )
    (tmp_path / "own.css").write_text("@import 'http://g.h/i.css'; p { color: red }")
    found = script("check_site").loads(tmp_path)
    assert [line.split(": ")[1] for line in found] == [
        "https://a.example/x.js",
        "//b.example/y.css",
        "http://e.f/z.png",
        "http://g.h/i.css",
    ]
    assert script("check_site").main([str(tmp_path)]) == 1
    assert script("check_site").main([str(tmp_path / "none")]) == 2


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Return the folder of the site, built without a warning."""
    pytest.importorskip("material", reason="mkdocs-material is not installed; type make docs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    built = subprocess.run(
        command, cwd=ROOT, env=os.environ, capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    return folder


@pytest.fixture(scope="module")
def chromium():
    """Return the path of Chromium."""
    program = script("check_widths").chromium()
    if program is None:
        pytest.skip("Chromium is not installed; type for example apt-get install chromium")
    return program


@pytest.mark.slow
def test_the_site_loads_nothing_from_a_network(site):
    assert script("check_site").main([str(site)]) == 0
    example = (site / "examples" / "index.html").read_text()
    assert "04_night_and_day.yaml" in example and "hdr.build" in re.sub("<[^>]+>", "", example)
    assert (site / "about.html").is_file() and (site / "search/search_index.js").is_file()


@pytest.mark.slow
def test_no_page_is_wider_than_a_phone(site, chromium):
    assert script("check_widths").wider(site, chromium) == []


@pytest.mark.slow
def test_a_page_wider_than_a_phone_is_found(tmp_path, chromium):
    page = '<!doctype html><body style="margin: 0"><div style="width: {}px">text</div>'
    (tmp_path / "narrow.html").write_text(page.format(390))
    (tmp_path / "wide.html").write_text(page.format(391))
    assert script("check_widths").wider(tmp_path, chromium) == ["wide.html: 391 px"]
