"""Write the pages of docs/reference that follow from docstrings, annotations and presets.

    python scripts/reference_pages.py            # write the pages
    python scripts/reference_pages.py --check    # list the pages that are not current, exit code 1

Pages: `components/<kind>.md`, one for each kind, and `config.md`. A component's description is the
docstring of its class. The meaning of a field is the comment beside or above the field; unit,
default and range are those of its name and annotation. A preset's description is the comment in its
YAML file.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import io
import re
import sys
import textwrap
import tokenize
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from isethdr_core.plugins.component import KEYED, KINDS
from isethdr_core.plugins.ranges import field_types, on_command_line, range_text
from isethdr_core.plugins.registry import components

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "docs" / "reference"
CONFIGS = ("isethdr_core/config/conf", "plugins/*/conf", "workflows/*/conf")
MADE_BY = (
    "Made by `python scripts/reference_pages.py` from docstrings and annotations; do not edit."
)
COLUMNS = 100
# the end of a field's name, and its unit
UNITS = {
    "_um_per_mm": "um/mm",
    "_uv_per_e": "uV/e",
    "_lines_per_mm": "1/mm",
    "_per_mm2": "1/mm2",
    "_per_mm": "1/mm",
    "_per_m": "1/m",
    "_e_per_s": "e/s",
    "_cd_m2": "cd/m2",
    "_percent": "%",
    "_lux": "lx",
    "_nm": "nm",
    "_um": "um",
    "_uv": "uV",
    "_mm": "mm",
    "_m": "m",
    "_s": "s",
    "_e": "e",
    "_v": "V",
    "_dn": "DN",
    "_deg": "deg",
    "_c": "C",
    "_hz": "Hz",
}
SHARED_BY = 3  # a field of as many components with one row each moves to a table of its own


@dataclasses.dataclass(frozen=True)
class FieldRow:
    """One row of a table of fields."""

    name: str
    meaning: str
    unit: str
    default: str
    allowed: str

    def markdown(self) -> str:
        """Return the row as Markdown."""
        cells = (f"`{self.name}`", self.meaning, self.unit, self.default, self.allowed)
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def main(arguments: list[str]) -> int:
    """Write the pages, or with `--check` say which are not current."""
    stale = [
        path for path, text in pages().items() if not path.exists() or path.read_text() != text
    ]
    for path in stale:
        print(path.relative_to(ROOT))
        if "--check" not in arguments:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(pages()[path])
    return int("--check" in arguments and bool(stale))


@cache
def pages() -> dict[Path, str]:
    """Return the text of every page by its path."""
    found = {REFERENCE / "components" / f"{kind}.md": component_page(kind) for kind in KINDS}
    return found | {REFERENCE / "config.md": config_page()}


def component_page(kind: str) -> str:
    """Return the page of one kind: its components, their fields and their presets."""
    # a class may be offered under a second name
    names: dict[type, list[str]] = {}
    for (of, name), component in sorted(components().items()):
        if of == kind and component.package.startswith("isethdr_"):
            names.setdefault(component.cls, []).append(name)
    rows = {cls: field_rows(cls) for cls in names}
    counts = Counter(row for of_class in rows.values() for row in of_class)
    shared = [row for row, count in counts.items() if count >= SHARED_BY]
    parts = [f"# Components: {kind}", MADE_BY]
    parts.append(f"Choose one with `{choice(kind)}`, set a field with `{field_path(kind)}`.")
    if shared:
        text = "Fields that three or more components share, with the same default:"
        parts += ["## Shared fields", text, table(shared)]
    for cls, called in names.items():
        parts += [f"## `{called[0]}`", *paragraphs(cls)]
        if called[1:]:
            parts.append(f"Also offered as {', '.join(f'`{name}`' for name in called[1:])}.")
        own = [row for row in rows[cls] if row not in shared]
        common = ", ".join(f"`{row.name}`" for row in rows[cls] if row in shared)
        if own:
            parts.append(table(own))
        if common:
            parts.append(textwrap.fill(f"Shared fields: {common}.", COLUMNS))
        if not rows[cls]:
            parts.append("No fields.")
    parts += presets_of(kind)
    return "\n\n".join(parts) + "\n"


def choice(kind: str) -> str:
    """Return how a component of a kind is chosen on the command line."""
    return f"+{kind}@{kind}.<key>=<name>" if kind in KEYED else f"{kind}=<name>"


def field_path(kind: str) -> str:
    """Return how a field is set on the command line."""
    return f"{kind}.<key>.<field>=<value>" if kind in KEYED else f"{kind}.<field>=<value>"


def paragraphs(cls: type) -> list[str]:
    """Return the paragraphs of a class's docstring, up to its first numpydoc section."""
    text = re.split(r"\n\w+\n-{3,}\n", inspect.getdoc(cls) or "")[0]
    return [textwrap.fill(" ".join(part.split()), COLUMNS) for part in text.strip().split("\n\n")]


def table(rows: list[FieldRow]) -> str:
    """Return a Markdown table of fields."""
    head = ["| field | meaning | unit | default | allowed |", "|---|---|---|---|---|"]
    return "\n".join(head + [row.markdown() for row in rows])


