"""The project's own Python files, read and parsed once for all house rules."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = {
    path.name: path
    for path in (
        ROOT / "isethdr_core",
        *sorted(ROOT.glob("plugins/isethdr_*")),
        *sorted(ROOT.glob("catalog/isethdr_*")),
        *sorted(ROOT.glob("workflows/isethdr_*")),
    )
}
PLUGINS = {path.name for path in ROOT.glob("plugins/isethdr_*")}
PRODUCT = sorted(file for folder in PACKAGES.values() for file in folder.rglob("*.py"))
# plugins as other authors may have written them: the house rules do not hold there
FROZEN = ROOT / "tests" / "frozen_plugins"
ALL = sorted(
    {
        *PRODUCT,
        *(
            file
            for folder in ("tests", "benchmarks", "scripts")
            for file in (ROOT / folder).rglob("*.py")
            if FROZEN not in file.parents
        ),
    }
)


def name_of(file: Path) -> str:
    """Return a file's path below the project."""
    return file.relative_to(ROOT).as_posix()


@cache
def text_of(file: Path) -> str:
    """Return a file's text. Most rules can tell from it that a file cannot break them, which saves
    the seconds that parsing all files takes.
    """
    return file.read_text(encoding="utf-8")


@cache
def tree(file: Path) -> ast.Module:
    """Return a file's syntax tree."""
    return ast.parse(text_of(file), str(file))


def imports(file: Path, top_level_only: bool = False) -> set[str]:
    """Return the dotted names that a file imports. Relative imports are resolved; imports under
    TYPE_CHECKING are left out.
    """
    package = _dotted(file)
    found = set()
    for node in _nodes(tree(file), top_level_only):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = (
                package[: len(package) - node.level + (file.name == "__init__.py")]
                if node.level
                else []
            )
            module = ".".join([*base, *filter(None, [node.module])])
            found |= {f"{module}.{alias.name}" for alias in node.names}
    return found


def _dotted(file: Path) -> list[str]:
    """Return the parts of a module's dotted name; none for a file outside the packages."""
    for name, folder in PACKAGES.items():
        if folder in file.parents:
            parts = [name, *file.relative_to(folder).with_suffix("").parts]
            return parts[:-1] if parts[-1] == "__init__" else parts
    return []


def _nodes(node, top_level_only):
    """Yield all nodes below `node`, without blocks under TYPE_CHECKING."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
            continue
        if top_level_only and isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        yield child
        yield from _nodes(child, top_level_only)
