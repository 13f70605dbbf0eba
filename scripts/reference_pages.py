"""Write the pages of docs/reference that follow from docstrings, annotations and presets.

    python scripts/reference_pages.py            # write the pages
    python scripts/reference_pages.py --check    # list the pages that are not current, exit code 1

Pages: `components/<kind>.md`, one for each kind, and `config.md`. A component's description is the
docstring of its class. The meaning of a field is the comment behind it or above it; unit, default
and range are those of its name and annotation. A preset's description is the comment in its YAML
file.
"""

from __future__ import annotations

import sys
import textwrap
from collections import Counter
from functools import cache
from pathlib import Path

from isethdr_core.plugins.component import KEYED, KINDS
from isethdr_core.plugins.field_docs import FieldRow, description, field_rows
from isethdr_core.plugins.presets import described_file
from isethdr_core.plugins.registry import components

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "docs" / "reference"
CONFIGS = ("isethdr_core/config/conf", "plugins/*/conf", "workflows/*/conf")
MADE_BY = (
    "Made by `python scripts/reference_pages.py` from docstrings and annotations; do not edit."
)
COLUMNS = 100
SHARED_BY = 3  # a field with the same row in this many components moves to a shared table


def main(arguments: list[str]) -> int:
    """Print the paths of pages that are not current; without `--check` also write them."""
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
    texts = {REFERENCE / "components" / f"{kind}.md": component_page(kind) for kind in KINDS}
    return texts | {REFERENCE / "config.md": config_page()}


def component_page(kind: str) -> str:
    """Return the page of one kind: its components, their fields and their presets."""
    # a class may be offered under a second name
    names: dict[type, list[str]] = {}
    for (of, name), component in sorted(components().items()):
        if of == kind and component.package.startswith("isethdr_"):
            names.setdefault(component.cls, []).append(name)
    rows = {cls: rows_of(cls) for cls in names}
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
    """Return the text that chooses a component of a kind on the command line."""
    return f"+{kind}@{kind}.<key>=<name>" if kind in KEYED else f"{kind}=<name>"


def field_path(kind: str) -> str:
    """Return the text that sets a field on the command line."""
    return f"{kind}.<key>.<field>=<value>" if kind in KEYED else f"{kind}.<field>=<value>"


def paragraphs(cls: type) -> list[str]:
    """Return the paragraphs of a class's docstring, up to its first numpydoc section."""
    return [textwrap.fill(part, COLUMNS) for part in description(cls)]


def rows_of(cls: type) -> list[FieldRow]:
    """Return the rows of a component's fields.

    Raises
    ------
    ValueError : a field has no comment.
    """
    rows = field_rows(cls)
    for row in rows:
        if not row.meaning:
            raise ValueError(
                f"{cls.__name__}.{row.name} has no comment; expected its meaning,"
                " beside the field or above it"
            )
    return rows


def markdown(row: FieldRow) -> str:
    """Return a row of a table of fields as Markdown."""
    default = f"`{row.default}`" if row.default else "required"
    cells = (f"`{row.name}`", row.meaning, row.unit, default, row.allowed)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def table(rows: list[FieldRow]) -> str:
    """Return a Markdown table of fields."""
    head = ["| field | meaning | unit | default | allowed |", "|---|---|---|---|---|"]
    return "\n".join(head + [markdown(row) for row in rows])


def presets_of(kind: str) -> list[str]:
    """Return the parts of the section with the presets of a kind; [] without presets."""
    files = sorted(file for folder in CONFIGS for file in ROOT.glob(f"{folder}/{kind}/*.yaml"))
    if not files:
        return []
    parts = ["## Presets", f"A preset is chosen like a component: `{choice(kind)}`."]
    for file in files:
        parts += [f"### `{file.stem}`", *preset_text(file)]
    return parts


def preset_text(file: Path) -> list[str]:
    """Return the description of a YAML file and its lines."""
    words, body = described_file(file.read_text())
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
