"""One assignment a line: `a, b = x, y` only where both must change at once, or fill array slots."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest

from .source import ALL, name_of, tree


def needless_pairs(module: ast.Module) -> Iterator[ast.Assign]:
    """Yield the paired assignments that two lines would say as well."""
    for node in ast.walk(module):
        match node:
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)):
                same = len(targets) == len(values)
                slots = all(isinstance(target, ast.Subscript) for target in targets)
                if same and not slots and not _exchange(targets, values):
                    yield node


def _exchange(targets: list[ast.expr], values: list[ast.expr]) -> bool:
    """Return whether a value reads what another one's target changes: a swap, or a step of a
    recursion.
    """
    changed = [ast.unparse(target) for target in targets]
    for k, value in enumerate(values):
        read = {ast.unparse(n) for n in ast.walk(value) if isinstance(n, ast.Name | ast.Attribute)}
        if read & {*changed[:k], *changed[k + 1 :]}:
            return True
    return False


def test_each_line_assigns_one_thing():
    found = [f"{name_of(file)}:{n.lineno}" for file in ALL for n in needless_pairs(tree(file))]
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
