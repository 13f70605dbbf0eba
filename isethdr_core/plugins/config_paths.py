"""Config paths: Hydra search paths with presets, as plugins name them.

A plugin whose answer cannot be used is logged once, and its presets are left out, so that all other
components can still be composed.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from importlib import util
from typing import Any

from .registry import plugin_manager

log = logging.getLogger(__name__)
PACKAGE = "pkg://"
_logged: set[tuple[str, str]] = set()  # plugins and errors


def config_paths() -> Iterator[tuple[str, str]]:
    """Yield (plugin, search path) of all plugins, for example `pkg://acme_camera.conf`."""
    for impl in plugin_manager().hook.isethdr_config_paths.get_hookimpls():
        name = str(impl.plugin_name)
        try:
            answer: Any = impl.function()
            paths = _checked(answer)
        except (Exception, SystemExit) as err:  # the code of a third party may raise anything
            said = f"{type(err).__name__}: {' '.join(str(err).split())}"
            if (name, said) not in _logged:
                _logged.add((name, said))
                log.error(
                    "plugin %r names no folders with presets, which are left out (%s)", name, said
                )
            continue
        yield from ((name, path) for path in paths)


def folders_of(package: str) -> list[str]:
    """Return the folders of a package.

    Parameters
    ----------
    package : dotted name, or a path with slashes.

    Raises
    ------
    ImportError, ValueError : there is no such package.
    """
    spec = util.find_spec(package.replace("/", "."))
    if spec is None:
        raise ImportError(f"there is no package {package!r}")
    return list(spec.submodule_search_locations or [])


def _checked(answer: Any) -> list[str]:
    """Return the answer of a plugin as a list of search paths.

    Raises
    ------
    TypeError : the answer is no list of texts.
    ImportError, ValueError : a package of it does not exist.
    """
    if isinstance(answer, str):
        raise TypeError(f"it returned {answer!r}; expected a list, for example ['{answer}']")
    paths = list(answer)
    for path in paths:
        if not isinstance(path, str):
            raise TypeError(
                f"it returned {path!r} in its list; expected texts such as pkg://a.conf"
            )
        if path.startswith(PACKAGE):
            folders_of(path.removeprefix(PACKAGE))
    return paths
