"""Templates of the report (in `templates/`), filled in with every value escaped.

Names come from users and from other people's plugins. Jinja2 escapes each of them, so that no name
can
add markup, a link or a script to the page. Only `Markup` passes unchanged: pictures and plots made
here.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

if TYPE_CHECKING:
    from jinja2 import Environment

FOLDER = Path(__file__).parent / "templates"


def filled(name: str, **values: Any) -> Markup:
    """Return the template `name` with its values; a value that the template lacks is an error."""
    return Markup(_environment().get_template(name).render(values))


@cache
def _environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    environment.filters["number"] = number
    return environment


def number(value: float | None) -> str:
    """Return a number for people: four significant digits, a dash where there is none."""
    if value is None or value != value:
        return "–"
    return f"{value:,.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:.4g}"
