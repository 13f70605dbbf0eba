"""Libraries that the base install leaves out: what asks for one says which extra brings it.

The base install holds what a run of an analytic scene needs, without the libraries that are large
and serve one part alone. Extras and their libraries are listed in pyproject.toml; `pip install
'isethdr[all]'` brings them all.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .errors import ConfigError


@contextmanager
def needed(feature: str, extra: str) -> Iterator[None]:
    """Import an optional library inside the block, or raise an error that says what to install.

    Parameters
    ----------
    feature : what needs the library, as the message's subject: "the chart macbeth".
    extra : name of the extra that brings the library, such as "colour".

    Raises
    ------
    ConfigError : a module that the block imports is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"{feature} needs {error.name}, which is not installed; type pip install"
            f" 'isethdr[{extra}]'"
        ) from error
