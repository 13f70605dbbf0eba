"""The command `python -m isethdr_measured NAME key=value ... [--csv FILE]`."""

from __future__ import annotations

import sys

import typer
from isethdr_workflows.study_command import Studies, study_of

from isethdr_core.errors import IsetHdrError

from . import STUDIES

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command()(study_of(Studies(STUDIES, __package__)))

if __name__ == "__main__":
    try:
        app()
    except IsetHdrError as err:
        print(f"error: {err}", file=sys.stderr)
        sys.exit(2)
