"""Files, modules and names that pages, docstrings and comments mention exist."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

from .source import ALL, FROZEN, PACKAGES, PRODUCT, ROOT, name_of, tree

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
FILE = re.compile(r"`([\w./-]+\.(?:py|md|csv))`")
DOTTED = re.compile(rf"`((?:{'|'.join(PACKAGES)})(?:\.\w+)+)(?:\([^`]*\))?`")
# files that readers of the pages create, and files of results
MADE_BY_READERS = {
    "acme/__init__.py",
    "acme_scores.py",
    "accuracy.csv",
    "acme_mono/__init__.py",
    "acme_mono/sensor.py",
    "card.md",
    "card.yaml",
    "classical_grid.csv",
    "curves.csv",
    "darker_than/metric.py",
    "detection.csv",
    "detection_objects.csv",
    "detector_objects.csv",
    "detector_scores.csv",
    "held_out_scores.csv",
    "objects.csv",
    "scores.csv",
}


@cache
def known_files() -> frozenset[str]:
    """Return the ends of all file paths: name, folder/name, ..."""
    found = set()
    folders = ("benchmarks", "docs", "scripts", "tests")
    tops = (*PACKAGES.values(), *(ROOT / folder for folder in folders))
    for path in (path for top in tops for path in top.rglob("*") if path.is_file()):
        parts = name_of(path).split("/")
        found |= {"/".join(parts[k:]) for k in range(len(parts))}
    return frozenset(found | {path.name for path in ROOT.iterdir()})


@cache
def module_file(dotted: str) -> Path | None:
    """Return the file of a module of this project; None if there is none."""
    package, _, rest = dotted.partition(".")
    place = PACKAGES[package].joinpath(*rest.split(".")) if rest else PACKAGES[package]
    for path in (place.with_suffix(".py"), place / "__init__.py"):
        if path.is_file():
            return path
    return None


def names_in(file: Path) -> set[str]:
    """Return the names that a module binds at top level."""
    found = set()
    for node in tree(file).body:
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                found.add(name)
            case ast.ImportFrom(names=names) | ast.Import(names=names):
                found |= {alias.asname or alias.name for alias in names}
            case ast.Assign(targets=targets):
                found |= {t.id for t in targets if isinstance(t, ast.Name)}
            case ast.AnnAssign(target=ast.Name(id=name)):
                found.add(name)
    return found


def exists(dotted: str) -> bool:
    """Return whether a dotted name is a module of this project, or a name in a module of it."""
    parts = dotted.split(".")
    for count in range(len(parts), 0, -1):
        file = module_file(".".join(parts[:count]))
        if file is not None:
            rest = parts[count:]
            return not rest or rest[0] in names_in(file) or "__getattr__" in names_in(file)
    return False


def test_files_that_are_mentioned_exist():
    missing = [
        f"{name_of(file)}: {named}"
        for file in (*PAGES, *PRODUCT)
        for named in FILE.findall(file.read_text())
        if named not in known_files() | MADE_BY_READERS
    ]
    assert not missing


def test_dotted_names_that_are_mentioned_exist():
    texts = (*PAGES, *(file for file in ALL if FROZEN not in file.parents))
    missing = [
        f"{name_of(file)}: {dotted}"
        for file in texts
        for dotted in DOTTED.findall(file.read_text())
        if not exists(dotted)
    ]
    assert not missing
