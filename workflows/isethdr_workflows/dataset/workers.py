"""Workers: share the scenes of a dataset between processes of this machine or of a cluster.

Existing engines do the work: joblib starts processes, submitit submits an array of SLURM jobs, Ray
runs tasks on its cluster. All call the same function. A job or a task makes a chunk of scenes. The
processes of one machine take one scene at a time, because scenes differ in time by a factor of ten.
A scene that two processes try is rendered only once, because only one process at a time can hold
the claim on its radiance.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec

from isethdr_core.cli.terminal import duration
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage.home_folder import home

Make = Callable[[str, Sequence[int], Callable[[str], None]], None]
Order = Callable[[Sequence[int]], int]

HERE = "here"
PROCESSES = "processes"
SLURM = "slurm"
RAY = "ray"
# {engine: its library}
ENGINES = {HERE: "", PROCESSES: "joblib", SLURM: "submitit", RAY: "ray"}
EXTRAS = {PROCESSES: "sweep", SLURM: "slurm", RAY: "ray"}
RETRIES = 10  # number of retries of a Ray task after its node or process was lost


@dataclass(frozen=True)
class Workers:
    """The processes, jobs or tasks that make the scenes.

    Parameters
    ----------
    engine : `here` (this process), `processes` (of this machine), `slurm` (nodes of a cluster) or
        `ray` (the cluster of the variable RAY_ADDRESS, or one on this machine).
    count : number of processes, of jobs of the array, or of tasks.
    hours : time limit of a SLURM job.
    partition : partition of the SLURM cluster; "": its default.
    cpus : cores of a SLURM job or a Ray task; the renderer uses all of them.
    """

    engine: str = HERE
    count: int = 1
    hours: float = 12.0
    partition: str = ""
    cpus: int = 1

    def __post_init__(self) -> None:
        if self.engine not in ENGINES:
            raise ConfigError(
                f"engine is {self.engine!r}; expected {', '.join(ENGINES)}; type for example"
                " engine=processes workers=2"
            )
        if self.count < 1 or not self.hours > 0 or self.cpus < 1:
            raise ConfigError(
                f"workers is {self.count}, hours is {self.hours:g} and cpus is {self.cpus};"
                " expected 1 or more workers and cores, and more than 0 hours; type for example"
                " workers=2 hours=12 cpus=4"
            )
        library = ENGINES[self.engine]
        if library and find_spec(library) is None:
            raise ConfigError(
                f"engine={self.engine} needs {library}; type: pip install"
                f" 'isethdr[{EXTRAS[self.engine]}]'"
            )

    @property
    def at_once(self) -> int:
        """The number of scenes that one machine makes at the same time."""
        return self.count if self.engine == PROCESSES else 1


def first_of(left: Sequence[int]) -> int:
    """Return the first of the scenes that no process has begun."""
    return left[0]


def share(
    make: Make,
    numbers: Sequence[int],
    workers: Workers,
    name: str,
    tell: Callable[[str], None],
    order: Order = first_of,
) -> None:
    """Make some scenes of a dataset, and return when all have been tried.

    Parameters
    ----------
    make : function(name, numbers, tell) that makes scenes; it must be importable by processes.
    numbers : numbers of the scenes.
    workers : the processes, jobs or tasks that make them.
    name : name of the dataset.
    tell : called with one line of text for each scene; jobs and tasks print instead.
    order : function(scenes that no process has begun) -> the next one, for processes.

    Raises
    ------
    CatalogError : stores cannot be written; or processes ended before their scenes were made.
    """
    if workers.engine == HERE:
        make(name, numbers, tell)
        return
    if workers.engine == PROCESSES:
        by_processes(partial(lines_about, make, name), numbers, workers.count, tell, order)
        return
    chunks = [list(numbers[first :: workers.count]) for first in range(workers.count)]
    wanted = [chunk for chunk in chunks if chunk]
    call = partial(in_process, make, name, str(home().resolve()))
    engine = import_module(ENGINES[workers.engine])
    if workers.engine == RAY:
        by_ray(call, wanted, workers.cpus)
        return
    folder = home() / "datasets" / name / "jobs"
    executor = engine.AutoExecutor(folder=folder, cluster="slurm")
    executor.update_parameters(
        name=f"isethdr-{name}",
        timeout_min=max(1, int(workers.hours * 60)),
        cpus_per_task=workers.cpus,
    )
    if workers.partition:
        executor.update_parameters(slurm_partition=workers.partition)
    jobs = executor.map_array(call, wanted)
    errors = [error for job in jobs if (error := job.exception()) is not None]
    if errors:
        first = str(errors[0]).strip().splitlines()[0]
        many = f"{len(errors)} of {len(jobs)} jobs"
        raise ended_early(f"{many}, for example {first}; their output is in {folder}")


def by_processes(
    lines_of: Callable[[str, int, int], list[str]],
    numbers: Sequence[int],
    count: int,
    tell: Callable[[str], None],
    order: Order = first_of,
) -> None:
    """Make scenes in processes of this machine. Each process takes the next scene when it is free.

    Parameters
    ----------
    lines_of : function(home folder, id of the calling process, number of the scene) that makes a
        scene and returns lines about it, as `lines_about` does.
    numbers : numbers of the scenes.
    count : number of processes.
    tell : called with one line of text for each scene.
    order : function(scenes that no process has begun) -> the next one.

    Raises
    ------
    CatalogError : a process was killed.
    """
    joblib = import_module(ENGINES[PROCESSES])
    # joblib asks for a task when a process is free, so that the order may depend on earlier scenes
    pool = joblib.Parallel(
        n_jobs=count, batch_size=1, pre_dispatch="n_jobs", return_as="generator_unordered"
    )
    folder = str(home().resolve())
    tasks = (
        joblib.delayed(lines_of)(folder, os.getpid(), number)
        for number in one_by_one(numbers, order)
    )
    started = time.monotonic()
    try:
        for done, lines in enumerate(pool(tasks), 1):
            left_s = (time.monotonic() - started) / done * (len(numbers) - done)
            rest = f", about {duration(left_s)} left" if done < len(numbers) else ""
            for line in lines:
                tell(line + rest)
    except RuntimeError as err:  # joblib raises it if a process was killed
        raise ended_early(f"{type(err).__name__}: {err}") from err


def one_by_one(numbers: Sequence[int], order: Order) -> Iterator[int]:
    """Yield the numbers of scenes. Each next one is chosen only when a process is free.

    Parameters
    ----------
    numbers : numbers of the scenes.
    order : function(scenes that were not yielded) -> the next one.
    """
    left = list(numbers)
    while left:
        number = order(left)
        left.remove(number)
        yield number


def by_ray(call: Callable[[Sequence[int]], None], chunks: Sequence[list[int]], cpus: int) -> None:
    """Make chunks of scenes as Ray tasks. Tasks of a lost node start again on another node.

    Parameters
    ----------
    call : function that makes the scenes of a chunk.
    chunks : numbers of the scenes of each task.
    cpus : cores that a task takes.

    Raises
    ------
    CatalogError : a task ended early in all retries.
    """
    ray = import_module(ENGINES[RAY])
    ray.init(ignore_reinit_error=True)  # the cluster of RAY_ADDRESS, or one of its own
    task = ray.remote(num_cpus=cpus, max_retries=RETRIES)(lambda chunk: call(chunk))
    try:
        ray.get([task.remote(chunk) for chunk in chunks])
    except ray.exceptions.RayError as err:
        raise ended_early(str(err).strip().splitlines()[-1]) from err


def ended_early(what: str) -> CatalogError:
    """Return the error of processes that did not make all of their scenes.

    Parameters
    ----------
    what : which processes, and why as far as it is known.
    """
    return CatalogError(
        f"processes ended before all of their scenes were tried ({what}); stored scenes are"
        " complete; type the same command again to continue"
    )


def lines_about(make: Make, name: str, home_folder: str, parent: int, number: int) -> list[str]:
    """Make a scene in a process of its own, and return the lines about it.

    Parameters
    ----------
    make : function that makes scenes, as in `share`.
    name : name of the dataset.
    home_folder : path of the home folder.
    parent : id of the calling process.
    number : number of the scene.

    Raises
    ------
    CatalogError : the calling process has ended, so nobody waits for the scene.
    """
    if os.getppid() != parent:
        raise ended_early("the command was killed")
    os.environ["ISETHDR_HOME"] = home_folder
    lines: list[str] = []
    make(name, [number], lines.append)
    return lines


def in_process(make: Make, name: str, home_folder: str, numbers: Sequence[int]) -> None:
    """Make a chunk of scenes in a job or a task, and print the lines about them.

    Parameters
    ----------
    make : function that makes scenes, as in `share`.
    name : name of the dataset.
    home_folder : path of the home folder, on a disk that all processes see.
    numbers : numbers of the scenes.
    """
    os.environ["ISETHDR_HOME"] = home_folder
    make(name, numbers, partial(print, flush=True))
