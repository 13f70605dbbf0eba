"""One job: the run of a composed config, and its summary for people."""

from __future__ import annotations

import time
from pathlib import Path

from omegaconf import DictConfig

from ..cli.progress import hidden
from ..cli.summary_tables import print_result
from ..runs.labels import Labels, add_labels
from ..runs.run import run
from ..sweeps.record import Job, read_sweep, write_job


def run_and_print(config: DictConfig) -> None:
    """Compute one run of a composed config and print its summary."""
    print_result(run(config))


def run_in_sweep(config: DictConfig, folder: Path, number: int, overrides: tuple[str, ...]) -> None:
    """Compute one job of a sweep and record it in the folder of the sweep. The command that started
    the sweep shows how many jobs are done.

    Parameters
    ----------
    config : composed config of the job.
    folder : folder of the sweep.
    number : number of the job, from 0.
    overrides : overrides of the job, as typed.
    """
    started = time.monotonic()
    with hidden():
        result = run(config)
    seconds = time.monotonic() - started
    job = Job(number, overrides, seconds, result.path.stem, result.computed)
    sweep = read_sweep(folder)
    if sweep is not None:
        add_labels(result.path, Labels(sweeps=(sweep.name,)))
    write_job(folder, job)
