"""Launchers `slurm_chunks` and `local_chunks`: they share the jobs of a sweep among few processes.

submitit starts each chunk of jobs as one task of a SLURM array, or as one process of this machine.
A chunk computes its jobs one after the other. Hundreds of small runs then start Python only once
for each chunk.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hydra.core.config_store import ConfigStore
from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, run_job, setup_globals
from hydra.plugins.launcher import Launcher
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, open_dict

from ..errors import ConfigError
from ..storage.home_folder import HOME

# Hydra accepts only launchers with this prefix; the class itself stays in this module
TARGET = "hydra_plugins.isethdr.ChunkLauncher"
LIBRARY = "submitit"
SLURM = "slurm"
LOCAL = "local"
OUTPUT = ".chunks"  # folder of submitit's files, within the folder of the sweep
HOURS = 12.0  # default time limit of a chunk


class ChunksEndedError(Exception):
    """Chunks were ended before all of their jobs were tried."""


@dataclass
class ChunkSettings:
    """The fields below `hydra.launcher`."""

    _target_: str = TARGET
    engine: str = SLURM  # slurm or local
    workers: int = 10  # number of chunks
    hours: float = HOURS  # time limit of a chunk
    partition: str = ""  # partition of the cluster; "": the default partition
    cpus: int = 1  # cores of a chunk


@dataclass(frozen=True)
class Batch:
    """What each job of a sweep needs, as Hydra hands it to a launcher."""

    hydra_context: HydraContext
    task_function: TaskFunction
    config: DictConfig
    singletons: dict[Any, Any]
    home: str  # home folder on a disk that all processes see, or address of an object home


class ChunkLauncher(Launcher):
    """Starts the jobs of a sweep in chunks."""

    def __init__(self, **settings: Any) -> None:
        self.settings = ChunkSettings(**settings)
        self.hydra_context: HydraContext | None = None
        self.task_function: TaskFunction | None = None
        self.config: DictConfig | None = None

    def setup(
        self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig
    ) -> None:
        """Store what the jobs need.

        Parameters
        ----------
        hydra_context : Hydra's config loader and callbacks.
        task_function : function that computes one job from its config.
        config : composed config of the sweep.

        Raises
        ------
        ConfigError : a setting is out of its range, or submitit is not installed.
        """
        check(self.settings)
        self.hydra_context = hydra_context
        self.task_function = task_function
        self.config = config

    def launch(
        self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int
    ) -> Sequence[JobReturn]:
        """Run all jobs, and return when every chunk has ended.

        Raises
        ------
        ChunksEndedError : a chunk was killed, by a limit, by a failure of its node, or by somebody.
        """
        if self.hydra_context is None or self.task_function is None or self.config is None:
            raise RuntimeError("setup() was not called")
        setup_globals()
        batch = Batch(
            self.hydra_context,
            self.task_function,
            self.config,
            Singleton.get_state(),
            os.environ.get(HOME, ""),
        )
        jobs = [(initial_job_idx + k, list(typed)) for k, typed in enumerate(job_overrides)]
        parts = chunks(jobs, self.settings.workers)
        folder = Path(str(self.config.hydra.sweep.dir)).absolute() / OUTPUT
        tasks = executor(self.settings, folder).map_array(run_chunk, [batch] * len(parts), parts)
        errors = [error for task in tasks if (error := task.exception()) is not None]
        if errors:
            first = str(errors[0]).strip().splitlines()[0]
            raise ChunksEndedError(
                f"{len(errors)} of {len(tasks)} chunks ended early, for example {first}; their"
                f" output is in {folder}"
            )
        returned = {number: back for task in tasks for number, back in task.result()}
        return [returned[number] for number, _ in jobs]


def register() -> None:
    """Make both launchers known to Hydra."""
    Plugins.instance().class_name_to_class[TARGET] = ChunkLauncher
    store = ConfigStore.instance()
    for engine in (SLURM, LOCAL):
        node = ChunkSettings(engine=engine)
        store.store(group="hydra/launcher", name=f"{engine}_chunks", node=node, provider="isethdr")


def check(settings: ChunkSettings) -> None:
    """Refuse impossible settings.

    Raises
    ------
    ConfigError : an engine, number or time is impossible, or submitit is not installed.
    """
    if settings.engine not in (SLURM, LOCAL):
        raise ConfigError(
            f"hydra.launcher.engine is {settings.engine!r}; expected {SLURM} or {LOCAL}; type for"
            " example hydra/launcher=slurm_chunks"
        )
    if settings.workers < 1 or settings.cpus < 1 or not settings.hours > 0:
        raise ConfigError(
            f"hydra.launcher.workers is {settings.workers}, cpus is {settings.cpus} and hours is"
            f" {settings.hours:g}; expected 1 or more workers and cores, and more than 0 hours;"
            " type for example hydra.launcher.workers=10 hydra.launcher.hours=2"
        )
    if find_spec(LIBRARY) is None:
        raise ConfigError(
            f"hydra/launcher={settings.engine}_chunks needs {LIBRARY}; type: pip install"
            " 'isethdr[slurm]'"
        )


def chunks(jobs: Sequence[Any], count: int) -> list[list[Any]]:
    """Share jobs among at most `count` chunks. Neighbouring jobs often take equally long, so they
    are put into different chunks.
    """
    return [list(jobs[first::count]) for first in range(min(count, len(jobs)))]


def executor(settings: ChunkSettings, folder: Path) -> Any:
    """Return the executor of submitit.

    Parameters
    ----------
    folder : folder of the sweep's files, on a disk that all processes see.
    """
    made = import_module(LIBRARY).AutoExecutor(folder=folder, cluster=settings.engine)
    made.update_parameters(
        name="isethdr",
        timeout_min=max(1, int(settings.hours * 60)),
        cpus_per_task=settings.cpus,
    )
    if settings.partition:
        made.update_parameters(slurm_partition=settings.partition)
    return made


def run_chunk(batch: Batch, jobs: Sequence[tuple[int, list[str]]]) -> list[tuple[int, JobReturn]]:
    """Run jobs one after the other, in a process that may run on another machine. A failed job does
    not stop the others.

    Parameters
    ----------
    jobs : number in the sweep and overrides of each.

    Returns
    -------
    list : number of each job, and what Hydra returns for it.
    """
    if batch.home:
        os.environ[HOME] = batch.home
    setup_globals()
    Singleton.set_state(batch.singletons)
    return [(number, _run_job(batch, number, typed)) for number, typed in jobs]


def _run_job(batch: Batch, number: int, overrides: list[str]) -> JobReturn:
    config = batch.hydra_context.config_loader.load_sweep_config(batch.config, overrides)
    with open_dict(config):
        config.hydra.job.id = f"{config.hydra.job.name}_{number}"
        config.hydra.job.num = number
    HydraConfig.instance().set_config(config)
    return run_job(
        hydra_context=batch.hydra_context,
        task_function=batch.task_function,
        config=config,
        job_dir_key="hydra.sweep.dir",
        job_subdir_key="hydra.sweep.subdir",
    )
