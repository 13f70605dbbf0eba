"""Message texts: the strings of a file that people read, and on which no result depends.

They are the text of errors, warnings and log messages, and the labels of ledger rows. A local
variable that is used in such text only counts as text.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterable, Iterator

from .name_bindings import Spec, dotted, imported_name

EXCEPTIONS = {
    name
    for name, value in vars(builtins).items()
    if isinstance(value, type) and issubclass(value, BaseException)
}
ERROR_NAME = re.compile(r"\w*(Error|Warning|Exception)")
LOG_CALLS = {"debug", "info", "warning", "error", "critical", "exception", "log"}
# labels of the ledger: positions and keywords that hold text for people
LABELS = {
    "error": ((3,), ("what", "label")),
    "left_out": ((0, 1), ("what", "why")),
    "ErrorNote": ((3,), ("what", "label")),
    "ErrorTerm": ((6,), ("label",)),
    "LeftOut": ((0, 1), ("what", "why")),
}
LABEL_SOURCES = ("ledger", "error_terms", "isethdr_core")  # the last part of a module's name


def message_texts(
    tree: ast.Module, calls: Iterable[ast.Call], everywhere: dict[str, Spec]
) -> set[int]:
    """Return the `id` of each expression of a file that is text for people.

    Parameters
    ----------
    tree : syntax tree of the file.
    calls : all calls of the file.
    everywhere : imports that bind a name anywhere in the file.
    """
    loggers = _loggers(tree)
    texts = {id(a) for call in calls for a in _text_arguments(call, loggers, everywhere)}
    for function in _outer_functions(tree) if texts else ():
        texts |= _text_variables(function, texts)
    return texts


def _text_arguments(
    call: ast.Call, loggers: set[str], everywhere: dict[str, Spec]
) -> Iterator[ast.expr]:
    """Yield the arguments of a call that are text for people."""
    dotted_name = dotted(call.func)
    last = dotted_name.rpartition(".")[2]
    if last in EXCEPTIONS or ERROR_NAME.fullmatch(last) or last == "add_note":
        yield from call.args
    elif dotted_name == "print" or _is_warning(call.func, everywhere):
        yield from call.args
    elif last in LOG_CALLS and dotted_name.partition(".")[0] in loggers:
        yield from call.args
    elif last in LABELS and _is_from_ledger(call.func, everywhere):
        positions, keywords = LABELS[last]
        yield from (a for i, a in enumerate(call.args) if i in positions)
        yield from (k.value for k in call.keywords if k.arg in keywords)


def _is_warning(function: ast.expr, everywhere: dict[str, Spec]) -> bool:
    """Return whether a called function is `warnings.warn`."""
    spec = imported_name(function, everywhere)
    if spec is None:
        return False
    name = dotted(function).partition(".")[2] or spec.name
    return (spec.module, name) == ("warnings", "warn")


def _is_from_ledger(function: ast.expr, everywhere: dict[str, Spec]) -> bool:
    """Return whether a called function is one of the ledger, by the import of its name."""
    spec = imported_name(function, everywhere)
    if spec is None:
        return False
    return any(source in LABEL_SOURCES for source in (spec.module.rpartition(".")[2], spec.name))


def _loggers(tree: ast.Module) -> set[str]:
    """Return `logging` and the names that `logging.getLogger` is assigned to at the top."""
    names = {"logging"}
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            if dotted(node.value.func).rpartition(".")[2] == "getLogger":
                names |= {dotted(t) for t in node.targets}
    return names


def _outer_functions(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Yield the functions that lie in no other function."""
    waiting: list[ast.stmt] = list(tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node
        else:
            waiting += [n for n in ast.iter_child_nodes(node) if isinstance(n, ast.stmt)]


def _text_variables(function: ast.AST, texts: set[int]) -> set[int]:
    """Return the values of local variables that are read inside texts for people only."""
    nodes = list(ast.walk(function))
    inside = {
        id(n)
        for node in nodes
        if id(node) in texts
        for n in ast.walk(node)
        if isinstance(n, ast.Name)
    }
    if not inside:
        return set()
    values: dict[str, list[ast.expr]] = {}
    read: dict[str, list[bool]] = {}
    bound_otherwise: set[str] = set()
    single: set[int] = set()
    for node in nodes:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            if isinstance(node.targets[0], ast.Name):
                values.setdefault(node.targets[0].id, []).append(node.value)
                single.add(id(node.targets[0]))
        elif isinstance(node, ast.Global | ast.Nonlocal):
            bound_otherwise |= set(node.names)
        elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            bound_otherwise.add(node.target.id)
    for node in nodes:
        if isinstance(node, ast.Name):
            if isinstance(node.ctx, ast.Load):
                read.setdefault(node.id, []).append(id(node) in inside)
            elif id(node) not in single:
                bound_otherwise.add(node.id)
    return {
        id(value)
        for name, assigned in values.items()
        if name not in bound_otherwise and read.get(name) and all(read[name])
        for value in assigned
    }
