"""Imports inside functions: few, because readers expect a module's imports at its top."""

from __future__ import annotations

import ast
import re

from .source import PRODUCT, name_of, text_of, tree

# upper limit; the rest are libraries that take long to import (Mitsuba, Matplotlib, parts of SciPy,
# DuckDB), modules that `isethdr --help` does without, and modules that import each other
MOST = 150


def inside_functions(node: ast.AST, inside: bool = False) -> int:
    """Return the number of import statements below function definitions."""
    count = 0
    for child in ast.iter_child_nodes(node):
        count += inside and isinstance(child, ast.Import | ast.ImportFrom)
        function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        count += inside_functions(child, inside or function)
    return count


def test_most_imports_are_at_the_top():
    indented = re.compile(r"^[ \t]+(?:from|import) ", re.MULTILINE)
    files = [file for file in PRODUCT if indented.search(text_of(file))]
    found = {name_of(file): inside_functions(tree(file)) for file in files}
    most = sorted(found.items(), key=lambda item: -item[1])[:10]
    assert sum(found.values()) < MOST, f"{sum(found.values())} imports inside functions: {most}"


def test_the_count_sees_what_it_must():
    text = "import a\ndef f():\n    import b\n    if b:\n        from c import d\n"
    assert inside_functions(ast.parse(text)) == 2
