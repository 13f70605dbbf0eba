"""Public functions of three or more parameters document each of them, and no other name."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from .source import PRODUCT, name_of, text_of, tree

LEAST = 3  # the first sentence usually explains fewer parameters
# start of the header of a public function, in the layout of the formatter
HEADER = re.compile(r"^ *(?:async )?def (?:[a-zA-Z]\w*|__call__)\(", re.MULTILINE)
ANY_HEADER = re.compile(r"^ *(?:async )?def \w+\(", re.MULTILINE)
END_OF_HEADER = re.compile(r":[ ]*(?:\.\.\.)?[ ]*(?:#.*)?$", re.MULTILINE)
DOCSTRING = re.compile(r'\s*r?"""(.*?)"""', re.DOTALL)
ENTRY = re.compile(r"^( *)([\w*][\w*, ]*) : ", re.MULTILINE)  # its indentation and its names
# a section of a docstring ends with an empty line
PARAMETERS = re.compile(r"^ *Parameters\n *-{3,}\n(.*?)(?:\n\n|\Z)", re.MULTILINE | re.DOTALL)
QUOTED = re.compile(r"`(\w+)`")
# arguments and options of a command, whose docstring is its help text
TYPED = re.compile(r"\b([A-Z]{2,})\b|--([a-z]\w*)")
Function = ast.FunctionDef | ast.AsyncFunctionDef


SECTION = "    Parameters\n    ----------\n"  # start of the section in the texts of tests below


class Undocumented(NamedTuple):
    """A function and the parameters that its docstring leaves out."""

    file: Path
    function: str
    names: tuple[str, ...]

    def __str__(self):
        return f"{name_of(self.file)}: {self.function} leaves out {', '.join(self.names)}"


def separated(names: str) -> list[str]:
    """Return the names of an entry."""
    return [name.strip(" *") for name in names.split(",")]


def documented(text: str) -> set[str]:
    """Return the names that a docstring explains: in an entry, or quoted in a sentence."""
    entries = (name for _, names in ENTRY.findall(text) for name in separated(names))
    typed = (name for names in TYPED.findall(text) for name in names if "--" in text)
    return {*entries, *QUOTED.findall(text), *map(str.lower, typed)}


def parameters(function: Function) -> list[str]:
    """Return the parameters that a docstring has to explain.

    The help text of an option of a command explains it, where users see it.
    """
    own = function.args
    by_position = [*own.posonlyargs, *own.args]
    without_default: list[ast.expr | None] = [None] * (len(by_position) - len(own.defaults))
    given = [
        *zip(by_position, [*without_default, *own.defaults]),
        *zip(own.kwonlyargs, own.kw_defaults),
    ]
    names = [
        one.arg
        for one, default in given
        if not (explains_itself(default) or explains_itself(one.annotation))
    ]
    names += [one.arg for one in (own.vararg, own.kwarg) if one]
    return [name for name in names if name not in ("self", "cls")]


def explains_itself(node: ast.expr | None) -> bool:
    """Return whether a default or an annotation is an option of a command with a help text."""
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Tuple):  # Annotated[...]
        return any(map(explains_itself, node.slice.elts))
    return isinstance(node, ast.Call) and any(word.arg == "help" for word in node.keywords)


def left_out(function: Function) -> tuple[str, ...]:
    """Return the parameters that a function's docstring does not explain."""
    names = parameters(function)
    if len(names) < LEAST:
        return ()
    known = documented(ast.get_docstring(function) or "")
    return tuple(name for name in names if name not in known)


def may_leave_out(text: str) -> bool:
    """Return whether a function may leave a parameter out. Most files need no parsing for it."""
    for header in HEADER.finditer(text):
        end = END_OF_HEADER.search(text, header.end())
        own = text[header.start() : end.end() if end else None]
        if own.count(",") < LEAST - 1:
            continue
        docstring = DOCSTRING.match(text, end.end()) if end else None
        known = documented(docstring.group(1) if docstring else "")
        try:
            function = ast.parse(f"{own.lstrip()}\n    ...").body[0]
        except SyntaxError:  # the header ends elsewhere, or has no body
            return True
        names = parameters(function)
        if len(names) < LEAST or known.issuperset(names):
            continue
        if not (own.startswith(" ") and signature(function) in contracts()):
            return True
    return False


