"""Every file is described, listed in its package's table of contents, and free of paths of one
machine.
"""

from __future__ import annotations

import ast
import re
import subprocess

import pytest

from .source import ALL, PACKAGES, PRODUCT, ROOT, name_of, text_of, tree

PATHS = re.compile(r"(?<![\w.$}])/(?:" + "home/|work/|Users/|root/|tmp/" + r")[\w.-]+")
MAY_NAME_PATHS = {"tests/house/test_files.py": "holds the pattern"}


def test_no_line_is_wider_than_100_columns():
    wide = [
        f"{name_of(f)}:{number}"
        for f in ALL
        for number, line in enumerate(text_of(f).splitlines(), 1)
        if len(line) > 100
    ]
    assert not wide, "\n".join(wide)


def test_no_module_is_called_utils():
    assert not [name_of(f) for f in ALL if f.stem in ("utils", "util", "helpers", "common", "misc")]


def test_every_module_says_what_it_holds():
    opening = re.compile(r'(?:#[^\n]*\n|\s)*r?"""(.*?)"""', re.DOTALL)
    first = {}
    for file in ALL:
        text = text_of(file)
        if text.strip() and file.name != "conftest.py":
            docstring = opening.match(text)
            paragraph = docstring[1].strip().split("\n\n")[0] if docstring else ""
            first[name_of(file)] = " ".join(paragraph.split())
    assert not [name for name, line in first.items() if not line], "these have no docstring"
    assert not [name for name, line in first.items() if len(line) > 200], (
        "the first paragraph of these is too long"
    )


@pytest.mark.parametrize("folder", sorted({f.parent for f in PRODUCT}), ids=name_of)
def test_packages_open_with_a_table_of_contents(folder):
    init = folder / "__init__.py"
    if folder.name == "conf":
        return
    assert init.exists(), f"{name_of(folder)} has no __init__.py"
    text = ast.get_docstring(tree(init)) or ""
    modules = {f.stem for f in folder.glob("*.py")} | {
        f.parent.name for f in folder.glob("*/__init__.py")
    }
    missing = sorted(m for m in modules - {"__init__", "conf"} if not re.search(rf"\b{m}\b", text))
    assert not missing, f"the table of contents of {name_of(init)} leaves out {missing}"


def tracked():
    """Return the project's text files: those that git tracks or would track."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    kinds = {".py", ".md", ".yaml", ".yml", ".toml", ".txt", ".sh", ".html", ".js", ".css", ""}
    return [
        f
        for f in (ROOT / name for name in listed.stdout.splitlines())
        if f.is_file() and f.suffix in kinds
    ]


def test_no_file_names_a_path_of_one_machine():
    found = [
        f"{name_of(f)}:{number}: {line.strip()[:80]}"
        for f in tracked()
        if name_of(f) not in MAY_NAME_PATHS
        for number, line in enumerate(f.read_text(errors="ignore").splitlines(), 1)
        if PATHS.search(line)
    ]
    assert not found, "\n".join(found)


def test_the_pattern_for_paths_finds_them():
    assert PATHS.search("open('/" + "home/me/data')") and PATHS.search("see /" + "tmp/x.txt")
    assert (
        not PATHS.search("ISETHDR_HOME=/path")
        and not PATHS.search("runs/" + "tmp/x")
        and not PATHS.search("docs/" + "home/x")
    )


# makes pages of the project's documentation, and needs a checkout
NOT_SHIPPED = {"isethdr_measured"}


def test_every_package_is_shipped():
    text = (ROOT / "pyproject.toml").read_text()
    shipped = text.partition("[tool.hatch.build.targets.wheel]")[2].partition("\n[")[0]
    assert not [name for name in NOT_SHIPPED if name in shipped]
    for name, folder in PACKAGES.items():
        if name in NOT_SHIPPED:
            continue
        assert f'"{name_of(folder)}"' in text, (
            f"{name} is not in [tool.hatch.build.targets.wheel] of pyproject.toml"
        )
