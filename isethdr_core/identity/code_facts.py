"""Code facts: the content of one Python file, without layout, messages and import paths.

The facts are a digest of the file's normal form (`normal_form`), the imported names that it uses,
the strings that may name data files, and the names that it re-exports. They depend on the
bytes of the file only, so they are cached by content (`code_cache`).

The normal form leaves out parts on which no result depends:

- positions, comments, docstrings, `pass`, `__all__`;
- import statements. Each use of an imported name is a reference to its target (`code_digest`), so
  neither module paths nor aliases nor the place of an import count;
- annotations of functions and variables. Annotations of class fields count, because they convert
  values; those of decorated functions count, because a decorator may read them;
- text of errors, warnings and log messages, and the labels of ledger rows: strings in positional
  arguments of a call to an exception class, in the arguments of `add_note`, `warnings.warn`,
  `print` and a logger, and in the label arguments of the ledger. A local variable that is used in
  such text only counts as text. Code decides by types and numbers, never by these texts.

All other strings count.
"""

from __future__ import annotations

import ast
import hashlib
from dataclasses import dataclass, field
from typing import Any

from .message_texts import message_texts
from .name_bindings import (
    Spec,
    import_statements,
    imports_by_call,
    is_for_type_checkers,
    lazy_table,
    names_imported_anywhere,
    specs_of,
)
from .normal_form import NormalForm, Reference, says_nothing

RULES = 4  # raised when the facts change: those of earlier versions are then not read


@dataclass
class Facts:
    """The facts about one file."""

    tree: str  # digest of the normal form, references and strings numbered
    references: list[Reference] = field(default_factory=list)
    strings: list[str] = field(default_factory=list)  # numbered; they may name a file or folder
    rare_strings: list[str] = field(default_factory=list)  # other strings that may name one
    suffixes: list[str] = field(default_factory=list)  # suffixes of files named by a pattern
    imports: list[Spec] = field(default_factory=list)  # all that run, so not for type checkers
    imported: dict[str, Spec] = field(default_factory=dict)  # names bound by imports at the top
    stars: list[Spec] = field(default_factory=list)
    defined: list[str] = field(default_factory=list)  # other names bound at the top
    lazy: dict[str, str] = field(default_factory=dict)  # {name: module} that `__getattr__` may read
    has_getattr: bool = False
    only_imports: bool = False  # only re-exports names
    has_effects: bool = False  # does more at import than bind names
    builds: list[str] = field(default_factory=list)  # `kind/name` of components that it builds
    dynamic: bool = False  # whether an import has a target that the text does not show

    @classmethod
    def from_record(cls, record: dict[str, Any]) -> Facts:
        """Return the facts of a record of `asdict` in which JSON replaced tuples by lists."""
        record = dict(record)
        record["references"] = [Reference(*r) for r in record["references"]]
        for name in ("imports", "stars"):
            record[name] = [Spec(*s) for s in record[name]]
        record["imported"] = {k: Spec(*s) for k, s in record["imported"].items()}
        return cls(**record)


def facts_of(source: bytes) -> Facts:
    """Return the facts of a file's bytes.

    A file that this version of Python cannot parse is identified by its bytes, and is assumed to
    import anything.
    """
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return Facts(digest_of(source), dynamic=True)
    return _facts_of_tree(tree)


def _facts_of_tree(tree: ast.Module) -> Facts:
    """Return the facts of a file by its syntax tree."""
    statements = import_statements(tree)
    everywhere = names_imported_anywhere(statements)
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    form = NormalForm(tree, everywhere, message_texts(tree, calls, everywhere))
    imports = specs_of(statements)
    top = form.top
    return Facts(
        tree=digest_of(form.text.encode()),
        references=list(form.references),
        strings=list(form.strings),
        rare_strings=sorted(form.rare_strings),
        suffixes=sorted(form.suffixes),
        imports=sorted({*imports, *imports_by_call(calls, everywhere)}),
        imported={k: s for k, s in top.imported.items() if k not in top.bound},
        stars=sorted(s for s in imports if s.name == "*"),
        defined=sorted(top.bound),
        lazy=lazy_table(tree),
        has_getattr="__getattr__" in top.bound,
        only_imports=not form.text,
        has_effects=any(_has_effect(s) for s in tree.body if not says_nothing(s)),
        builds=sorted(form.builds),
        dynamic=form.dynamic,
    )


def digest_of(content: bytes) -> str:
    """Return 16 hex digits that identify bytes."""
    return hashlib.blake2b(content, digest_size=8).hexdigest()


def _has_effect(node: ast.stmt) -> bool:
    """Return whether a statement at the top does more than bind names."""
    quiet = ast.Import | ast.ImportFrom | ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    if isinstance(node, quiet):
        return False
    if isinstance(node, ast.Assign):
        return not all(isinstance(t, ast.Name | ast.Tuple) for t in node.targets)
    if isinstance(node, ast.AnnAssign):
        return not isinstance(node.target, ast.Name)
    if isinstance(node, ast.If) and is_for_type_checkers(node):
        return any(map(_has_effect, node.orelse))
    if isinstance(node, ast.Try):
        handlers = [s for h in node.handlers for s in h.body]
        return any(map(_has_effect, [*node.body, *handlers, *node.orelse, *node.finalbody]))
    return not says_nothing(node)
