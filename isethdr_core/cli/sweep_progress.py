"""Progress of a sweep: how many of its runs are done, and the time for the others, in one line.

The command that started the sweep reads the results that jobs write into the folder of the sweep,
so the line is the same for jobs in this process, in other processes and on other machines. On a
terminal the line is updated in place; elsewhere a new line is printed from time to time.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

from ..sweeps.record import Job, Sweep, job_files, read_job, seconds_left
from .terminal import console, duration

POLL_S = 1.0  # time between two reads of the sweep's folder
# shortest times without a terminal, before the first line and between two lines
FIRST_LINE_S = 30.0
SHARE_OF_TIME = 0.05  # share of the time since the start, so that lines become rarer


@dataclass
class SweepProgress:
    """The runs of a sweep that are done."""

    sweep: Sweep
    jobs: dict[str, Job] = field(default_factory=dict)  # {name of the job's file: job}

    def look(self) -> None:
        """Read the results that have come since the last look."""
        for path in job_files(self.sweep.folder):
            if path.name not in self.jobs:
                with suppress(OSError, ValueError, TypeError):  # read it at the next look
                    self.jobs[path.name] = read_job(path)

    def line(self, now: float) -> str:
        """Return the progress in one line.

        Parameters
        ----------
        now : seconds since 1970.
        """
        jobs = list(self.jobs.values())
        failed = sum(bool(job.error) for job in jobs)
        remaining_s = seconds_left(self.sweep, jobs, now)
        text = f"{len(jobs)} of {self.sweep.total} runs done"
        text += f", {failed} failed" if failed else ""
        return text + (f", about {duration(remaining_s)} left" if remaining_s else "")


def is_due(passed_s: float, since_last_s: float) -> bool:
    """Return whether a new line is printed where there is no terminal.

    Parameters
    ----------
    passed_s : time since the sweep started.
    since_last_s : time since the last line, or since the start if there is none.
    """
    return since_last_s >= max(FIRST_LINE_S, SHARE_OF_TIME * passed_s)


@contextmanager
def watched(sweep: Sweep) -> Iterator[None]:
    """Show the progress of a sweep on standard error while the block runs its jobs."""
    progress = SweepProgress(sweep)
    ended = threading.Event()
    shown = _drawn if sys.stderr.isatty() else _printed
    watcher = threading.Thread(target=shown, args=(progress, ended.wait), daemon=True)
    watcher.start()
    try:
        yield
    finally:
        ended.set()
        watcher.join()


def _printed(progress: SweepProgress, wait: Callable[[float], bool]) -> None:
    """Print a line now and then, if runs were done since the last one.

    Parameters
    ----------
    wait : function(seconds) -> whether the sweep has ended.
    """
    last = time.time()
    said = 0
    while not wait(POLL_S):
        now = time.time()
        if not is_due(now - progress.sweep.started, now - last):
            continue
        progress.look()
        if len(progress.jobs) > said:
            print(progress.line(now), file=sys.stderr, flush=True)
            last = now
            said = len(progress.jobs)


def _drawn(progress: SweepProgress, wait: Callable[[float], bool]) -> None:
    """Draw the line with a bar until the sweep has ended, then remove it."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task = bar.add_task(progress.line(time.time()), total=progress.sweep.total)
        while not wait(POLL_S):
            progress.look()
            text = progress.line(time.time())
            bar.update(task, completed=len(progress.jobs), description=text)
