"""Terminal: the one console that prints for people. It shows every text as it is.

Names come from users and from other people's plugins. Rich would read `[red]` in them as a style
and
`:car:` as a picture, so markup, emoji codes and highlighting are off. A style is given by argument.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

WIDTH_OF_FILES = 200  # columns of tables that go to a file or a pipe: results are never cut


def console(stderr: bool = False) -> Console:
    """Return a console that interprets nothing; wide where the output is no terminal."""
    from rich.console import Console

    plain = {"markup": False, "emoji": False, "highlight": False, "stderr": stderr}
    shown = Console(**plain)
    return shown if shown.is_terminal else Console(width=max(shown.width, WIDTH_OF_FILES), **plain)


def print_path(label: str, path: Path | str) -> None:
    """Print a label, and below it the path alone on its line, so that it can be copied whole."""
    print(f"{label}:\n{path}")
