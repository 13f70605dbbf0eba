"""Templates of the report (in `templates/`), filled in with every value escaped.

Names come from users and from other people's plugins. Jinja2 escapes each of them, so that no name
can add markup, a link or a script to the page. Only `Markup` passes unchanged: plots made here, and
the scripts in `templates/`. A browser runs those scripts only, because the page states their
digests and forbids any other script.
"""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

if TYPE_CHECKING:
    from jinja2 import Environment

FOLDER = Path(__file__).parent / "templates"


def filled(name: str, **values: Any) -> Markup:
    """Return the template `name` with its values; a value that the template lacks is an error."""
    return Markup(_environment().get_template(name).render(values))


@dataclass(frozen=True)
class Script:
    """A script of the page, and its SHA-256 digest in the form of a content security policy."""

    text: Markup
    digest: str


def script(name: str) -> Script:
    """Return the script `name` of the templates' folder."""
    text = (FOLDER / name).read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return Script(Markup(text), f"sha256-{digest}")


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
    environment.filters["breakable"] = breakable
    return environment


def breakable(text: object) -> Markup:
    """Return escaped text that a narrow column may break behind each underscore of a name."""
    return Markup(str(escape(text)).replace("_", "_<wbr>"))


def number(value: float | None) -> str:
    """Return the text of a number with four significant digits; a dash for None or NaN.

    From 1000 to 1 million it is a whole number with separators.
    """
    if value is None or value != value:
        return "–"
    return f"{value:,.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:.4g}"
