"""State of a training: everything that is needed to continue after an interruption, in one file.

The file is replaced in one step, so an interruption leaves either the old state or the new one.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from isethdr_core.errors import CatalogError, ConfigError

from .files import write_file
from .torch_library import torch


def save_state(path: Path, state: dict[str, Any]) -> None:
    """Write a state, completely or not at all.

    Parameters
    ----------
    path : path of the file; its folder is made.
    state : tensors, numbers, texts, lists and dictionaries of them.

    Raises
    ------
    CatalogError : the state cannot be written, for example because the disk is full. The earlier
        state is kept.
    """
    content = io.BytesIO()
    torch.save(state, content)
    write_file(path, [content.getbuffer()])


def load_state(path: Path) -> dict[str, Any] | None:
    """Return a stored state, with tensors on the CPU; None if there is none.

    Raises
    ------
    CatalogError : the file is damaged.
    """
    if not path.exists():
        return None
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except (OSError, RuntimeError, ValueError, EOFError, pickle.UnpicklingError) as err:
        raise CatalogError(
            f"{path} is damaged ({str(err).splitlines()[0]}); expected the state of a training;"
            " remove the file to begin again"
        ) from None


def check_roads(folder: Path, dataset: str, before: Sequence[str], now: Sequence[str]) -> None:
    """Check that a training continues with the roads with which it began.

    Parameters
    ----------
    folder : folder of the training.
    dataset : name of the dataset.
    before, now : names of the roads when the training began, and of those in the dataset now.

    Raises
    ------
    ConfigError : the roads differ, for example because the dataset has grown.
    """
    if list(before) == list(now):
        return
    new = len(set(now) - set(before))
    gone = len(set(before) - set(now))
    raise ConfigError(
        f"the dataset {dataset!r} has changed since the training {folder.name} began: {new} roads"
        f" are new and {gone} are gone; expected the same roads; type name={folder.name}_2 to begin"
        " another training"
    )


def check_weights(folder: Path, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """Check that stored weights are those of the network that this version of isethdr trains.

    Parameters
    ----------
    folder : folder of the training.
    before, now : weights by name, as stored and of the new network.

    Raises
    ------
    ConfigError : the names differ.
    """
    if before.keys() == now.keys():
        return
    raise ConfigError(
        f"the training {folder.name} began with another version of isethdr, whose network has other"
        f" weights; expected the same version; type name={folder.name}_2 to begin another training"
    )
