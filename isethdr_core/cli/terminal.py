"""Terminal: the one console that prints for people. It shows every text as it is.

Names come from users and from other people's plugins. Rich would read `[red]` in them as a style,
and `:car:` as a picture, so markup, emoji codes and highlighting are off. A style is given by
argument.
"""

from __future__ import annotations

import math
import shutil
import textwrap
from collections.abc import Collection, Iterable, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING
from unicodedata import east_asian_width

if TYPE_CHECKING:
    from rich.console import Console

WIDEST_TEXT = 100  # columns of running text
WIDTH_OF_FILES = 200  # columns of tables that go to a file or a pipe: results are never cut
DIGITS = 5  # significant digits of a number with a fraction
LARGEST_WHOLE = 1e15  # whole numbers below this one are shown completely
LINED = 3  # columns that a cell needs in addition to its text, in a table with lines
UNLINED = 2  # the same in a table without lines
NARROWEST_TEXT = 16  # fewest columns of a cell that is broken between words
MOST_LINES = 6  # largest number of lines of such a cell
INDENT = "    "
UNBROKEN = "\0"  # stands for a space at which no line ends
BETWEEN = f"{UNBROKEN}| "


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
    lines = _wrapped(text, indent, indent if hanging is None else hanging)
    print("\n".join(lines) if lines else indent.rstrip())


def _wrapped(text: str, indent: str, hanging: str) -> list[str]:
    """Return the lines of a paragraph, broken at spaces only."""
    return textwrap.wrap(
        text,
        text_width(),
        initial_indent=indent,
        subsequent_indent=hanging,
        break_long_words=False,
        break_on_hyphens=False,
    )


def text_width() -> int:
    """Return the columns of the terminal, at most 100 because longer lines are hard to read; 80 in
    a pipe.
    """
    return min(shutil.get_terminal_size((80, 24)).columns, WIDEST_TEXT)


def number_of(number: int, one: str, several: str = "") -> str:
    """Return a number of things for people: `1 road`, `2 roads`, `0 roads`.

    Parameters
    ----------
    number : the number of things.
    one : the noun in the singular.
    several : the noun in the plural; "" for the singular with an s.
    """
    return f"{number} {one if number == 1 else several or f'{one}s'}"


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
    # a byte of a path that is no UTF-8 is shown as a question mark: not every output takes it
    shown = str(path).encode(errors="replace").decode()
    print(f"{label}:\n{shown}")


def print_table(
    columns: Iterable[object],
    rows: Iterable[Sequence[object]],
    title: str = "",
    whole: Collection[str] = (),
) -> None:
    """Print rows under the names of their columns. Nothing is cut where the terminal is narrow.

    Cells with spaces are broken between words. Where this does not suffice, each row is a
    paragraph: its first cell on a line, and indented below it the names and values of the others.

    Parameters
    ----------
    columns, rows : the names, and a cell for each of them in every row; None is an empty cell.
        Floating-point numbers are shown with five significant digits, whole ones completely.
    title : above a table with lines; without a title there are no lines.
    whole : names of the columns with text that users copy, such as keys and paths; the cells of
        these columns are never broken into lines.
    """
    names = [str(column) for column in columns]
    cells = [[_cell_text(cell) for cell in row] for row in rows]
    if title:
        print_text(title)
    lines_between = 1 + LINED * len(names) if title else UNLINED * len(names)
    widths = _fitting_widths(names, cells, console().width - lines_between, whole)
    if widths is None:
        for row in cells:
            _print_paragraph(list(zip(names, row, strict=True)), whole)
        return
    from rich.table import Column, Table

    heads = [
        Column(name, width=width, overflow="fold")
        for name, width in zip(names, widths, strict=True)
    ]
    table = Table(*heads) if title else Table(*heads, box=None)
    for row in cells:
        table.add_row(*row)
    console().print(table)


def _cell_text(cell: object) -> str:
    """Return a cell as it is shown: short numbers, and all else unchanged."""
    if cell is None:
        return ""
    if isinstance(cell, Real) and not isinstance(cell, Integral):
        number = float(cell)
        is_whole = number.is_integer() and abs(number) < LARGEST_WHOLE
        return f"{number:.0f}" if is_whole else f"{number:.{DIGITS}g}"
    return str(cell)


def _fitting_widths(
    names: Sequence[str], rows: Sequence[Sequence[str]], free: int, whole: Collection[str]
) -> list[int] | None:
    """Return the width of each column of a table, in all at most `free`; None where its cells do
    not fit, or would be higher than `MOST_LINES`.
    """
    widths = []
    smallest = []
    for number, name in enumerate(names):
        column = [name, *(row[number] for row in rows)]
        widest = max(_width(line) for cell in column for line in cell.split("\n"))
        words = max((_width(word) for cell in column for word in cell.split()), default=0)
        breakable = max(words, NARROWEST_TEXT, math.ceil(widest / MOST_LINES))
        widths.append(widest)
        smallest.append(widest if name in whole else min(widest, breakable))
    if sum(smallest) > free:
        return None
    while sum(widths) > free:
        above = [w if w > least else 0 for w, least in zip(widths, smallest, strict=True)]
        widths[above.index(max(above))] -= 1
    return widths


def _print_paragraph(cells: Sequence[tuple[str, str]], whole: Collection[str]) -> None:
    """Print the cells of a row, each with its name; the first one has a line of its own.

    Parameters
    ----------
    cells : name and text of each cell.
    whole : the names of the cells that stand on one line.
    """
    pieces = []
    for name, cell in cells:
        kept = cell.replace(" ", UNBROKEN) if name in whole else cell
        piece = f"{name}: {kept}"
        fits = _width(INDENT + piece + BETWEEN) <= text_width()
        if cell:
            pieces.append(piece.replace(" ", UNBROKEN) if fits else piece)
    for line in [
        *_wrapped(pieces[0] if pieces else "", "", INDENT),
        *_wrapped(BETWEEN.join(pieces[1:]), INDENT, INDENT),
    ]:
        print(line.replace(UNBROKEN, " "))


def _width(line: str) -> int:
    """Return the columns of a line: two for each wide character of East Asian scripts."""
    return len(line) + sum(east_asian_width(character) in "WF" for character in line)
