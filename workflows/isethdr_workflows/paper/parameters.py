"""Parameters of a figure: those of the paper's text, or those of its published scripts."""

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
    known : {paper, scripts or more: the parameters}.

    Raises
    ------
    ConfigError : none of these.
    """
    if parameters not in known:
        raise ConfigError(
            f"study {figure} has parameters={parameters!r}{did_you_mean(parameters, known)}"
        )
    return known[parameters]
