"""Sweep record: the folder `sweeps/<name>` of a sweep, in which each job writes its result.

Jobs may run in several processes and on several machines, so each writes a file of its own. The
command that started the sweep reads the files after all jobs.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from textwrap import shorten

from ..errors import ConfigError
from ..storage.atomic_write import write_text
from ..storage.home_folder import home

RECORD = "sweep.json"
JOBS = "jobs"
LONGEST_COMMAND = 120  # largest number of characters of a command in a message


@dataclass(frozen=True)
class Job:
    """The result of one job."""

    number: int  # number of the job, from 0
    overrides: tuple[str, ...]  # as typed: `sensor=bayer`
    seconds: float
    key: str = ""  # key of its run; "" if the job failed
    computed: bool = False  # False: it failed, or its run was stored before
    error: str = ""
    ended: float = field(default_factory=time.time)  # seconds since 1970


@dataclass(frozen=True)
class Sweep:
    """A sweep: its name, its overrides, and its varying parameters."""

    name: str
    overrides: tuple[str, ...]  # as typed, without name, tags and Hydra's own
    varied: tuple[str, ...]  # keys with several values: `sensor`, `sensor.exposure_s`
    total: int  # number of jobs
    started: float = field(default_factory=time.time)  # seconds since 1970

    @property
    def folder(self) -> Path:
        """The folder of the sweep."""
        return home() / "sweeps" / self.name


def name_of(overrides: Sequence[str]) -> str:
    """Return a name for a sweep that the user did not name. Equal commands give equal names."""
    digest = hashlib.sha256("\n".join(sorted(overrides)).encode()).hexdigest()
    return f"sweep-{digest[:8]}"


def check_free(sweep: Sweep) -> None:
    """Refuse the name of another sweep.

    Raises
    ------
    ConfigError : a sweep of this name has other runs.
    """
    sweep_there = read_sweep(sweep.folder)
    if sweep_there is not None and sorted(sweep_there.overrides) != sorted(sweep.overrides):
        raise ConfigError(
            f"the name {sweep.name!r} belongs to another sweep:"
            f" {shorten(' '.join(sweep_there.overrides), LONGEST_COMMAND, placeholder=' ...')};"
            f" expected a name that is free; type for example name={_free_name(sweep)}, or remove"
            f" the folder {sweep.folder}"
        )


def _free_name(sweep: Sweep) -> str:
    number = 2
    while (home() / "sweeps" / f"{sweep.name}_{number}").exists():
        number += 1
    return f"{sweep.name}_{number}"


def begin(sweep: Sweep) -> None:
    """Make the folder of a sweep, and remove the files of jobs from an earlier start."""
    shutil.rmtree(sweep.folder / JOBS, ignore_errors=True)
    # the same command may have started in another terminal just now
    (sweep.folder / JOBS).mkdir(parents=True, exist_ok=True)
    write_text(sweep.folder / RECORD, json.dumps(asdict(sweep), indent=1))


def read_sweep(folder: Path) -> Sweep | None:
    """Return the sweep of a folder; None if there is none, or it cannot be read."""
    try:
        stored = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        texts = {k: tuple(stored[k]) for k in ("overrides", "varied")}
        return Sweep(str(stored["name"]), **texts, total=stored["total"], started=stored["started"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def write_job(folder: Path, job: Job) -> None:
    """Write the result of a job."""
    (folder / JOBS).mkdir(parents=True, exist_ok=True)
    write_text(folder / JOBS / f"{job.number}.json", json.dumps(asdict(job)))


def job_files(folder: Path) -> list[Path]:
    """Return the files with the results of the jobs of a sweep so far."""
    return list((folder / JOBS).glob("[0-9]*.json"))


def read_job(path: Path) -> Job:
    """Return the result of a job from its file."""
    stored = json.loads(path.read_text(encoding="utf-8"))
    return Job(**stored | {"overrides": tuple(stored["overrides"])})


def read_jobs(folder: Path) -> list[Job]:
    """Return the results of the jobs of a sweep so far, by number."""
    return sorted(map(read_job, job_files(folder)), key=lambda job: job.number)


def seconds_left(sweep: Sweep, jobs: Sequence[Job], now: float) -> float | None:
    """Return the time that the remaining jobs of a sweep need, s; None if no job was computed yet.

    Parameters
    ----------
    sweep : sweep, with its number of jobs.
    jobs : finished jobs.
    now : seconds since 1970.

    Notes
    -----
    The rate is the number of jobs computed since the first job began, in any number of processes,
    over the time since then. Work before that, such as composing all jobs, is not repeated. The
    remaining jobs are assumed not to be stored yet.
    """
    computed = sum(job.computed for job in jobs)
    if not computed:
        return None
    began = min(job.ended - job.seconds for job in jobs)
    return (now - began) / computed * max(sweep.total - len(jobs), 0)
