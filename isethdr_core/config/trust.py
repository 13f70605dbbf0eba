"""Trust: the folders from which config files are accepted, checked before Hydra opens a file.

A config file is code: Hydra imports and calls the names under `hydra.callbacks` and in `_target_`.
An experiment from somebody else can therefore do everything that its reader may do. Files of
installed packages are accepted, because the user decided to install them. The folder `conf` of the
working folder is accepted, because it is the user's own. Any other folder has to be named in the
variable ISETHDR_TRUST.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from shlex import quote
from urllib.parse import unquote, urlparse

from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override, ValueType

from ..errors import ConfigError
from ..storage.home_folder import working_folder

OWN_FOLDER = "conf"
VARIABLE = "ISETHDR_TRUST"
INSTALLED = ("pkg", "structured")  # kinds of search path that only an installed package can serve


def own_folder() -> Path:
    """Return the folder of the user's own config files: `conf` in the working folder."""
    return working_folder() / OWN_FOLDER


def trusted_folders() -> list[Path]:
    """Return the folders from which config files are accepted, apart from installed packages."""
    named = [Path(text) for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text]
    return [own_folder().resolve(), *(folder.resolve() for folder in named)]


def check_folder(folder: str | Path) -> None:
    """Refuse a folder of config files that is not trusted.

    Raises
    ------
    ConfigError : the folder is neither `conf` of the working folder nor within a folder that
        ISETHDR_TRUST names.
    """
    path = Path(folder).resolve()
    if not any(path.is_relative_to(trusted) for trusted in trusted_folders()):
        raise ConfigError(
            f"config files in {path} are not trusted, because a config file can run any code;"
            f" expected files of an installed package, in ./{OWN_FOLDER}, or in a folder that"
            f" {VARIABLE} names; if you trust these files, type {VARIABLE}={quote(str(path))}"
            " before the command"
        )


def check_overrides(overrides: Iterable[Override]) -> None:
    """Refuse overrides that bring in config files from folders that are not trusted.

    Parameters
    ----------
    overrides : parsed.

    Raises
    ------
    ConfigError : `hydra.searchpath` names such a folder, or a choice leaves its config group with
        `..`.
    """
    for override in overrides:
        key = override.get_key_element().lstrip("+~")
        value = override.value()
        if key == "hydra.searchpath" or key.startswith("hydra.searchpath."):
            _check_search_path(value)
        elif key != "hydra" and not key.startswith("hydra."):
            for choice in _choices(override):
                _check_choice(key, choice)


def check_arguments(arguments: Sequence[str]) -> None:
    """Refuse arguments of Hydra's own that bring in files from folders that are not trusted.

    Raises
    ------
    ConfigError : as `check_overrides`; also for `--config-dir`, `--config-path`, `--config-name`
        and a pickled config of `--experimental-rerun`, which is code as well.
    """
    args, other_arguments = get_args_parser().parse_known_args(list(arguments))
    if args.config_dir is not None:
        check_folder(args.config_dir)
    if args.config_path is not None:
        _check_search_path([args.config_path])
    if args.config_name is not None:
        _check_choice("--config-name", args.config_name)
    if args.experimental_rerun is not None:
        check_folder(Path(args.experimental_rerun).parent)
    typed = [*args.overrides, *(a for a in other_arguments if not a.startswith("-"))]
    check_overrides(OverridesParser.create().parse_overrides(typed))


def _check_search_path(value: object) -> None:
    folders = value if isinstance(value, list) else [value]
    for entry in map(str, filter(None, folders)):
        address = urlparse(entry.strip("'\""))
        if address.scheme in INSTALLED:
            continue
        local = address.netloc + unquote(address.path)
        check_folder(local if address.scheme in ("", "file") else entry)


def _choices(override: Override) -> list[object]:
    """Return every value that an override chooses: the parts of a list, or the jobs of a sweep."""
    if override.value_type == ValueType.GLOB_CHOICE_SWEEP:
        return []  # it chooses names within its group, whatever its pattern is
    if override.is_sweep_override():
        return list(override.sweep_string_iterator()) if override.is_discrete_sweep() else []
    value = override.value()
    return value if isinstance(value, list) else [value]


def _check_choice(key: str, choice: object) -> None:
    text = str(choice).strip("'\"")
    is_group = "." not in key.partition("@")[0]
    if is_group and ".." in text.replace("\\", "/").split("/"):
        raise ConfigError(
            f"{key}={text} leaves the config folders; expected the name of a config within them; "
            f"to use files of another folder, type {VARIABLE}=/folder before the command and "
            "--config-dir /folder after it"
        )
