"""Parameters of a figure: those in the paper's text, or those in its published scripts."""

from __future__ import annotations

from typing import TypeVar

from isethdr_core.errors import ConfigError, did_you_mean

PAPER = "paper"
SCRIPTS = "scripts"

Of = TypeVar("Of")


def chosen(figure: str, parameters: str, known: dict[str, Of]) -> Of:
    """Return the parameters of a figure.

    Parameters
    ----------
    figure : name of the figure's study, for messages.
    parameters : parameters as typed.
    known : {name: the parameters}; names are `paper`, `scripts` and others.

    Raises
    ------
    ConfigError : `parameters` is none of the names.
    """
    if parameters not in known:
        raise ConfigError(
            f"study {figure} has parameters={parameters!r}{did_you_mean(parameters, known)}"
        )
    return known[parameters]
