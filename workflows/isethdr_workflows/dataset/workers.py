"""Workers: share the scenes of a dataset between processes of this machine or a SLURM cluster.

Existing engines do the work: joblib starts processes, submitit submits an array of SLURM jobs. All
call the same function on chunks of scene numbers. A scene that two of them try is rendered once,
for one process at a time holds the claim on its radiance.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec

from isethdr_core.errors import ConfigError
from isethdr_core.storage.home_folder import home

Make = Callable[[str, Sequence[int], Callable[[str], None]], None]

HERE, PROCESSES, SLURM = "here", "processes", "slurm"
ENGINES = {HERE: "", PROCESSES: "joblib", SLURM: "submitit"}  # {engine: its library}
EXTRAS = {PROCESSES: "sweep", SLURM: "slurm"}


@dataclass(frozen=True)
class Workers:
    """Who makes the scenes.

    Parameters
    ----------
    engine : `here` (this process), `processes` (of this machine) or `slurm` (nodes of a cluster).
    count : number of processes, or of jobs of the array.
    hours : time limit of a SLURM job.
    partition : of the SLURM cluster; "": its default.
    """

    engine: str = HERE
    count: int = 1
    hours: float = 12.0
    partition: str = ""

    def __post_init__(self) -> None:
        if self.engine not in ENGINES:
            raise ConfigError(
                f"engine is {self.engine!r}; expected {', '.join(ENGINES)}; type for example"
                " engine=processes workers=2"
            )
        if self.count < 1 or not self.hours > 0:
            raise ConfigError(
                f"workers is {self.count} and hours is {self.hours:g}; expected 1 or more workers"
                " and more than 0 hours; type for example workers=2 hours=12"
            )
        library = ENGINES[self.engine]
        if library and find_spec(library) is None:
            raise ConfigError(
                f"engine={self.engine} needs {library}; type: pip install"
                f" 'isethdr[{EXTRAS[self.engine]}]'"
            )


def share(
    make: Make, numbers: Sequence[int], workers: Workers, name: str, tell: Callable[[str], None]
) -> None:
    """Make some scenes of a dataset, and return when all have been tried.

    Parameters
    ----------
    make : function of a module, which makes scenes by (name, numbers, tell).
    numbers : of the scenes.
    workers : who makes them.
    name : of the dataset.
    tell : called with one line of text for each scene; processes of their own print instead.

    Raises
    ------
    CatalogError : stores cannot be written.
    """
    if workers.engine == HERE:
        make(name, numbers, tell)
        return
    chunks = [list(numbers[first :: workers.count]) for first in range(workers.count)]
    wanted = [chunk for chunk in chunks if chunk]
    call = partial(in_process, make, name, str(home().resolve()))
    engine = import_module(ENGINES[workers.engine])
    if workers.engine == PROCESSES:
        engine.Parallel(n_jobs=workers.count)(engine.delayed(call)(chunk) for chunk in wanted)
        return
    executor = engine.AutoExecutor(folder=home() / "datasets" / name / "jobs")
    executor.update_parameters(name=f"isethdr-{name}", timeout_min=max(1, int(workers.hours * 60)))
    if workers.partition:
        executor.update_parameters(slurm_partition=workers.partition)
    for job in executor.map_array(call, wanted):
        job.result()


def in_process(make: Make, name: str, home_folder: str, numbers: Sequence[int]) -> None:
    """Make some scenes in a process that may have started elsewhere.

    Parameters
    ----------
    make : as of `share`.
    name : of the dataset.
    home_folder : the home, on a disk that all processes see.
    numbers : of the scenes.
    """
    os.environ["ISETHDR_HOME"] = home_folder
    make(name, numbers, partial(print, flush=True))
