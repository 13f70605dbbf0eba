"""Reproduce: repeat a stored run from its record, and list the numbers that differ.

The run is computed in a temporary home folder, so that it neither reads nor changes stored data,
except for radiance that its scene names as a store.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from omegaconf import OmegaConf

from isethdr_core.cli.terminal import print_table, print_text
from isethdr_core.errors import MOST_LISTED
from isethdr_core.runs.run import Result, run
from isethdr_core.storage.home_folder import HOME
from isethdr_core.sweeps.score_order import differ, half_width_of_difference
from isethdr_core.sweeps.table import Scored
from isethdr_core.truth import variance_known

from .compare import Setting, stored_run, versions_that_differ
from .query import Homes

MOST_NUMBERS = 30  # greatest number of printed numbers


class Outcome(IntEnum):
    """Exit code of `isethdr reproduce`; 2 is a mistake of the user."""

    SAME = 0  # no number differs
    BEYOND = 1  # a number differs by more than its interval, or differs and has no interval
    WITHIN = 3  # numbers differ, all of them within their intervals


@dataclass(frozen=True)
class Difference:
    """One number that differs."""

    number: str  # camera and score, or camera and statistic of the picture
    stored: float
    again: float
    half_width: float  # half width of the 95 % interval of the difference; NaN if unknown
    beyond: bool | None  # whether the difference is larger than that; None if unknown

    @property
    def change(self) -> float:
        """The new number minus the stored one."""
        return self.again - self.stored

    @property
    def share(self) -> float:
        """The change over the half width of its interval; above 1 it is beyond the interval."""
        return abs(self.change) / self.half_width if self.half_width else math.inf


@dataclass(frozen=True)
class Reproduction:
    """The differences between a stored run and its repetition."""

    versions: list[Setting]  # versions and code that differ: A stored, B now
    compared: int  # number of compared numbers
    differences: list[Difference]

    @property
    def outcome(self) -> Outcome:
        """Whether the numbers are the same."""
        if any(difference.beyond is not False for difference in self.differences):
            return Outcome.BEYOND
        return Outcome.WITHIN if self.differences else Outcome.SAME


def reproduce(homes: Homes, name: str) -> Reproduction:
    """Repeat a stored run from its record, and compare scores and pictures.

    Parameters
    ----------
    homes : home folder, or several homes.
    name : first digits of the key of a run, or its name.

    Raises
    ------
    CatalogError : there is no such run, several stores match, or the store is damaged.
    IsetHdrError : the installed version cannot run its config.
    """
    stored = stored_run(homes, name)
    config = OmegaConf.create(with_radiance_of(stored) | {"report": False})
    with _temporary_home():
        again = run(config)
        versions = versions_that_differ(stored, again)
        before = _numbers(stored)
        after = _numbers(again)
    names = [*before, *(name for name in after if name not in before)]
    missing = Scored(math.nan, math.nan, math.nan)
    pairs = [(n, before.get(n, missing), after.get(n, missing)) for n in names]
    differences = [
        Difference(
            number,
            one.value,
            other.value,
            half_width_of_difference(one, other),
            differ(one, other),
        )
        for number, one, other in pairs
        if not _same(one.value, other.value)
    ]
    return Reproduction(versions, len(pairs), differences)


def with_radiance_of(stored: Result) -> dict[str, Any]:
    """Return the config of a stored run. If its scene names a store of radiance, the path of this
    store in the home of the run replaces the name, because a temporary home holds no scene.

    Parameters
    ----------
    stored : the stored run.
    """
    config: dict[str, Any] = dict(stored.attributes["config"])
    scene = config.get("scene")
    if not isinstance(scene, dict):
        return config
    named = str(scene.get("store") or "")
    if not named or named.endswith(".zarr"):
        return config
    folder = stored.path.resolve().parents[1] / "scenes"
    exact = folder / f"{named}.zarr"
    found = [exact] if exact.exists() else sorted(folder.glob(f"{named}*.zarr"))
    return config | {"scene": scene | {"store": str(found[0])}} if found else config


def print_reproduction(found: Reproduction) -> None:
    """Print the versions that differ, the numbers that differ, and which of these differ by more
    than their intervals.

    Parameters
    ----------
    found : differences between a stored run and its repetition.
    """
    print("versions and code that differ: stored | now" if found.versions else "the same versions")
    for version in found.versions:
        print_text(f"{version.name}: {version.a} | {version.b}", "  ", "      ")
    print()
    shown = sorted(found.differences, key=lambda d: d.beyond is False)[:MOST_NUMBERS]
    if shown:
        print_table(
            ["number", "stored", "now", "difference", "relative to interval"],
            [
                [d.number, f"{d.stored:.6g}", f"{d.again:.6g}", f"{d.change:.2g}", _share_text(d)]
                for d in shown
            ],
        )
    if len(found.differences) > len(shown):
        print(f"and {len(found.differences) - len(shown)} more")
    for title, verdict in (("beyond their intervals", True), ("without an interval", None)):
        names = [d.number for d in found.differences if d.beyond is verdict]
        if names:
            more = f"; and {len(names) - MOST_LISTED} more" * (len(names) > MOST_LISTED)
            print_text(f"{title}: {'; '.join(names[:MOST_LISTED])}{more}", hanging="    ")
    beyond = sum(d.beyond is not False for d in found.differences)
    print(
        f"{len(found.differences)} of {found.compared} numbers differ,"
        f" {beyond} of them beyond their intervals or without one"
    )


def _share_text(difference: Difference) -> str:
    return "" if math.isnan(difference.share) else f"{difference.share:.2g}"


def _same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))


def _numbers(result: Result) -> dict[str, Scored]:
    """Return all scores of a run with their intervals, and statistics of its pictures."""
    found = {}
    for score in result.scores:
        number = " ".join(filter(None, (score["camera"], score["metric"], score["object"])))
        values = (score[k] for k in Scored._fields)
        found[number] = Scored(
            *(float(v) if isinstance(v, int | float) else math.nan for v in values)
        )
    for camera in result.cameras:
        found |= _of_picture(result, camera)
    return found


def _of_picture(result: Result, camera: str) -> dict[str, Scored]:
    """Return statistics of Y, cd/m2, over the valid pixels.

    The interval of the mean is 1.96 standard errors to either side, from the variance that the
    picture states; pixels are taken as independent. A denoised picture states no variance, so its
    mean has no interval.
    """
    picture = result.open(f"picture/{camera}").load()
    valid = picture["valid"].values.astype(bool)
    luminance = picture["xyz"].values[..., 1][valid].astype(float)
    variance = picture["variance"].values[..., 1][valid].astype(float)
    if not luminance.size:
        return {}
    mean = float(luminance.mean())
    half = math.nan
    if variance_known(picture):
        half = 1.96 * math.sqrt(float(np.nansum(variance))) / luminance.size
    alone = {
        "smallest": float(luminance.min()),
        "largest": float(luminance.max()),
        "standard deviation": float(luminance.std()),
    }
    title = f"{camera} picture, cd/m2,"
    numbers = {f"{title} {k}": Scored(v, math.nan, math.nan) for k, v in alone.items()}
    return {f"{title} mean": Scored(mean, mean - half, mean + half)} | numbers


@contextmanager
def _temporary_home() -> Iterator[None]:
    """Use a temporary folder as home folder; remove it afterwards."""
    before = os.environ.get(HOME)
    with tempfile.TemporaryDirectory(prefix="isethdr-reproduce-") as folder:
        os.environ[HOME] = folder
        try:
            yield
        finally:
            os.environ.pop(HOME)
            if before is not None:
                os.environ[HOME] = before
