"""Configs composed from choices alone, kept in memory for the next call.

Hydra reads some forty files to compose one config. Most calls repeat the choices of an earlier one
(`scene=tunnel`) and differ in values (`scene.seed=3`). Hydra applies values after all choices, to
the composed config. So the config of the choices is kept, and values are applied to a copy of it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import hydra
from cachetools import LRUCache
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.types import Override
from omegaconf import DictConfig, open_dict

from ..plugins import registry
from ..plugins.presets import preset_folders
from .main_config import OF_HYDRA, settings
from .packed import Packed
from .trust import own_folder

CONFIG_MODULE = "isethdr_core.config.conf"
MOST = 256  # largest number of kept configs; one takes about 40 kB


@dataclass(frozen=True)
class Composed:
    """A composed config without Hydra's own node, and the chosen presets by group."""

    config: DictConfig
    choices: DictConfig


_kept: LRUCache[tuple[object, ...], tuple[Packed, DictConfig]] = LRUCache(MOST)


def composed(overrides: Sequence[Override], config_name: str) -> Composed:
    """Return the config of parsed overrides, as Hydra composes it. Each call returns a new config.

    Parameters
    ----------
    overrides : parsed, in the order in which they were typed.
    config_name : name of the main config.

    Raises
    ------
    HydraException, OmegaConfBaseException : as Hydra raises them.
    """
    choices = [o for o in overrides if not _is_value(o)]
    values = [o for o in overrides if _is_value(o)]
    # if Hydra has special rules for one override, Hydra composes the whole config
    if own_folder().is_dir() or any(map(_needs_hydra, overrides)):
        return _by_hydra(overrides, config_name)
    key = (config_name, *(o.input_line for o in choices), *_sources())
    if key not in _kept:
        whole = _by_hydra(choices, config_name)
        _kept[key] = Packed(whole.config), whole.choices
    packed, chosen = _kept[key]
    config = packed.copy()
    ConfigLoaderImpl._apply_overrides_to_config(values, config)
    return Composed(config, chosen)


def _by_hydra(overrides: Sequence[Override], config_name: str) -> Composed:
    lines = [str(o.input_line) for o in overrides]
    GlobalHydra.instance().clear()
    with hydra.initialize_config_module(CONFIG_MODULE, version_base="1.3"):
        config = hydra.compose(config_name, overrides=lines, return_hydra_config=True)
    choices = config.hydra.runtime.choices
    with open_dict(config):
        config.pop(OF_HYDRA)
    return Composed(config, choices)


def _is_value(override: Override) -> bool:
    """Return whether an override certainly sets a value, such as `lens.f_number=2` or `seed=1`."""
    key = override.key_or_group
    if "." in key:
        return override.package is None and "/" not in key
    return key in {setting.name for setting in settings()}


def _needs_hydra(override: Override) -> bool:
    """Return whether an override is neither a plain choice nor a plain value. It may be a sweep, a
    setting of Hydra, or a table in place of a choice, which Hydra applies among the values.
    """
    if override.is_sweep_override():
        return True
    key = override.key_or_group
    is_table = isinstance(override.value(), dict)
    return key.startswith(OF_HYDRA) or (is_table and not _is_value(override))


def _sources() -> Iterator[object]:
    """Return everything outside the overrides that decides a config: components, and config files
    with the times at which they were written.
    """
    yield frozenset(registry.components().items())
    for folder in preset_folders():
        for path, _, names in os.walk(folder):
            for name in names:
                if name.endswith(".yaml"):
                    with suppress(OSError):  # just removed, or a link to nothing
                        yield path, name, os.stat(f"{path}/{name}").st_mtime_ns
