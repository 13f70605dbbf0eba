"""Every error a user can cause, and which one to raise.

| raise                  | when                                                                   |
|------------------------|------------------------------------------------------------------------|
| `ConfigError`          | a name, key or value in a config is wrong                              |
| `UnitError`            | data that crosses a stage border lacks a dim, unit, order or sane value |
| `CatalogError`         | a store is damaged, incomplete, missing or cannot be written           |
| `PluginError`          | a plugin does not load or breaks its contract                          |
| `ValueError`, `TypeError` | a plain argument mistake inside a physics function                  |

A message says what was wrong with the value, what was expected, and what to type.
The command line prints it without a traceback.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

MOST_LISTED = 10  # largest number of names in a message; of more names, the most similar ones


class IsetHdrError(Exception):
    """Base of all errors that are the user's to fix."""


class ConfigError(IsetHdrError):
    """A config contains an unknown name or an impossible value."""


class UnitError(IsetHdrError):
    """Data at a stage border has the wrong dims, units, order or values."""


class CatalogError(IsetHdrError):
    """A store cannot be read, trusted or written."""


class PluginError(IsetHdrError):
    """A plugin does not load, or breaks the contract of its kind."""


def did_you_mean(name: str, known: Iterable[object]) -> str:
    """Return `; did you mean 'x'? (one of: ...)` for a name that is not among `known`.

    If there are very many names, only the most similar ones are listed.
    """
    names = sorted(map(str, known))
    near = difflib.get_close_matches(str(name), names, 1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    if len(names) > MOST_LISTED:
        nearest = difflib.get_close_matches(str(name), names, MOST_LISTED, 0.0)
        return f"{hint} ({len(names)} names are known, among them {', '.join(nearest)})"
    return f"{hint} (one of: {', '.join(names) or 'none'})"
