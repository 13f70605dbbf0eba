"""The notebooks of docs/notebooks run from their first cell to their last, at a small size."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest
from isethdr_catalog.compare import Comparison
from isethdr_catalog.python_calls import Rows

from isethdr_core.runs.run import Result

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb"))
SMALL = {"WIDTH, HEIGHT = 160, 90": "WIDTH, HEIGHT = 64, 36"}


def cells(notebook: Path) -> list[str]:
    """Return the code of a notebook, cell by cell."""
    content = json.loads(notebook.read_text(encoding="utf-8"))
    assert content["nbformat"] == 4
    code = [cell for cell in content["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] for cell in code), "outputs are not kept"
    return ["".join(cell["source"]) for cell in code]


def executed(code: str, names: dict) -> object:
    """Execute a cell as a notebook does, and return the value of its last expression."""
    tree = ast.parse(code)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names) if last else None


def test_there_are_three_notebooks():
    assert [path.stem for path in NOTEBOOKS] == ["a_sweep", "first_picture", "my_sensor"]
    for path in NOTEBOOKS:
        assert all(old in "".join(cells(path)) for old in SMALL)


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, isethdr_home):
    names: dict = {}
    for code in cells(path):
        for old, new in SMALL.items():
            code = code.replace(old, new)
        value = executed(code, names)
        if isinstance(value, Result | Rows | Comparison):
            assert "<table>" in value._repr_html_()
