"""Libraries outside the base install. If one is missing, the error names the extra that installs
it.

The base install serves a run of an analytic scene, without large libraries for single parts. Extras
and their libraries are listed in pyproject.toml; `pip install 'isethdr[all]'` installs them all.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .errors import ConfigError


@contextmanager
def needed(feature: str, extra: str) -> Iterator[None]:
    """Import an optional library inside the block. If it is missing, raise an error that states
    what to install.

    Parameters
    ----------
    feature : the feature that needs the library, as the message's subject: "the chart macbeth".
    extra : name of the extra that installs the library, such as "colour".

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
