"""Code facts: the content of one Python file, without layout, messages and import paths.

The facts are the normal form of the file (a digest of its syntax tree), the imported names that it
uses, the strings that may name data files, and the names that it re-exports. They depend on the
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
import builtins
import hashlib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

RULES = 2  # raised when the normal form changes: every digest then changes
PATH_LIKE = re.compile(r"[\w.*-]+(/[\w.*-]+)*")  # strings that may name a file or a folder
SUFFIX = re.compile(r".*(\.[A-Za-z]\w*)", re.DOTALL)
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
# decorators that never read the annotations of the function below them
PLAIN_DECORATORS = {
    "staticmethod",
    "classmethod",
    "property",
    "cached_property",
    "cache",
    "lru_cache",
    "contextmanager",
    "abstractmethod",
    "override",
    "hookimpl",
}
SKIPPED_FIELDS = {"ctx", "type_comment", "kind", "type_ignores", "returns", "simple"}
DYNAMIC = {"importlib.import_module", "__import__", "exec", "eval", "runpy.run_path"}
DYNAMIC |= {"importlib.util.spec_from_file_location", "runpy.run_module"}
BUILD = re.compile(r"isethdr(_core(\.\w+)*)?\.build")  # makes a component by kind and name


class Spec(NamedTuple):
    """One import: `from <dots><module> import <name>`, or `import <module>` without a name."""

    level: int
    module: str
    name: str


class Reference(NamedTuple):
    """A use of an imported name, with the attributes that are read from it."""

    level: int
    module: str
    name: str
    attributes: str  # joined by dots

    @property
    def spec(self) -> Spec:
        """The import that it uses."""
        return Spec(self.level, self.module, self.name)


@dataclass
class Facts:
    """The facts about one file."""

    tree: str  # digest of the normal form, references and strings numbered
    references: list[Reference] = field(default_factory=list)
    strings: list[str] = field(default_factory=list)  # numbered, of a file's or folder's form
    suffixes: list[str] = field(default_factory=list)  # of files that are named by a pattern
    imports: list[Spec] = field(default_factory=list)  # all that run; not for type checkers alone
    imported: dict[str, Spec] = field(default_factory=dict)  # names bound by imports at the top
    stars: list[Spec] = field(default_factory=list)
    defined: list[str] = field(default_factory=list)  # other names bound at the top
    lazy: dict[str, str] = field(default_factory=dict)  # name: module, of a table for `__getattr__`
    has_getattr: bool = False
    only_imports: bool = False  # only re-exports names
    has_effects: bool = False  # does more at import than bind names
    builds: list[str] = field(default_factory=list)  # `kind/name` of components that it builds
    dynamic: bool = False  # has an import whose target its text does not show

    @classmethod
    def from_record(cls, record: dict[str, Any]) -> Facts:
        """Return the facts that `asdict` was called on, after JSON made lists of its tuples."""
        record = dict(record)
        record["references"] = [Reference(*r) for r in record["references"]]
        for name in ("imports", "stars"):
            record[name] = [Spec(*s) for s in record[name]]
        record["imported"] = {k: Spec(*s) for k, s in record["imported"].items()}
        return cls(**record)


def facts_of(source: bytes) -> Facts:
    """Return the facts of a file's bytes.

    A file that is no Python of this version is named by its bytes, and may import anything.
    """
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return Facts(digest_of(source), dynamic=True)
    return _NormalForm(tree).facts()


def digest_of(content: bytes) -> str:
    """Return 16 hex digits that name bytes."""
    return hashlib.blake2b(content, digest_size=8).hexdigest()


@dataclass
class _Scope:
    kind: str  # module, function or class
    bound: set[str]
    imported: dict[str, Spec]


class _NormalForm:
    """Write a module's syntax tree as text, references and strings numbered as they come."""

    def __init__(self, tree: ast.Module) -> None:
        self._tree = tree
        self._out: list[str] = []
        self._references: dict[Reference, int] = {}
        self._strings: dict[str, int] = {}
        self._suffixes: set[str] = set()
        self._builds: set[str] = set()
        self._dynamic = False
        self._text_depth = 0
        top = _scope("module", tree.body)
        self._scopes = [top]
        self._imports = _import_statements(tree)
        self._everywhere = _everywhere(self._imports)
        self._calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
        self._texts: set[int] = set()
        self._find_texts()

    def facts(self) -> Facts:
        self._statements(self._tree.body)
        top = self._scopes[0]
        form = "".join(self._out)
        body = [s for s in self._tree.body if not _says_nothing(s)]
        return Facts(
            tree=digest_of(form.encode()),
            references=list(self._references),
            strings=list(self._strings),
            suffixes=sorted(self._suffixes),
            imports=sorted({*_imports(self._imports), *self._named_imports()}),
            imported={k: s for k, s in top.imported.items() if k not in top.bound},
            stars=sorted(s for s in _imports(self._imports) if s.name == "*"),
            defined=sorted(top.bound),
            lazy=_lazy_table(self._tree),
            has_getattr="__getattr__" in top.bound,
            only_imports=not form,
            has_effects=any(_has_effect(s) for s in body),
            builds=sorted(self._builds),
            dynamic=self._dynamic,
        )

    # texts for people

    def _find_texts(self) -> None:
        """Mark the arguments that are text for people, then the variables that go nowhere else."""
        loggers = _loggers(self._tree)
        for call in self._calls:
            self._texts.update(id(a) for a in self._text_arguments(call, loggers))
        for function in _outer_functions(self._tree) if self._texts else ():
            self._texts.update(_text_variables(function, self._texts))

    def _text_arguments(self, call: ast.Call, loggers: set[str]) -> Iterator[ast.expr]:
        dotted = _dotted(call.func)
        last = dotted.rpartition(".")[2]
        if last in EXCEPTIONS or ERROR_NAME.fullmatch(last) or last == "add_note":
            yield from call.args
        elif dotted == "print" or self._is_external(call.func, "warnings", "warn"):
            yield from call.args
        elif last in LOG_CALLS and dotted.partition(".")[0] in loggers:
            yield from call.args
        elif last in LABELS and self._from_ledger(call.func):
            positions, keywords = LABELS[last]
            yield from (a for i, a in enumerate(call.args) if i in positions)
            yield from (k.value for k in call.keywords if k.arg in keywords)

    def _imported_name(self, func: ast.expr) -> Spec | None:
        """Return the import of the first name of a dotted expression, anywhere in the file."""
        first = _dotted(func).partition(".")[0]
        return self._everywhere.get(first)

    def _is_external(self, func: ast.expr, module: str, name: str) -> bool:
        spec = self._imported_name(func)
        dotted = _dotted(func)
        if spec is None:
            return False
        return (spec.module, dotted.partition(".")[2] or spec.name) == (module, name)

    def _from_ledger(self, func: ast.expr) -> bool:
        spec = self._imported_name(func)
        if spec is None:
            return False
        sources = (spec.module.rpartition(".")[2], spec.name)
        return any(source in LABEL_SOURCES for source in sources)

    # the tree

    def _statements(self, body: Iterable[ast.stmt]) -> None:
        for statement in body:
            self._statement(statement)

    def _statement(self, node: ast.stmt) -> None:
        if _says_nothing(node) or isinstance(node, ast.Import | ast.ImportFrom):
            return
        if isinstance(node, ast.If) and _for_type_checkers(node):
            self._statements(node.orelse)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            self._function(node)
        elif isinstance(node, ast.ClassDef):
            self._class(node)
        elif isinstance(node, ast.AnnAssign) and self._scopes[-1].kind != "class":
            if node.value is not None:
                self._write("Assign", targets=[node.target], value=node.value)
        elif isinstance(node, ast.Assert):
            self._write("Assert", test=node.test)
        else:
            self._node(node)

    def _function(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        unparenthesised = all(
            _dotted(d.func if isinstance(d, ast.Call) else d).rpartition(".")[2] in PLAIN_DECORATORS
            for d in node.decorator_list
        )
        self._out.append(f"{type(node).__name__}({node.name!r};")
        self._write("decorators", of=node.decorator_list)
        self._arguments(node.args, annotated=not unparenthesised)
        if not unparenthesised and node.returns is not None:
            self._write("returns", of=node.returns)
        self._within(_scope("function", node.body, node.args), node.body)
        self._out.append(")")

    def _class(self, node: ast.ClassDef) -> None:
        self._out.append(f"ClassDef({node.name!r};")
        self._write("head", of=[*node.decorator_list, *node.bases, *node.keywords])
        self._within(_scope("class", node.body), node.body)
        self._out.append(")")

    def _within(self, scope: _Scope, body: Iterable[ast.stmt]) -> None:
        self._scopes.append(scope)
        self._statements(body)
        self._scopes.pop()

    def _arguments(self, args: ast.arguments, annotated: bool) -> None:
        groups = {"/": args.posonlyargs, "": args.args, "*": args.kwonlyargs}
        for mark, group in groups.items():
            self._out.append(mark + ",".join(a.arg for a in group) + ";")
        for mark, argument in (("*", args.vararg), ("**", args.kwarg)):
            self._out.append(f"{mark}{argument.arg};" if argument else "")
        if annotated:
            every = [*args.posonlyargs, *args.args, *args.kwonlyargs, args.vararg, args.kwarg]
            self._write("annotations", of=[a.annotation for a in every if a and a.annotation])
        for default in [*args.defaults, *args.kw_defaults]:
            self._out.append("=")
            if default is not None:
                self._value(default)

    def _write(self, title: str, **fields: object) -> None:
        self._out.append(title + "(")
        for name, value in fields.items():
            if value is not None and value != []:
                self._out.append(name + "=")
                self._value(value)
        self._out.append(")")

    def _value(self, value: object) -> None:
        if isinstance(value, ast.stmt):
            self._statement(value)
        elif isinstance(value, ast.AST):
            self._node(value)
        elif isinstance(value, list):
            self._out.append("[")
            for item in value:
                self._value(item)
                if not isinstance(item, ast.stmt):
                    self._out.append(",")
            self._out.append("]")
        else:
            self._out.append(repr(value))

    def _node(self, node: ast.AST) -> None:
        is_text = id(node) in self._texts
        self._text_depth += is_text
        if isinstance(node, ast.Constant):
            self._constant(node.value)
        elif isinstance(node, ast.JoinedStr):
            self._joined(node)
        elif isinstance(node, ast.Name | ast.Attribute) and (reference := self._reference(node)):
            self._out.append(f"§{reference};")
        elif isinstance(node, ast.Name):
            self._out.append(f"'{node.id}'" + self._both(node.id))
        elif isinstance(node, ast.Lambda):
            self._lambda(node)
        elif isinstance(node, ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp):
            targets = {
                n.id
                for generator in node.generators
                for n in ast.walk(generator.target)
                if isinstance(n, ast.Name)
            }
            self._scopes.append(_Scope("function", targets, {}))
            self._generic(node)
            self._scopes.pop()
        else:
            if isinstance(node, ast.Call):
                self._look_for_import(node)
            self._generic(node)
        self._text_depth -= is_text

    def _generic(self, node: ast.AST) -> None:
        fields = {name: getattr(node, name, None) for name in node._fields}
        self._write(
            type(node).__name__,
            **{f"{k}_": v for k, v in fields.items() if k not in SKIPPED_FIELDS},
        )

    def _lambda(self, node: ast.Lambda) -> None:
        self._out.append("Lambda(")
        self._arguments(node.args, annotated=False)
        self._scopes.append(_scope("function", [], node.args))
        self._node(node.body)
        self._scopes.pop()
        self._out.append(")")

    def _constant(self, value: object) -> None:
        if isinstance(value, str):
            if self._text_depth:
                self._out.append("text")
                return
            if PATH_LIKE.fullmatch(value):
                self._out.append(f"¶{self._strings.setdefault(value, len(self._strings))};")
                if value.startswith((".", "*")) and (suffix := SUFFIX.fullmatch(value)):
                    self._suffixes.add(suffix[1])
                return
        self._out.append(f"{type(value).__name__} {value!r}")

    def _joined(self, node: ast.JoinedStr) -> None:
        if self._text_depth:
            self._out.append("text")
            return
        last = node.values[-1] if node.values else None
        if isinstance(last, ast.Constant) and (suffix := SUFFIX.fullmatch(str(last.value))):
            self._suffixes.add(suffix[1])
        self._generic(node)

    # names

    def _reference(self, node: ast.expr) -> str:
        attributes: list[str] = []
        while isinstance(node, ast.Attribute):
            attributes.insert(0, node.attr)
            node = node.value
        if not isinstance(node, ast.Name) or (spec := self._import_of(node.id)) is None:
            return ""
        reference = Reference(*spec, ".".join(attributes))
        return str(self._references.setdefault(reference, len(self._references)))

    def _import_of(self, name: str) -> Spec | None:
        """Return the import that binds a name at the place of its use; None if something else binds
        it.
        """
        for depth, scope in enumerate(reversed(self._scopes)):
            if scope.kind == "class" and depth > 0:
                continue
            if name in scope.bound:
                return None
            if name in scope.imported:
                return scope.imported[name]
        return None

    def _both(self, name: str) -> str:
        """Return the reference of a name that an import binds beside something else."""
        for depth, scope in enumerate(reversed(self._scopes)):
            if scope.kind == "class" and depth > 0:
                continue
            if name in scope.bound:
                if name not in scope.imported:
                    return ""
                reference = Reference(*scope.imported[name], "")
                return f"§{self._references.setdefault(reference, len(self._references))};"
        return ""

    def _look_for_import(self, call: ast.Call) -> None:
        name = self._called(call)
        if BUILD.fullmatch(name):
            named = [a.value for a in call.args if isinstance(a, ast.Constant)]
            self._builds.add("/".join(map(str, named[:2])))
            self._dynamic |= len(named) < 2
        if name not in DYNAMIC:
            return
        first = call.args[0] if call.args else None
        if not (
            name in ("importlib.import_module", "__import__")
            and isinstance(first, ast.Constant)
            and isinstance(first.value, str)
        ):
            self._dynamic = True

    def _called(self, call: ast.Call) -> str:
        """Return the dotted name of a called function if it is a builtin or imported."""
        spec = self._imported_name(call.func)
        dotted = _dotted(call.func)
        if spec is None:
            return dotted
        attributes = dotted.partition(".")[2]
        return ".".join(filter(None, [spec.module, spec.name, attributes]))

    def _named_imports(self) -> Iterator[Spec]:
        """Yield the modules that are imported by a call with their name in plain text."""
        for node in self._calls:
            if self._called(node) in DYNAMIC and node.args:
                first = node.args[0]
                if isinstance(first, ast.Constant) and isinstance(first.value, str):
                    module = first.value.lstrip(".")
                    yield Spec(len(first.value) - len(module), module, "")


def _scope(kind: str, body: Iterable[ast.stmt], args: ast.arguments | None = None) -> _Scope:
    """Return the names that a body binds, by imports and otherwise."""
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
            imported |= dict(_bindings(node))
            continue
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            bound.add(node.name)
            waiting += [(d, in_comprehension) for d in node.decorator_list]
            continue
        if isinstance(node, ast.Lambda):
            continue
        if isinstance(node, ast.If) and _for_type_checkers(node):
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
            for key in ("name", "rest")  # of `except ... as` and of patterns
            if isinstance(node, ast.ExceptHandler | ast.MatchAs | ast.MatchStar | ast.MatchMapping)
            and isinstance(name := getattr(node, key, None), str)
        }
        inside = in_comprehension or isinstance(node, ast.comprehension)
        waiting += [(child, inside) for child in ast.iter_child_nodes(node)]
    return _Scope(kind, bound - elsewhere, {k: s for k, s in imported.items()})


