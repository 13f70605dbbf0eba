"""Model card: a description of a trained file, in YAML for programs and in Markdown for readers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from .files import write_file


def write_card(folder: Path, title: str, sections: Mapping[str, Any]) -> list[Path]:
    """Write `card.yaml` and `card.md` into a folder, and return their paths.

    Parameters
    ----------
    folder : folder of the trained file.
    title : title of the card.
    sections : {heading: text, list of texts, list of rows, or table of names and values}.

    Raises
    ------
    CatalogError : a file cannot be written, for example because the disk is full.
    """
    written = {
        folder / "card.yaml": card_yaml(title, sections),
        folder / "card.md": card_markdown(title, sections),
    }
    for path, text in written.items():
        write_file(path, [text.encode()])
    return list(written)


def card_yaml(title: str, sections: Mapping[str, Any]) -> str:
    """Return the card as YAML.

    Parameters
    ----------
    title : title of the card.
    sections : sections, as in `write_card`.
    """
    return yaml.safe_dump({"title": title, **sections}, sort_keys=False, width=98)


def card_markdown(title: str, sections: Mapping[str, Any]) -> str:
    """Return the card as Markdown.

    Parameters
    ----------
    title : title of the card.
    sections : {heading: text, list of texts, list of rows (a table), or table of names and
        values}.
    """
    parts = [f"# {title}"]
    for heading, content in sections.items():
        parts += ["", f"## {heading[:1].upper()}{heading[1:].replace('_', ' ')}", ""]
        parts += _lines(content)
    return "\n".join(parts) + "\n"


def _lines(content: Any) -> list[str]:
    if isinstance(content, Mapping):
        return [f"- {key.replace('_', ' ')}: {_shown(value)}" for key, value in content.items()]
    if isinstance(content, list) and content and isinstance(content[0], Mapping):
        names = list(content[0])
        rows = [[_shown(row.get(name, "")) for name in names] for row in content]
        heads = [name.replace("_", " ") for name in names]
        return [f"| {' | '.join(cells)} |" for cells in (heads, ["---"] * len(names), *rows)]
    if isinstance(content, list):
        return [f"- {_shown(value)}" for value in content]
    return [_shown(content)]


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(map(_shown, value))
    return str(value)
