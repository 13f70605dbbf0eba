"""One assignment a line: `a, b = x, y` only where both must change at once, or fill array slots."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest

from .source import ALL, name_of, tree

# several targets and the assigned values, in the layout of the formatter
SEVERAL = re.compile(r"^ *(?:[\w.\[\]]+(?:, [^=]+)|\)) = (.*)$", re.M)
BRACKETS = re.compile(r"\([^()]*\)|\[[^\[\]]*\]|\{[^{}]*\}")


def may_hold_pairs(text: str) -> bool:
    """Return whether a file may hold a paired assignment. Most hold none and need no parsing."""
    for values in SEVERAL.findall(text):
        while (shorter := BRACKETS.sub("", values)) != values:
            values = shorter
        if "," in values.partition("(")[0] or values == "(":
            return True
    return False


def needless_pairs(module: ast.Module) -> Iterator[ast.Assign]:
    """Yield the paired assignments that could as well be two lines."""
    for node in ast.walk(module):
        match node:
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)):
                same = len(targets) == len(values)
                slots = all(isinstance(target, ast.Subscript) for target in targets)
                if same and not slots and not _exchange(targets, values):
                    yield node


def _exchange(targets: list[ast.expr], values: list[ast.expr]) -> bool:
    """Return whether a value reads the target of another value, as in a swap or a step of a
    recursion.
    """
    changed = [ast.unparse(target) for target in targets]
    for k, value in enumerate(values):
        read = {ast.unparse(n) for n in ast.walk(value) if isinstance(n, ast.Name | ast.Attribute)}
        if read & {*changed[:k], *changed[k + 1 :]}:
            return True
    return False


def test_each_line_assigns_one_thing():
    files = [file for file in ALL if may_hold_pairs(file.read_text(encoding="utf-8"))]
    found = [f"{name_of(file)}:{n.lineno}" for file in files for n in needless_pairs(tree(file))]
    assert not found, f"write two lines: {found}"


@pytest.mark.parametrize(
    ("text", "needless"),
    [
        ("a, b = x, y", True),
        ("self.a, b = x, a", True),
        ("a, b = a + 1, b + 1", True),
        ("a, b = b, a", False),
        ("self.a, b = x, self.a", False),
        ("a, b = b, a + b", False),
        ("a[0], a[1] = x, y", False),
        ("a, b = pair", False),
    ],
)
def test_the_rule_sees_what_it_must(text, needless):
    assert bool(list(needless_pairs(ast.parse(text)))) == needless
    assert may_hold_pairs(text) or not needless
