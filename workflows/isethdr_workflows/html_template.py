"""HTML templates of the pages of datasets and studies."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template


@cache
def html_template(folder: Path, name: str) -> Template:
    """Return a template, which escapes all text and refuses names that it is not given.

    Parameters
    ----------
    folder : folder of the templates.
    name : file name of the template.
    """
    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)
