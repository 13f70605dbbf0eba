"""Sweeps (`-m`): mistakes are found before the first job. Fields of a swept kind are rewritten,
because Hydra would refuse them.
"""

from __future__ import annotations

import math
import os
import re
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import compress
from pathlib import Path
from typing import Any

from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra._internal.utils import create_config_search_path, get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.types import RunMode

from ..cli.sweep_progress import watched as watched
from ..cli.sweep_summary import finish as finish
from ..errors import ConfigError, IsetHdrError
from ..pipeline.chain import chain
from ..plugins.component import KINDS
from ..plugins.presets import EXPERIMENT
from ..runs.labels import SETTINGS, checked, labels_of
from ..runs.run import check_writable
from ..storage.store import home
from ..sweeps.record import Sweep, check_free, name_of
from .composition import compose
from .hydra_shortcuts import is_in_a_preset
from .kept_choices import CONFIG_MODULE
from .trust import own_folder

NAME = "name"  # setting with the name of a sweep or a run
SWEEPER = re.compile(r"\bsweeper\b")


@dataclass(frozen=True)
class Prepared:
    """A sweep whose values have all been tried."""

    arguments: list[str]  # in the form that Hydra needs
    sweep: Sweep | None  # None where Hydra only shows something, for example with `--cfg job`


def prepared(arguments: list[str]) -> Prepared:
    """Return a sweep in the form that Hydra needs, after each of its values has been tried.

    Hydra first composes once without the swept kinds. In `sensor=bayer,rgbw
    sensor.exposure_s=0.008` the field has no owner then, so it is rewritten as a sweep of one
    choice. Each swept value is composed and built once, not each combination. Hydra alone composes
    from a main config or a folder that an option names, so their values are not tried. The name of
    the sweep does not change the jobs. It is removed from them and becomes the name of their
    folder.

    Raises
    ------
    ConfigError : a name, key or value is wrong, or another sweep has this name; no job has started
        yet.
    CatalogError : no store could be written.
    """
    options, other_arguments = get_args_parser().parse_known_args(arguments)
    if _only_shows(options) or any(a.startswith("-") for a in other_arguments):
        return Prepared(arguments, None)
    typed = [*options.overrides, *other_arguments]
    flags = [a for a in arguments if a not in typed]
    loader = _loader(options)
    parser = OverridesParser.create(config_loader=loader)
    overrides = parser.parse_overrides(typed)
    own = [o for o in overrides if o.get_key_element() != NAME]
    for override in own:
        _check_parameters(override)
    of_config = parser.parse_overrides(_swept_by_config(own, options, loader))
    jobs = [
        o
        for o in (*of_config, *own)
        if not o.is_hydra_override() and o.get_key_element() not in SETTINGS
    ]
    overrides_typed = tuple(str(o.input_line) for o in jobs)
    swept = [o for o in jobs if o.is_sweep_override()]
    sweep = Sweep(
        checked("name", _name(overrides) or name_of(overrides_typed)),
        overrides_typed,
        tuple(o.get_key_element().lstrip("+") for o in swept),
        math.prod(len(_values(o)) for o in swept),
    )
    check_free(sweep)
    if _names_configs(options):
        for override in own:
            _values(override)
    else:
        _try([*of_config, *own])
    check_writable(home())  # Hydra makes a folder for the sweep before the first job
    rewritten = _with_owners(own, _swept_places(jobs))
    return Prepared([*flags, *rewritten, f"hydra.sweep.dir={_quoted(sweep.folder)}"], sweep)


def _only_shows(options: Namespace) -> bool:
    """Return whether Hydra shows something, fails, or repeats a stored job, in place of a sweep."""
    if options.config_dir and not os.path.isdir(options.config_dir):
        return True
    shows = (options.help, options.hydra_help, options.cfg, options.info)
    others = (options.shell_completion, options.experimental_rerun)
    return any(option not in (None, False) for option in (*shows, *others))


def _names_configs(options: Namespace) -> bool:
    """Return whether an option names a main config, or a folder of config files."""
    return any((options.config_dir, options.config_path, options.config_name))


def _loader(options: Namespace) -> ConfigLoaderImpl:
    """Return Hydra's loader of configs, which knows the names in each group."""
    search_path = create_config_search_path(f"pkg://{CONFIG_MODULE}")
    if options.config_dir:
        folder = f"file://{os.path.abspath(options.config_dir)}"
        search_path.prepend("command-line", folder, anchor="schema")  # as Hydra does
    return ConfigLoaderImpl(search_path)