def field_rows(cls: type) -> list[FieldRow]:
    """Return the rows of a component's fields.

    Raises
    ------
    ValueError : a field without a comment.
    """
    types, meanings = field_types(cls), field_comments(cls)
    rows = []
    for field in dataclasses.fields(cls):
        if not field.init:
            continue
        if not meanings.get(field.name):
            raise ValueError(
                f"{cls.__name__}.{field.name} has no comment; expected its meaning,"
                " beside the field or above it"
            )
        default = "required"
        if field.default_factory is not dataclasses.MISSING:
            default = f"`{on_command_line(field.default_factory())}`"
        elif field.default is not dataclasses.MISSING:
            default = f"`{on_command_line(field.default)}`"
        annotation = types[field.name]
        rows.append(
            FieldRow(
                field.name,
                meanings[field.name],
                unit_of(field.name, annotation),
                default,
                allowed(annotation),
            )
        )
    return rows


def unit_of(name: str, annotation: Any) -> str:
    """Return the unit that a field's name states; 1 for a number without, "" for anything else."""
    for end, unit in UNITS.items():
        if name.endswith(end):
            return unit
    return "1" if any(number in scalars(annotation) for number in (int, float)) else ""


def scalars(annotation: Any) -> set[Any]:
    """Return the plain types inside an annotation, keys of tables left out."""
    inner = get_args(annotation)
    if get_origin(annotation) is Literal:
        return set()
    if get_origin(annotation) is dict:
        inner = () if inner[1:] == (Any,) else inner[1:]
    if not inner:
        return {annotation}
    return set().union(*map(scalars, inner))


def allowed(annotation: Any) -> str:
    """Return the values that an annotation allows: names, a range, or the type in words."""
    names = literal_names(annotation)
    limits = range_text(annotation)
    plain = scalars(annotation)
    if annotation is bool:
        return "true, false"
    parts = [*([", ".join(f"`{name}`" for name in names)] if names else [])]
    if limits:
        parts.append(limits)
    if not limits and has_table(annotation):
        parts.append("a table")
    elif str in plain:
        parts.append("text")
    if type(None) in plain:
        parts.append("`null`")
    return ", or ".join(parts)


def has_table(annotation: Any) -> bool:
    """Return whether a field may hold a table."""
    return dict in (annotation, get_origin(annotation)) or any(
        has_table(part) for part in get_args(annotation)
    )


def literal_names(annotation: Any) -> list[str]:
    """Return the names that the `Literal`s inside an annotation allow."""
    if get_origin(annotation) is Literal:
        return [str(value) for value in get_args(annotation)]
    return [name for part in get_args(annotation) for name in literal_names(part)]


def field_comments(cls: type) -> dict[str, str]:
    """Return the comment of every field of a dataclass, by the class that defines the field last.

    A class that changes a default without a comment keeps the comment of its base.
    """
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        if dataclasses.is_dataclass(base):
            found |= {name: text for name, text in own_comments(base).items() if text}
    return found


@cache
def own_comments(cls: type) -> dict[str, str]:
    """Return the comments of the fields that one class defines.

    `# --- readings: A, B ---` opens a group of fields that hold one number for each of its names.
    """
    source = textwrap.dedent(inspect.getsource(cls))
    beside: dict[int, str] = {}
    above: dict[int, str] = {}
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            alone = token.line.strip().startswith("#")
            (above if alone else beside)[token.start[0]] = token.string.lstrip("# ")
    [definition] = ast.parse(source).body
    assert isinstance(definition, ast.ClassDef)
    found, group = {}, ""
    for node in definition.body:
        if not isinstance(node, ast.AnnAssign) or not isinstance(node.target, ast.Name):
            continue
        block: list[str] = []
        line = node.lineno - 1
        while line in above:
            if above[line].startswith("---"):
                group = above[line].strip("- ")
                break
            block.insert(0, above[line])
            line -= 1
        block += [beside[k] for k in range(node.lineno, (node.end_lineno or 0) + 1) if k in beside]
        text = " ".join(block)
        if text and ast.unparse(node.annotation).startswith("tuple") and ": " in group:
            text += f"; {group}"
        found[node.target.id] = text
    return found


def presets_of(kind: str) -> list[str]:
    """Return the section with the presets of a kind, [] where there are none."""
    files = sorted(file for folder in CONFIGS for file in ROOT.glob(f"{folder}/{kind}/*.yaml"))
    if not files:
        return []
    parts = ["## Presets", f"A preset is chosen like a component: `{choice(kind)}`."]
    for file in files:
        parts += [f"### `{file.stem}`", *preset_text(file)]
    return parts


def preset_text(file: Path) -> list[str]:
    """Return the description of a YAML file and its lines."""
    described: list[str] = []
    body: list[str] = []
    for line in file.read_text().splitlines():
        opening = not any(not done.startswith("defaults: [") for done in body)
        (described if opening and line.startswith("# ") else body).append(line)
    words = " ".join(line.lstrip("# ") for line in described)
    words = words.removeprefix("@package _global_").strip()
    description = [textwrap.fill(words, COLUMNS)] if words else []
    return [*description, "```yaml\n" + "\n".join(body).strip() + "\n```"]


def config_page() -> str:
    """Return the page of the main config: its defaults, its keys, and the experiments."""
    main_file = ROOT / "isethdr_core/config/conf/config.yaml"
    parts = ["# The main config", MADE_BY]
    parts.append(
        "`isethdr run` composes this file. Any line can be overridden on the command line:\n"
        "`isethdr run sensor=rgbw seed=3`. The fields of each component are in `components/`."
    )
    parts += preset_text(main_file)
    parts += ["## Experiments", "An experiment overrides several lines: `experiment=<name>`."]
    for file in sorted(ROOT.glob("workflows/*/conf/experiment/*.yaml")):
        parts += [f"### `{file.stem}`", *preset_text(file)]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
