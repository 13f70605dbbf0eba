"""Two shortcuts through Hydra 1.3, which leave its results as they are.

- For each config file, Hydra makes a table of all choices so far. From it Hydra resolves
  interpolations such as `sensor: ${sensor}_night` in the file's defaults list. The tables take a
  quarter of the time of composing, and few lists have an interpolation.
- Before a run or a sweep, Hydra composes the whole config to learn `hydra.mode`, and composes it
  again for the job. Only an override or a config file can set the mode, and few do.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from hydra._internal import defaults_list
from hydra._internal.hydra import Hydra
from hydra.core.default_element import InputDefault
from omegaconf import DictConfig, OmegaConf

from ..plugins.presets import preset_folders

# override that isethdr itself adds to a sweep: it sets the folder, not the mode
NO_MODE = "hydra.sweep.dir="
SETS_MODE = re.compile(r"\bmode['\"]?\s*:")
_table_of_choices = defaults_list._create_interpolation_map
_mode_of_config = Hydra.get_mode


@cache
def take_shortcuts() -> None:
    """Let Hydra take both shortcuts in this process."""
    defaults_list._create_interpolation_map = _table_if_needed
    Hydra.get_mode = _mode_if_set


def _table_if_needed(overrides: Any, defaults: list[InputDefault], self_added: bool) -> DictConfig:
    if any(not default.is_self() and default.is_interpolation() for default in defaults):
        return _table_of_choices(overrides, defaults, self_added)
    nobody_reads_it: DictConfig = OmegaConf.create()
    return nobody_reads_it


def _mode_if_set(hydra: Hydra, config_name: str | None, overrides: Sequence[str]) -> Any:
    """Return the mode that a config sets. None lets Hydra follow the command line."""
    typed = any("hydra" in o and not o.startswith(NO_MODE) for o in overrides)
    entries = hydra.config_loader.get_search_path().get_path()
    of_others = any((entry.path or "").startswith("file://") for entry in entries)
    if typed or of_others or config_name != "config" or is_in_a_preset(SETS_MODE):
        return _mode_of_config(hydra, config_name, overrides)
    return None


@cache
def is_in_a_preset(pattern: re.Pattern[str]) -> bool:
    """Return whether a config file of an installed package matches a pattern, for example one that
    sets the mode.
    """
    files = (path for folder in preset_folders() for path in folder.rglob("*.yaml"))
    return any(pattern.search(_text_of(path)) for path in files)


def _text_of(path: Path) -> str:
    """Return the text of a config file; "" where it cannot be read. A file in another encoding must
    not stop the runs that do not choose it.
    """
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:  # just removed, or a link to nothing
        return ""
