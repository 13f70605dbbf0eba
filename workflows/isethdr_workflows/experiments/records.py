"""Which steps are finished, and how long they took: one JSON file for each step."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from isethdr_core.errors import CatalogError
from isethdr_core.storage.atomic_write import write_text
from isethdr_core.storage.home_folder import home

from .steps import FOLDER, Step


@dataclass(frozen=True)
class Record:
    """The record of a step that was run, finished or not."""

    commands: tuple[str, ...]
    minutes: float  # time of all attempts together
    finished: str  # time when it was finished, ISO 8601; "" if it is not finished
    load: float  # load of the machine at the end, mean of a minute


def folder() -> Path:
    """Return the folder for pictures and records of the experiments in the home folder."""
    return home() / FOLDER


def read(step: Step) -> Record | None:
    """Return the record of a step; None if there is none, or if it is of other commands."""
    try:
        content = json.loads((folder() / f"{step.name}.json").read_text(encoding="utf-8"))
        record = Record(**content | {"commands": tuple(content["commands"])})
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return record if record.commands == step.commands else None


def is_finished(step: Step) -> bool:
    """Return whether a step was finished with these commands and its files still exist."""
    record = read(step)
    if record is None or not record.finished:
        return False
    return all((home() / path).exists() for path in step.makes)


def write(step: Step, minutes: float, finished: bool, load: float) -> None:
    """Write the record of a step.

    Parameters
    ----------
    step : the step.
    minutes : minutes of this attempt; those of earlier attempts are added.
    finished : whether the step is finished.
    load : load of the machine.

    Raises
    ------
    CatalogError : the record cannot be written.
    """
    before = read(step)
    earlier = before.minutes if before is not None and not before.finished else 0.0
    now = datetime.now(UTC).isoformat(timespec="seconds") if finished else ""
    record = Record(step.commands, earlier + minutes, now, load)
    path = folder() / f"{step.name}.json"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, json.dumps(asdict(record), indent=1))
    except OSError as err:
        raise CatalogError(
            f"cannot write {path}: {err.strerror or err}; finished steps are kept; make room and"
            " type the same command again"
        ) from err
