"""A plugin package that fails on purpose; tests install it as `acme_trouble` for one test.

ACME_RAISE=1         the metric `acme` raises in the middle of a run
ACME_WAIT=metric     the metric writes the file ACME_MARK and waits to be killed
ACME_WAIT=store      the same while a run's store is written but not yet renamed
ACME_WAIT=paths      the same between the paths of a rendering limited by the noise of cameras
ACME_AFTER=n         wait only from the n-th time on (counted in ACME_MARK's folder); default 1
ACME_ERRORS=file     the hook for errors of stages writes to this file which stages failed
"""

import os
import time
from dataclasses import dataclass
from pathlib import Path

from isethdr_core import Component, Score, hookimpl
from isethdr_core.pipeline.noise_limit import CameraNoise
from isethdr_core.storage import store


def wait(where):
    """Write the mark and sleep, if the test wants to kill the process here."""
    if os.environ.get("ACME_WAIT") != where:
        return
    mark = Path(os.environ["ACME_MARK"])
    count = len(list(mark.parent.glob("passed-*"))) + 1
    mark.with_name(f"passed-{count}").touch()
    if count >= int(os.environ.get("ACME_AFTER", "1")):
        mark.touch()
        time.sleep(600)


@dataclass(frozen=True)
class Acme:
    """Give the number one, or fail as a test asked for."""

    def __call__(self, picture, truth, labels=None):
        """Return one score."""
        wait("metric")
        if os.environ.get("ACME_RAISE"):
            raise RuntimeError("glass broke\nin two")
        return [Score("acme", 1.0, "")]


to_disk = store._to_disk


def to_disk_and_wait(path):
    """Do the last step of writing a store, and wait there if a test asks for it."""
    to_disk(path)
    wait("store")


store._to_disk = to_disk_and_wait
limit_of_cameras = CameraNoise.__call__


def limit_of_cameras_and_wait(self, scene):
    """Return the limit that a renderer asks for between its paths, and wait if a test asks."""
    wait("paths")
    return limit_of_cameras(self, scene)


CameraNoise.__call__ = limit_of_cameras_and_wait


@hookimpl
def isethdr_components():
    """Return the metric."""
    return [Component("metric", "acme", Acme)]


@hookimpl
def isethdr_on_stage_error(stage):
    """Note the stage."""
    if note := os.environ.get("ACME_ERRORS"):
        with open(note, "a") as file:
            file.write(f"{stage.kind} {stage.name} {type(stage.error).__name__}\n")
