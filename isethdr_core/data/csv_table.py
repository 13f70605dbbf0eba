"""Tables of numbers in a user's CSV file: one line with the names of the columns, numbers below it.

A byte order mark, which spreadsheets write before the text, empty lines, lines that begin with #,
and columns without a name are left out.
"""

from __future__ import annotations

import csv
import shlex
from collections import Counter
from pathlib import Path

import numpy as np

# separators of spreadsheets in countries with decimal commas, as `tr` writes them, and their names
OTHER_SEPARATORS = {";": (";", "semicolons"), "\t": (r"\t", "tabs")}


def read_text(path: str | Path) -> str:
    """Return the text of a CSV file, without a byte order mark.

    Raises
    ------
    OSError : the file cannot be read.
    ValueError : it is no UTF-8 text. The message continues a sentence that begins with the file.
    """
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(
            "is no text in UTF-8; expected a CSV file; save it as 'CSV UTF-8 (comma delimited)'"
        ) from None


def columns_of(text: str, path: str | Path, first_line: str) -> dict[str, np.ndarray]:
    """Return the columns of a table, {name: numbers}.

    Parameters
    ----------
    text : content of the file.
    path : path of the file, for commands in messages.
    first_line : names that are expected, as one line, for messages.

    Raises
    ------
    ValueError : the table is empty, has other separators than commas, names a column twice, or has
        a line with too few or too many values or with text. The message continues a sentence that
        begins with the file.
    """
    lines = [
        (number, cells)
        for number, line in enumerate(text.splitlines(), 1)
        if not line.startswith("#") and (cells := _cells(line))
    ]
    if not lines:
        raise ValueError(f"is empty; expected a first line {first_line} and numbers below it")
    (first, names), *rows = lines
    # names that are empty at the end of the first line: columns without a name
    width = len(next(csv.reader([text.splitlines()[first - 1]]), names))
    _check_names(names, path)
    if not rows:
        raise ValueError("holds no numbers; expected lines of numbers below its first line")
    for number, cells in rows:
        if not len(names) <= len(cells) <= width:
            raise ValueError(
                f"holds {len(cells)} values in line {number}; expected {len(names)}, one for each"
                " name of its first line, and points in decimal numbers"
            )
    return {
        name: np.array([_number(cells[k], number) for number, cells in rows])
        for k, name in enumerate(names)
        if name
    }


def _cells(line: str) -> list[str]:
    """Return the cells of a line. Empty cells at its end are left out, because spreadsheets pad
    lines with them.
    """
    try:
        cells = [cell.strip() for cell in next(csv.reader([line], skipinitialspace=True), [])]
    except csv.Error as problem:
        raise ValueError(f"is no CSV file ({problem}); expected numbers and commas") from None
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _check_names(names: list[str], path: str | Path) -> None:
    """Raise ValueError if the first line is not divided by commas, or names a column twice."""
    for separator, (typed, plural) in OTHER_SEPARATORS.items():
        if len(names) == 1 and separator in names[0]:
            raise ValueError(
                f"has {plural} between its columns; expected commas, and points in decimal numbers;"
                f" type for example tr ',{typed}' '.,' < {shlex.quote(str(path))} > commas.csv"
            )
    for name, count in Counter(names).items():
        if name and count > 1:
            raise ValueError(
                f"has {count} columns {name}; expected each name once; delete or rename the others"
            )


def _number(cell: str, line: int) -> float:
    try:
        return float(cell)
    except ValueError:
        raise ValueError(
            f"holds {cell!r} in line {line}, which is no number; expected numbers"
        ) from None