def functions(module: ast.Module) -> Iterator[tuple[str, Function, bool]]:
    """Yield the name of every public function, the function, and whether a class holds it."""

    def below(node, inside: str):
        for child in node.body:
            name = getattr(child, "name", "_")
            if name.startswith("_") and name != "__call__":
                continue
            if isinstance(child, Function):
                yield f"{inside}{name}", child, bool(inside)
            elif isinstance(child, ast.ClassDef):
                yield from below(child, f"{inside}{name}.")

    yield from below(module, "")


def signature(function: Function) -> tuple[str, ...]:
    return function.name, *parameters(function)


@cache
def contracts() -> set[tuple[str, ...]]:
    """Return the methods whose parameters a Protocol explains, for all classes that offer them."""
    return {
        signature(method)
        for file in PRODUCT
        if "Protocol" in text_of(file)
        for node in tree(file).body
        if isinstance(node, ast.ClassDef) and any("Protocol" in ast.dump(b) for b in node.bases)
        for method in node.body
        if isinstance(method, Function) and not left_out(method)
    }


def is_hook(function: Function) -> bool:
    """Return whether a function implements a hook, whose own documentation explains its names."""
    return any("hook" in ast.dump(decorator) for decorator in function.decorator_list)


def undocumented(file: Path) -> list[Undocumented]:
    return [
        Undocumented(file, name, names)
        for name, function, in_class in functions(tree(file))
        if (names := left_out(function))
        and not is_hook(function)
        and not (in_class and signature(function) in contracts())
    ]


def invented(text: str) -> list[str]:
    """Return the entries of sections Parameters whose name is not in the header of the function."""
    found = []
    for header in ANY_HEADER.finditer(text):
        end = END_OF_HEADER.search(text, header.end())
        docstring = DOCSTRING.match(text, end.end()) if end else None
        section = PARAMETERS.search(docstring.group(1)) if docstring else None
        if section:
            known = set(re.findall(r"\w+", text[header.start() : end.end()]))
            entries = ENTRY.findall(section.group(1))
            names = [
                name for at, names in entries if at == entries[0][0] for name in separated(names)
            ]
            found += [name for name in names if name not in known]
    return found


def test_no_entry_names_a_parameter_that_does_not_exist():
    found = {name_of(file): names for file in PRODUCT if (names := invented(text_of(file)))}
    assert not found, f"no parameter is called so: {found}"


def test_an_entry_without_its_parameter_is_found():
    entries = "    a, b : m.\n        of : more\n    *c : s.\n\n    Returns\n    d : m."
    text = f'def f(a, e):\n    """Add.\n\n{SECTION}{entries}\n    """\n'
    assert invented(text) == ["b", "c"]


def test_every_parameter_is_documented():
    found = [
        each for file in PRODUCT if may_leave_out(text_of(file)) for each in undocumented(file)
    ]
    assert not found, (
        "a section Parameters with one line for each, its meaning, shape and unit, is missing:\n"
        + "\n".join(map(str, found))
    )


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ('def f(a, b, c):\n    """Add a, b and c."""\n', ("a", "b", "c")),
        (f'def f(a, b, c):\n    """Add.\n\n{SECTION}    a, b : m.\n    """\n', ("c",)),
        (f'def f(a, *b, c=":"):\n    """Add `a`.\n\n{SECTION}    *b : m.\n    """\n', ("c",)),
        (
            "def f(\n    a: int,\n    b: int,\n    c: int,\n) -> int:\n    return a\n",
            ("a", "b", "c"),
        ),
        ("def f(a, b, c): ...\n", ("a", "b", "c")),
        (f'def f(a, b, c):\n    """Add.\n\n{SECTION}    a, b, c : m.\n    """\n', ()),
        ("def f(a, b):\n    return a\n", ()),
        ('def f(a, b=option(help="m"), c=option(help="m")):\n    """Add."""\n', ()),
    ],
)
def test_what_is_left_out_is_found_with_and_without_parsing(text, names):
    (function,) = ast.parse(text).body
    assert left_out(function) == names
    assert may_leave_out(text) == bool(names)


def test_private_functions_need_no_parameters():
    text = "class _A:\n    def f(self, a, b, c): ...\n\n\ndef _f(a, b, c): ...\n"
    assert not [name for name, _, _ in functions(ast.parse(text))]


def test_a_protocol_explains_the_parameters_of_its_methods():
    assert ("__call__", "picture", "truth", "labels") in contracts()
