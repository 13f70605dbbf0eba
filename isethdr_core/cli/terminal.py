"""Terminal: the one console that prints for people. It shows every text as it is.

Names come from users and from other people's plugins. Rich would read `[red]` in them as a style
and
`:car:` as a picture, so markup, emoji codes and highlighting are off. A style is given by argument.
"""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

WIDEST_TEXT = 100  # columns of running text
WIDTH_OF_FILES = 200  # columns of tables that go to a file or a pipe: results are never cut


def console(stderr: bool = False) -> Console:
    """Return a console that interprets nothing; wide where the output is no terminal."""
    from rich.console import Console

    plain = {"markup": False, "emoji": False, "highlight": False, "stderr": stderr}
    rich_console = Console(**plain)
    return (
        rich_console
        if rich_console.is_terminal
        else Console(width=max(rich_console.width, WIDTH_OF_FILES), **plain)
    )


def print_text(text: str, indent: str = "", hanging: str | None = None) -> None:
    """Print text, broken between words so that it fits the terminal; 80 columns in a pipe.

    Parameters
    ----------
    text : one paragraph.
    indent, hanging : what precedes the first line, and the others (None: as the first).
    """
    following = indent if hanging is None else hanging
    lines = textwrap.wrap(
        text,
        text_width(),
        initial_indent=indent,
        subsequent_indent=following,
        break_long_words=False,
        break_on_hyphens=False,
    )
    print("\n".join(lines) if lines else indent.rstrip())


def text_width() -> int:
    """Return the columns of the terminal, at most 100, for longer lines read badly; 80 in a
    pipe.
    """
    return min(shutil.get_terminal_size((80, 24)).columns, WIDEST_TEXT)


def duration(seconds: float) -> str:
    """Return a time for people: `2.1 s`, `3 min 20 s`, `1 h 05 min`."""
    if seconds < 100:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes = round(seconds) // 60
    if minutes < 60:
        return f"{minutes} min {round(seconds) % 60:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def print_path(label: str, path: Path | str) -> None:
    """Print a label, and below it the path alone on its line, so that it can be copied whole."""
    print(f"{label}:\n{path}")


def print_table(
    columns: Iterable[object], rows: Iterable[Sequence[object]], title: str = ""
) -> None:
    """Print rows under the names of their columns; None is an empty cell.

    Parameters
    ----------
    columns, rows : the names, and a cell for each of them in every row.
    title : above a table with lines; without a title there are no lines.
    """
    from rich.table import Table

    names = [str(column) for column in columns]
    table = Table(*names, title=title) if title else Table(*names, box=None)
    for row in rows:
        table.add_row(*("" if cell is None else str(cell) for cell in row))
    console().print(table)
