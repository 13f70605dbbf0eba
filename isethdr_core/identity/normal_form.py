"""Normal form: a file's syntax tree as text, without layout, messages and import paths.

Each use of an imported name, and each string that may name a file, is written as a number. The
lists of references and strings hold them in the order of these numbers.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from typing import NamedTuple

from .name_bindings import (
    DYNAMIC,
    Scope,
    Spec,
    called_name,
    dotted,
    is_for_type_checkers,
    scope_of,
)

PATH_LIKE = re.compile(r"[\w.*-]+(/[\w.*-]+)*")  # strings that may name a file or a folder
# other strings that may do so, with spaces or signs: they count only if there is such a file
RARE_PATH = re.compile(r"[^\x00-\x1f\\:*?\"<>|]{1,200}")
SUFFIX = re.compile(r".*(\.[A-Za-z]\w*)", re.DOTALL)
# strings that stand for several names of files: the end of a name, a glob, or a template
PATTERN = re.compile(r"[._*-].*|.*[*?\[%{$].*", re.DOTALL)
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
# fields of a node on which no result depends
SKIPPED_FIELDS = {"ctx", "type_comment", "kind", "type_ignores", "returns", "simple"}
BUILD = re.compile(r"isethdr(_core(\.\w+)*)?\.build")  # builds a component by kind and name


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


class NormalForm:
    """The normal form of a file, and what it refers to.

    Parameters
    ----------
    tree : syntax tree of the file.
    everywhere : imports that bind a name anywhere in the file.
    texts : the `id` of each expression that is text for people.
    """

    def __init__(self, tree: ast.Module, everywhere: dict[str, Spec], texts: set[int]) -> None:
        self.references: dict[Reference, int] = {}  # numbered in the order of their first use
        self.strings: dict[str, int] = {}  # strings that may name a file or folder, numbered
        self.rare_strings: set[str] = set()  # other strings that may name one
        self.suffixes: set[str] = set()  # suffixes of files named by a pattern
        self.builds: set[str] = set()  # `kind/name` of components that it builds
        self.dynamic = False  # whether an import has a target that the text does not show
        self.top = scope_of("module", tree.body)
        self._everywhere = everywhere
        self._texts = texts
        self._text_depth = 0
        self._scopes = [self.top]
        self._out: list[str] = []
        self._statements(tree.body)
        self.text = "".join(self._out)

    def _statements(self, body: Iterable[ast.stmt]) -> None:
        for statement in body:
            self._statement(statement)

    def _statement(self, node: ast.stmt) -> None:
        if says_nothing(node) or isinstance(node, ast.Import | ast.ImportFrom):
            return
        if isinstance(node, ast.If) and is_for_type_checkers(node):
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
        is_plain = all(  # nothing reads the annotations of the function
            dotted(d.func if isinstance(d, ast.Call) else d).rpartition(".")[2] in PLAIN_DECORATORS
            for d in node.decorator_list
        )
        self._out.append(f"{type(node).__name__}({node.name!r};")
        self._write("decorators", of=node.decorator_list)
        self._arguments(node.args, annotated=not is_plain)
        if not is_plain and node.returns is not None:
            self._write("returns", of=node.returns)
        self._in_scope(scope_of("function", node.body, node.args), node.body)
        self._out.append(")")

    def _class(self, node: ast.ClassDef) -> None:
        self._out.append(f"ClassDef({node.name!r};")
        self._write("head", of=[*node.decorator_list, *node.bases, *node.keywords])
        self._in_scope(scope_of("class", node.body), node.body)
        self._out.append(")")

    def _in_scope(self, scope: Scope, body: Iterable[ast.stmt]) -> None:
        self._scopes.append(scope)
        self._statements(body)
        self._scopes.pop()

    def _arguments(self, args: ast.arguments, annotated: bool) -> None:
        """Write the parameters of a function, with their annotations if `annotated`."""
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
        """Write a node: its title, and its fields that are not empty."""
        self._out.append(title + "(")
        for name, value in fields.items():
            if value is not None and value != []:
                self._out.append(name + "=")
                self._value(value)
        self._out.append(")")

    def _value(self, value: object) -> None:
        """Write the value of a field: a node, a list of nodes, or plain data."""
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
            self._out.append(f"'{node.id}'" + self._import_beside(node.id))
        elif isinstance(node, ast.Lambda):
            self._lambda(node)
        elif isinstance(node, ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp):
            targets = {
                n.id
                for generator in node.generators
                for n in ast.walk(generator.target)
                if isinstance(n, ast.Name)
            }
            self._scopes.append(Scope("function", targets, {}))
            self._generic(node)
            self._scopes.pop()
        else:
            if isinstance(node, ast.Call):
                self._note_hidden_import(node)
            elif isinstance(node, ast.BinOp):
                self._note_sum(node)
            self._generic(node)
        self._text_depth -= is_text

    def _generic(self, node: ast.AST) -> None:
        """Write a node that needs no rule of its own."""
        fields = {name: getattr(node, name, None) for name in node._fields}
        self._write(
            type(node).__name__,
            **{f"{k}_": v for k, v in fields.items() if k not in SKIPPED_FIELDS},
        )

    def _lambda(self, node: ast.Lambda) -> None:
        self._out.append("Lambda(")
        self._arguments(node.args, annotated=False)
        self._scopes.append(scope_of("function", [], node.args))
        self._node(node.body)
        self._scopes.pop()
        self._out.append(")")

    def _constant(self, value: object) -> None:
        """Write a constant. A string that may name a file is a number in `strings`."""
        if isinstance(value, str):
            if self._text_depth:
                self._out.append("text")
                return
            if PATH_LIKE.fullmatch(value):
                self._out.append(f"¶{self.strings.setdefault(value, len(self.strings))};")
                self._note_pattern(value)
                return
            if RARE_PATH.fullmatch(value):
                self.rare_strings.add(value)
            self._note_pattern(value)
        self._out.append(f"{type(value).__name__} {value!r}")

    def _note_pattern(self, text: str) -> None:
        """Note the suffix of files that a string may name together with other parts of a name."""
        if PATTERN.fullmatch(text):
            self._note_suffix(text)

    def _note_suffix(self, text: str) -> None:
        if suffix := SUFFIX.fullmatch(text):
            self.suffixes.add(suffix[1])

    def _note_sum(self, node: ast.BinOp) -> None:
        """Note the suffix of files that a sum of strings may name, as in `name + "v2.csv"`.

        An end with a folder, as in `folder + "/glass.csv"`, names one file by itself.
        """
        end = node.right
        if not isinstance(node.op, ast.Add) or self._text_depth:
            return
        if isinstance(end, ast.Constant) and isinstance(end.value, str) and "/" not in end.value:
            self._note_suffix(end.value)

    def _joined(self, node: ast.JoinedStr) -> None:
        """Write an f-string, and note the suffix of files that it may name."""
        if self._text_depth:
            self._out.append("text")
            return
        last = node.values[-1] if node.values else None
        if isinstance(last, ast.Constant):
            self._note_suffix(str(last.value))
        self._generic(node)

    def _reference(self, node: ast.expr) -> str:
        """Return the number of the reference that a name with attributes makes; empty if no import
        binds the name.
        """
        attributes: list[str] = []
        while isinstance(node, ast.Attribute):
            attributes.insert(0, node.attr)
            node = node.value
        if not isinstance(node, ast.Name) or (spec := self._import_of(node.id)) is None:
            return ""
        reference = Reference(*spec, ".".join(attributes))
        return str(self.references.setdefault(reference, len(self.references)))

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

    def _import_beside(self, name: str) -> str:
        """Return the reference of a name that both an import and something else bind; else ""."""
        for depth, scope in enumerate(reversed(self._scopes)):
            if scope.kind == "class" and depth > 0:
                continue
            if name in scope.bound:
                if name not in scope.imported:
                    return ""
                reference = Reference(*scope.imported[name], "")
                return f"§{self.references.setdefault(reference, len(self.references))};"
        return ""

    def _note_hidden_import(self, call: ast.Call) -> None:
        """Note a component that a call builds by its name, and an import whose target is hidden."""
        name = called_name(call, self._everywhere)
        if BUILD.fullmatch(name):
            named = [a.value for a in call.args if isinstance(a, ast.Constant)]
            self.builds.add("/".join(map(str, named[:2])))
            self.dynamic |= len(named) < 2
        if name not in DYNAMIC:
            return
        first = call.args[0] if call.args else None
        if not (
            name in ("importlib.import_module", "__import__")
            and isinstance(first, ast.Constant)
            and isinstance(first.value, str)
        ):
            self.dynamic = True


def says_nothing(node: ast.stmt) -> bool:
    """Return whether a statement is a docstring, `pass`, or the list of public names."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant)
    if isinstance(node, ast.Assign):
        return [dotted(t) for t in node.targets] == ["__all__"]
    return isinstance(node, ast.Pass)