def _bindings(node: ast.Import | ast.ImportFrom) -> Iterator[tuple[str, Spec]]:
    for alias in node.names:
        if isinstance(node, ast.ImportFrom):
            if node.module != "__future__" and alias.name != "*":
                spec = Spec(node.level, node.module or "", alias.name)
                yield alias.asname or alias.name, spec
        elif alias.asname:
            yield alias.asname, Spec(0, alias.name, "")
        else:
            yield alias.name.partition(".")[0], Spec(0, alias.name.partition(".")[0], "")


def _import_statements(tree: ast.AST) -> list[ast.Import | ast.ImportFrom]:
    """Return all import statements except those for type checkers only."""
    statements: list[ast.Import | ast.ImportFrom] = []
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            statements.append(node)
        elif isinstance(node, ast.If) and _for_type_checkers(node):
            waiting += node.orelse
        elif not isinstance(node, ast.expr):
            waiting += ast.iter_child_nodes(node)
    return statements


def _imports(statements: Iterable[ast.Import | ast.ImportFrom]) -> list[Spec]:
    specs = []
    for node in statements:
        if isinstance(node, ast.ImportFrom) and node.module != "__future__":
            specs += [Spec(node.level, node.module or "", alias.name) for alias in node.names]
        elif isinstance(node, ast.Import):
            specs += [Spec(0, alias.name, "") for alias in node.names]
    return specs


