"""The base install contains the imported libraries; for every other library the error names its
extra.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib

import numpy as np
import pytest

from isethdr_core.errors import ConfigError
from isethdr_core.extras import needed

from .source import PRODUCT, ROOT, name_of, text_of, tree

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
IMPORT_NAMES = {"hydra_core": "hydra", "pillow": "PIL", "mitsuba": "mitsuba drjit"}
# libraries on which base dependencies (hydra, omegaconf, pydantic) are built, and whose objects
# they return or accept
TRANSITIVE = {"omegaconf", "yaml", "pydantic_core", "typing_extensions"}
# one plugin needs its renderer for everything; the registry reports a plugin that cannot be
# imported
WHOLE_PLUGINS = {"isethdr_mitsuba": "mitsuba"}
# an accelerator that replaces SciPy's transforms where it is installed
OPTIONAL = {"ducc0"}


def import_names(requirements: list[str]) -> set[str]:
    """Return the top-level modules of requirements such as `colour-science>=0.4`."""
    found = set()
    for requirement in requirements:
        name = re.split(r"[<>=\[;]", requirement)[0].replace("-", "_")
        found |= set(IMPORT_NAMES.get(name, name).split())
    return found


IMPORT = re.compile(r"^\s*(?:from|import) (\w+)", re.MULTILINE)


def imported(text: str) -> set[str]:
    """Return the top-level modules of all lines that look like imports.

    The formatter writes one import a line.
    """
    return set(IMPORT.findall(text))


def unguarded(module: ast.Module) -> set[str]:
    """Return the top-level modules of all imports outside TYPE_CHECKING and outside a block
    `with needed(...)`.
    """
    found = set()

    def visit(node):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            return
        if isinstance(node, ast.With) and ast.unparse(node.items[0]).startswith("needed("):
            return
        if isinstance(node, ast.Import):
            found.update(alias.name.split(".")[0] for alias in node.names)
        if isinstance(node, ast.ImportFrom) and not node.level:
            found.add(node.module.split(".")[0])
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(module)
    return found


def test_the_base_install_has_every_library_that_is_imported_without_more_ado():
    base = import_names(PROJECT["dependencies"]) | TRANSITIVE | OPTIONAL
    extras = PROJECT["optional-dependencies"]
    wrong = []
    for file in PRODUCT:
        package = next(part for part in file.parts[::-1] if part.startswith("isethdr_"))
        known = base | import_names(extras.get(WHOLE_PLUGINS.get(package), []))
        known |= set(sys.stdlib_module_names)
        others = {n for n in imported(text_of(file)) - known if not n.startswith("isethdr")}
        if others:
            found = sorted(others & unguarded(tree(file)))
            wrong += [f"{name_of(file)} imports {name}" for name in found]
    assert not wrong, "\n".join([*wrong, "put these below `with needed(...)` (isethdr_core)"])


def test_every_extra_that_an_error_names_exists():
    named = {
        keyword.value.value
        for file in PRODUCT
        if "needed(" in text_of(file)
        for node in ast.walk(tree(file))
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "needed"
        for keyword in node.keywords
        if keyword.arg == "extra"
    }
    assert {"colour", "report", "catalog", "mitsuba"} <= named
    assert named <= set(PROJECT["optional-dependencies"])


def test_imports_are_found_and_told_apart():
    text = "import os\nfrom a.b import c\nwith needed('x', extra='y'):\n    import z\n"
    assert imported(text) == {"os", "a", "z"} and unguarded(ast.parse(text)) == {"os", "a"}


def test_an_import_that_is_not_there_names_the_extra_and_other_errors_pass():
    with pytest.raises(ConfigError, match=r"this needs no_such_thing, .* 'isethdr\[colour\]'"):
        with needed("this", extra="colour"):
            import no_such_thing  # noqa: F401
    with pytest.raises(ZeroDivisionError), needed("this", extra="colour"):
        raise ZeroDivisionError


def test_calls_say_what_to_install(monkeypatch, tmp_path):
    from isethdr_catalog.query import find

    import isethdr_core as hdr
    from isethdr_core.display import display_view

    for name in ("colour", "matplotlib", "duckdb"):
        monkeypatch.setitem(sys.modules, name, None)
    for call, extra in (
        (lambda: hdr.build("scene", "macbeth", width=12, height=8)(), "colour"),
        (lambda: display_view.display(np.ones((2, 2, 3)), 1.0, white_xyz=np.ones(3)), "colour"),
        (lambda: display_view.false_colour(np.ones((2, 2))), "report"),
        (lambda: find(tmp_path), "catalog"),
    ):
        with pytest.raises(ConfigError, match=rf"isethdr\[{extra}\]"):
            call()