def _swept_by_config(
    own: Sequence[Override], options: Namespace, loader: ConfigLoaderImpl
) -> list[str]:
    """Return the overrides under `hydra.sweeper.params` of a config file. Hydra adds them to the
    typed ones, which replace those of the same key.

    Parameters
    ----------
    own : typed overrides.
    options : options of Hydra.
    loader : Hydra's loader of configs.
    """
    of_user = own_folder().is_dir() or _names_configs(options)
    typed_sweeper = any("sweeper" in o.key_or_group for o in own)
    if not (of_user or typed_sweeper or is_in_a_preset(SWEEPER)):
        return []
    # a swept kind may be under `params`, so that fields of it have no owner yet
    unowned = [str(o.input_line) if o.is_hydra_override() else _one_choice(o) for o in own]
    config = loader.load_configuration(options.config_name or "config", unowned, RunMode.MULTIRUN)
    params = config.hydra.sweeper.get("params") or {}
    keys = {o.get_key_element() for o in own}
    return [f"{key}={value}" for key, value in params.items() if key not in keys]


def _check_parameters(override: Override) -> None:
    """Refuse `hydra.sweeper.params={...}` and keys of it, which Hydra cannot merge into a table
    that is null.
    """
    if f"{override.key_or_group}.".startswith("hydra.sweeper.params."):
        raise ConfigError(
            f"{override.input_line} cannot be set by an override; expected the values of each key"
            " as an override of its own; type for example seed=1,2"
        )


def _name(overrides: Sequence[Override]) -> Any:
    """Return the typed name of a sweep; None without one."""
    for override in overrides:
        if override.get_key_element() == NAME:
            if override.is_sweep_override():
                raise ConfigError(
                    f"{override.input_line} sweeps over the name; expected one name for all jobs;"
                    " type for example name=night"
                )
            return override.value()
    return None


def _quoted(path: Path) -> str:
    """Return a path as text in quotes, as Hydra reads it: a backslash is doubled only before a
    quote or at the end.
    """
    text = re.sub(r"(\\+)('|$)", r"\1\1\2", str(path)).replace("'", "\\'")
    return f"'{text}'"


def _try(parsed: list[Override]) -> None:
    """Compose and build each swept value once.

    Raises
    ------
    IsetHdrError : a value is wrong.
    """
    values = [_values(o) for o in parsed]
    first = [v[0] for v in values]
    # settings of Hydra are tried once: with them, composing reads all config files again
    is_of_chain = [not o.is_hydra_override() for o in parsed]
    is_first = True
    for position, alternatives in enumerate(values):
        for alternative in alternatives if position == 0 else alternatives[1:]:
            job = [*first[:position], alternative, *first[position + 1 :]]
            choices = [o for o, tried in zip(job, values, strict=True) if len(tried) > 1]
            with _named(choices):
                config = compose(job if is_first else list(compress(job, is_of_chain)))
                labels_of(config)
                chain(config)
            is_first = False


def _swept_places(overrides: Sequence[Override]) -> set[str]:
    """Return the places of the config whose component is swept: `sensor`, `flare.dirt`."""
    return {
        o.package or o.key_or_group
        for o in overrides
        if o.is_sweep_override() and o.key_or_group in (*KINDS, EXPERIMENT)
    }


def _with_owners(own: Sequence[Override], places: set[str]) -> list[str]:
    """Return overrides in which each field of a swept component is a sweep of one choice.

    Parameters
    ----------
    own : typed overrides.
    places : places of the swept components. An experiment may choose any component.
    """

    def is_unowned(override: Override) -> bool:
        key = override.key_or_group
        in_place = any(key.startswith(f"{place}.") for place in places)
        return (in_place or EXPERIMENT in places) and not override.is_hydra_override()

    return [_one_choice(o) if is_unowned(o) else str(o.input_line) for o in own]


@contextmanager
def _named(choices: list[str]) -> Iterator[None]:
    """Add the overrides `choices` of a job to the message of its error."""
    try:
        yield
    except IsetHdrError as err:
        if not choices:
            raise
        raise ConfigError(f"job {' '.join(choices)}: {err}") from None


def _values(override: Override) -> list[str]:
    """Return the overrides of all values of a sweep, or the override itself.

    Raises
    ------
    ConfigError : the values cannot be listed, or there is none.
    """
    if not override.is_sweep_override():
        return [str(override.input_line)]
    key = override.get_key_element()
    if not override.is_discrete_sweep():
        raise ConfigError(
            f"{override.input_line} is an interval, which no sweeper of isethdr divides; expected"
            f" values between commas, or a range; type for example {key}=1,2"
        )
    values = [f"{key}={v}" for v in override.sweep_string_iterator()]
    if not values:
        raise ConfigError(
            f"{override.input_line} has no value; expected one or more; type for example {key}=1,2"
        )
    return values


def _one_choice(override: Override) -> str:
    """Return the override of a field as a sweep of one choice; any other override as it is."""
    is_field = "." in override.key_or_group
    if not is_field or override.is_sweep_override() or override.is_delete():
        return str(override.input_line)
    return f"{override.get_key_element()}=choice({override.get_value_element_as_str()})"