def _everywhere(statements: Iterable[ast.Import | ast.ImportFrom]) -> dict[str, Spec]:
    """Return every name that any import of the file binds; of several the first in the file."""
    bindings: dict[str, Spec] = {}
    for node in sorted(statements, key=lambda s: s.lineno, reverse=True):
        bindings |= dict(_bindings(node))
    return bindings


def _for_type_checkers(node: ast.If) -> bool:
    return _dotted(node.test).rpartition(".")[2] == "TYPE_CHECKING"


def _says_nothing(node: ast.stmt) -> bool:
    """Return whether a statement is a docstring, `pass`, or the list of public names."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant)
    if isinstance(node, ast.Assign):
        return [_dotted(t) for t in node.targets] == ["__all__"]
    return isinstance(node, ast.Pass)


def _has_effect(node: ast.stmt) -> bool:
    """Return whether a statement at the top does more than bind names."""
    quiet = ast.Import | ast.ImportFrom | ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    if isinstance(node, quiet):
        return False
    if isinstance(node, ast.Assign):
        return not all(isinstance(t, ast.Name | ast.Tuple) for t in node.targets)
    if isinstance(node, ast.AnnAssign):
        return not isinstance(node.target, ast.Name)
    if isinstance(node, ast.If) and _for_type_checkers(node):
        return any(map(_has_effect, node.orelse))
    if isinstance(node, ast.Try):
        handlers = [s for h in node.handlers for s in h.body]
        return any(map(_has_effect, [*node.body, *handlers, *node.orelse, *node.finalbody]))
    return not _says_nothing(node)


def _lazy_table(tree: ast.Module) -> dict[str, str]:
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


def _loggers(tree: ast.Module) -> set[str]:
    """Return `logging` and the names that `logging.getLogger` is assigned to at the top."""
    names = {"logging"}
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            if _dotted(node.value.func).rpartition(".")[2] == "getLogger":
                names |= {_dotted(t) for t in node.targets}
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


def _dotted(node: ast.AST) -> str:
    """Return `a.b.c` of names and attributes; empty where there is more to it."""
    names: list[str] = []
    while isinstance(node, ast.Attribute):
        names.insert(0, node.attr)
        node = node.value
    return ".".join([node.id, *names]) if isinstance(node, ast.Name) else ""
