"""The public API: its list, its types, its second spelling, and the import paths that stay."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import isethdr
import isethdr_core

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "public_names.md").read_text()
ROW = re.compile(r"^\| `([\w.]+)` \| [^|]+ \| (`[^|]*`) \|$", re.MULTILINE)
# public names by module, as the page lists them for authors of plugins
STAYING = {module: " ".join(re.findall(r"`(\w+)`", names)) for module, names in ROW.findall(PAGE)}


@pytest.mark.parametrize("module", STAYING)
def test_import_paths_that_stay(module):
    found = importlib.import_module(module)
    missing = [name for name in STAYING[module].split() if not hasattr(found, name)]
    assert not missing, f"{module} no longer has {missing}: an outside plugin imports them"


def annotated_names() -> set[str]:
    """Return the names that `isethdr_core` imports or declares for type checkers only."""
    [block] = [
        node
        for node in ast.parse(Path(isethdr_core.__file__).read_text()).body
        if isinstance(node, ast.If)
    ]
    names = set()
    for node in block.body:
        if isinstance(node, ast.ImportFrom):
            assert all(alias.asname == alias.name for alias in node.names), ast.unparse(node)
            names |= {alias.name for alias in node.names}
        else:
            names.add(node.target.id)
    return names


def test_the_list_of_the_api_is_what_type_checkers_see_and_dir_lists():
    listed = set(isethdr_core.__all__)
    assert annotated_names() == listed == set(dir(isethdr_core))
    assert len(isethdr_core.__all__) == len(listed)


def test_every_public_name_is_of_the_module_that_type_checkers_are_told():
    for name in isethdr_core.__all__:
        assert getattr(isethdr_core, name) is not None
    with pytest.raises(AttributeError, match="'isethdr_core' has no attribute 'bild'"):
        _ = isethdr_core.bild


def test_the_version_is_that_of_the_installed_package():
    from importlib.metadata import version

    assert isethdr_core.__version__ == version("isethdr")


def test_isethdr_is_the_same_api():
    assert set(dir(isethdr)) - set(dir(isethdr_core)) == {
        "PictureDataset",
        "compare",
        "find",
        "show",
    }
    for name in isethdr_core.__all__:
        assert getattr(isethdr, name) is getattr(isethdr_core, name)
    with pytest.raises(AttributeError, match="'isethdr' has no attribute 'bild'"):
        _ = isethdr.bild
    assert not hasattr(isethdr, "__path__"), "a package would import every module a second time"


def strictly_checked() -> set[Path]:
    """Return the files that mypy checks by pyproject.toml."""
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["mypy"]["files"]
    places = [place for pattern in listed for place in ROOT.glob(pattern)]
    folders = [place for place in places if place.is_dir()]
    return {*places, *(file for folder in folders for file in folder.rglob("*.py"))}


def test_every_public_name_is_defined_where_types_are_checked():
    public = STAYING | {"isethdr_core": " ".join(isethdr_core.__all__)}
    offered = [
        getattr(importlib.import_module(module), name)
        for module, names in public.items()
        for name in names.split()
    ]
    objects = [o for o in offered if inspect.isclass(o) or inspect.isfunction(o)]
    files = {Path(inspect.getfile(o)) for o in objects}
    files |= {Path(o.__file__) for o in offered if inspect.ismodule(o)}
    own = {file for file in files if file.is_relative_to(ROOT / "isethdr_core")}
    assert len(own) > 30
    unchecked = sorted(str(file.relative_to(ROOT)) for file in own - strictly_checked())
    assert not unchecked


CHECK = """
import isethdr, isethdr_core, sys
from isethdr import Component, ledger
assert Component is isethdr_core.Component and ledger is isethdr_core.ledger
assert not {"numpy", "xarray"} & set(sys.modules)
assert isethdr.open_scene is isethdr_core.open_scene
print(isethdr.__file__, isethdr_core.__file__, sep="\\n")
"""


def imported_from(*folders: Path) -> list[Path]:
    """Return the files of both spellings, imported by a new process with these folders first."""
    code = f"import sys; sys.path[:0] = {list(map(str, folders))!r}\n{CHECK}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [Path(line) for line in done.stdout.splitlines()]


@pytest.mark.slow
def test_both_spellings_from_the_tree():
    assert imported_from(ROOT) == [ROOT / "isethdr.py", ROOT / "isethdr_core" / "__init__.py"]


def built(how: str, folder: Path) -> Path:
    """Return the wheel that hatchling builds from this tree; `how` is "wheel" or "editable"."""
    code = f"import hatchling.build as b; print(b.build_{how}({str(folder)!r}))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder / done.stdout.split()[-1]


@pytest.mark.slow
def test_the_wheel_ships_both_spellings_every_module_and_their_types(tmp_path):
    pytest.importorskip("hatchling")
    with zipfile.ZipFile(built("wheel", tmp_path)) as wheel:
        shipped = set(wheel.namelist())
        wheel.extractall(tmp_path / "site")
    assert imported_from(tmp_path / "site")[0] == tmp_path / "site" / "isethdr.py"
    packages = [ROOT / "isethdr_core", *ROOT.glob("[pcw]*/isethdr_*")]
    packages.remove(ROOT / "workflows" / "isethdr_measured")  # makes pages of docs/measured
    assert len(packages) == 9 and not any("isethdr_measured" in name for name in shipped)
    for package in packages:
        assert f"{package.name}/py.typed" in shipped
        for file in (*package.rglob("*.py"), *package.rglob("*.jinja")):
            assert file.relative_to(package.parent).as_posix() in shipped


@pytest.mark.slow
def test_an_editable_install_finds_both_spellings(tmp_path):
    pytest.importorskip("editables")
    with zipfile.ZipFile(built("editable", tmp_path)) as wheel:
        [path_file] = [name for name in wheel.namelist() if name.endswith(".pth")]
        folders = wheel.read(path_file).decode().split()
    assert imported_from(*map(Path, folders))[0] == ROOT / "isethdr.py"
