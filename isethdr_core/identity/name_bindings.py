"""Name bindings: what binds a name in a file, an import or something else.

Imports for type checkers alone (`if TYPE_CHECKING:`) do not run, so they bind nothing.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

# calls that import a module which only their arguments name
DYNAMIC = {"importlib.import_module", "__import__", "exec", "eval", "runpy.run_path"}
DYNAMIC |= {"importlib.util.spec_from_file_location", "runpy.run_module"}


class Spec(NamedTuple):
    """One import: `from <dots><module> import <name>`, or `import <module>` without a name."""

    level: int
    module: str
    name: str


@dataclass
class Scope:
    """The names that the body of a module, function or class binds."""

    kind: str  # module, function or class
    bound: set[str]  # names that anything but an import binds
    imported: dict[str, Spec]


def scope_of(kind: str, body: Iterable[ast.stmt], args: ast.arguments | None = None) -> Scope:
    """Return the names that a body binds, by imports and otherwise.

    Parameters
    ----------
    kind : module, function or class.
    body : statements of the body.
    args : parameters, where the body is that of a function.
    """
    bound: set[str] = set()
    imported: dict[str, Spec] = {}
    elsewhere: set[str] = set()  # declared global or nonlocal
    if args is not None:
        every = [*args.posonlyargs, *args.args, *args.kwonlyargs, args.vararg, args.kwarg]
        bound |= {a.arg for a in every if a}
    waiting: list[tuple[ast.AST, bool]] = [(s, False) for s in body]
    while waiting:
        node, in_comprehension = waiting.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            imported |= dict(bindings_of(node))
            continue
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            bound.add(node.name)
            waiting += [(d, in_comprehension) for d in node.decorator_list]
            continue
        if isinstance(node, ast.Lambda):
            continue
        if isinstance(node, ast.If) and is_for_type_checkers(node):
            waiting += [(s, in_comprehension) for s in node.orelse]
            continue
        if isinstance(node, ast.Global | ast.Nonlocal):
            elsewhere |= set(node.names)
        elif isinstance(node, ast.NamedExpr):
            bound.add(node.target.id)
            waiting.append((node.value, in_comprehension))
            continue
        elif isinstance(node, ast.Name):
            if isinstance(node.ctx, ast.Store | ast.Del) and not in_comprehension:
                bound.add(node.id)
            continue
        elif isinstance(node, ast.AnnAssign) and node.value is None and kind != "class":
            continue
        bound |= {
            name
            for key in ("name", "rest")  # names in `except ... as` and in patterns
            if isinstance(node, ast.ExceptHandler | ast.MatchAs | ast.MatchStar | ast.MatchMapping)
            and isinstance(name := getattr(node, key, None), str)
        }
        inside = in_comprehension or isinstance(node, ast.comprehension)
        waiting += [(child, inside) for child in ast.iter_child_nodes(node)]
    return Scope(kind, bound - elsewhere, imported)


def bindings_of(node: ast.Import | ast.ImportFrom) -> Iterator[tuple[str, Spec]]:
    """Yield each name that an import statement binds, and its import."""
    for alias in node.names:
        if isinstance(node, ast.ImportFrom):
            if node.module != "__future__" and alias.name != "*":
                spec = Spec(node.level, node.module or "", alias.name)
                yield alias.asname or alias.name, spec
        elif alias.asname:
            yield alias.asname, Spec(0, alias.name, "")
        else:
            yield alias.name.partition(".")[0], Spec(0, alias.name.partition(".")[0], "")


def import_statements(tree: ast.AST) -> list[ast.Import | ast.ImportFrom]:
    """Return all import statements except those for type checkers only."""
    statements: list[ast.Import | ast.ImportFrom] = []
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            statements.append(node)
        elif isinstance(node, ast.If) and is_for_type_checkers(node):
            waiting += node.orelse
        elif not isinstance(node, ast.expr):
            waiting += ast.iter_child_nodes(node)
    return statements


def specs_of(statements: Iterable[ast.Import | ast.ImportFrom]) -> list[Spec]:
    """Return every import of some import statements, `*` included."""
    specs: list[Spec] = []
    for node in statements:
        if isinstance(node, ast.ImportFrom) and node.module != "__future__":
            specs += [Spec(node.level, node.module or "", alias.name) for alias in node.names]
        elif isinstance(node, ast.Import):
            specs += [Spec(0, alias.name, "") for alias in node.names]
    return specs


def names_imported_anywhere(statements: Iterable[ast.Import | ast.ImportFrom]) -> dict[str, Spec]:
    """Return every name that any import of the file binds, with the first import that binds it."""
    bindings: dict[str, Spec] = {}
    for node in sorted(statements, key=lambda s: s.lineno, reverse=True):
        bindings |= dict(bindings_of(node))
    return bindings


def called_name(call: ast.Call, everywhere: dict[str, Spec]) -> str:
    """Return the dotted name of a called function if it is a builtin or imported.

    Parameters
    ----------
    call : the call.
    everywhere : {name: import}, as `names_imported_anywhere` returns them.
    """
    dotted_name = dotted(call.func)
    spec = imported_name(call.func, everywhere)
    if spec is None:
        return dotted_name
    attributes = dotted_name.partition(".")[2]
    return ".".join(filter(None, [spec.module, spec.name, attributes]))


def imported_name(expression: ast.expr, everywhere: dict[str, Spec]) -> Spec | None:
    """Return the import of the first name of a dotted expression, anywhere in the file.

    Parameters
    ----------
    expression : names and attributes, such as `a.b.c`.
    everywhere : {name: import}, as `names_imported_anywhere` returns them.
    """
    return everywhere.get(dotted(expression).partition(".")[0])


def imports_by_call(calls: Iterable[ast.Call], everywhere: dict[str, Spec]) -> Iterator[Spec]:
    """Yield the modules that are imported by a call with their name in plain text.

    Parameters
    ----------
    calls : all calls of the file.
    everywhere : {name: import}, as `names_imported_anywhere` returns them.
    """
    for call in calls:
        if called_name(call, everywhere) in DYNAMIC and call.args:
            first = call.args[0]
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                module = first.value.lstrip(".")
                yield Spec(len(first.value) - len(module), module, "")


def is_for_type_checkers(node: ast.If) -> bool:
    """Return whether a statement is `if TYPE_CHECKING:`, whose body never runs."""
    return dotted(node.test).rpartition(".")[2] == "TYPE_CHECKING"


def lazy_table(tree: ast.Module) -> dict[str, str]:
    """Return {name: module} of the tables of plain text that a module's `__getattr__` may read."""
    table: dict[str, str] = {}
    if not any(isinstance(s, ast.FunctionDef) and s.name == "__getattr__" for s in tree.body):
        return table
    for statement in tree.body:
        value = getattr(statement, "value", None)
        if isinstance(value, ast.Dict):
            for key, entry in zip(value.keys, value.values):
                if (
                    isinstance(key, ast.Constant)
                    and isinstance(entry, ast.Constant)
                    and isinstance(key.value, str)
                    and isinstance(entry.value, str)
                ):
                    table[key.value] = entry.value
    return table


def dotted(node: ast.AST) -> str:
    """Return `a.b.c` for a name with attributes; empty for any other expression."""
    names: list[str] = []
    while isinstance(node, ast.Attribute):
        names.insert(0, node.attr)
        node = node.value
    return ".".join([node.id, *names]) if isinstance(node, ast.Name) else ""
