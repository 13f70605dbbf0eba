"""Sweep table: one row for each job and camera, with parameters, scores and intervals."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from ..errors import CatalogError
from ..runs.labels import read_labels
from ..storage import store
from .record import Job, Sweep, read_jobs
from .score_order import ROUNDING, differ, larger_is_better, most_telling_first

TABLE = "table.csv"
PAGE = "index.html"


class Scored(NamedTuple):
    """One score with its 95 % interval; NaN where it has none."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class SweepRow:
    """One camera of one job."""

    job: int  # number of the job, from 0
    parameters: dict[str, str]  # {varying parameter: its value, as typed}
    camera: str
    key: str  # key of the run
    seconds: float  # time that the job took
    scores: dict[str, Scored] = field(default_factory=dict)  # scores of the whole picture
    report: Path | None = None  # page of the run

    def described(self) -> str:
        """Return the parameters as they are typed, or the number of the job, from 1, if none."""
        return " ".join(f"{k}={v}" for k, v in self.parameters.items()) or f"job {self.job + 1}"


@dataclass(frozen=True)
class SweepTable:
    """The results of all finished jobs of a sweep."""

    sweep: Sweep
    jobs: list[Job]
    rows: list[SweepRow]
    units: dict[str, str]  # {score: its unit}, the most telling score first
    tags: tuple[str, ...] = ()

    @property
    def parameters(self) -> list[str]:
        """The names of the varying parameters."""
        return list(self.sweep.varied)

    @property
    def several_cameras(self) -> bool:
        """Whether a job has more than one camera."""
        return len({row.job for row in self.rows}) < len(self.rows)

    def values(self, parameter: str) -> list[str]:
        """Return the values of a parameter, in the order of the jobs."""
        return list(dict.fromkeys(row.parameters.get(parameter, "") for row in self.rows))


class Best(NamedTuple):
    """The best row by one score, and the number of rows that do not differ from it
    significantly.
    """

    score: str
    end: str  # "largest" or "smallest"
    is_known: bool  # whether this end is known to be the better one
    row: SweepRow
    alike: int  # number of rows that do not differ from it by more than the intervals


def sweep_table(sweep: Sweep) -> SweepTable:
    """Return the table of a sweep, read from the stores of the jobs that are done."""
    jobs = read_jobs(sweep.folder)
    rows: list[SweepRow] = []
    units: dict[str, str] = {}
    tags: dict[str, None] = {}
    for job in jobs:
        path = store.home() / "runs" / f"{job.key}.zarr"
        try:
            attributes = store.read_attrs(path) if job.key else {}
        except CatalogError:  # removed or damaged since
            attributes = {}
        if attributes:
            tags |= dict.fromkeys(read_labels(path).tags)
        # `+` before an added key is no part of its name
        parameters = dict(text.lstrip("+").partition("=")[::2] for text in job.overrides)
        report = path.with_suffix(".html")
        for camera in attributes.get("cameras", []):
            scores = {}
            for s in attributes["scores"]:
                if s["camera"] == camera and not s["object"]:
                    units.setdefault(s["metric"], s["unit"])
                    scores[s["metric"]] = Scored(*(_number(s[k]) for k in Scored._fields))
            rows.append(
                SweepRow(
                    job.number,
                    {key: parameters.get(key, "") for key in sweep.varied},
                    camera,
                    job.key,
                    job.seconds,
                    scores,
                    report if report.exists() else None,
                )
            )
    ordered = {name: units[name] for name in most_telling_first(list(units))}
    return SweepTable(sweep, jobs, rows, ordered, tuple(tags))


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def best_rows(table: SweepTable) -> list[Best]:
    """Return the best row by each score that varies; both ends if the better is not known."""
    best = []
    for score in table.units:
        rows = [r for r in table.rows if score in r.scores and math.isfinite(r.scores[score].value)]
        values = [row.scores[score].value for row in rows]
        if not values or math.isclose(min(values), max(values), rel_tol=ROUNDING):
            continue
        better = larger_is_better(score)
        for larger in (True, False) if better is None else (better,):
            row = (max if larger else min)(rows, key=lambda r: r.scores[score].value)
            best.append(
                Best(
                    score,
                    "largest" if larger else "smallest",
                    better is not None,
                    row,
                    sum(
                        differ(row.scores[score], rival.scores[score]) is False
                        for rival in rows
                        if rival is not row
                    ),
                )
            )
    return best


def as_csv(table: SweepTable) -> str:
    """Return the table as comma-separated values: parameters, then each score with its interval."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    names = [
        f"{score}{end}{f' ({unit})' if unit else ''}"
        for score, unit in table.units.items()
        for end in ("", "_low", "_high")
    ]
    writer.writerow(["sweep", "job", *table.parameters, "camera", "run", "seconds", *names])
    for row in table.rows:
        scores = [row.scores.get(s, Scored(math.nan, math.nan, math.nan)) for s in table.units]
        cells = ["" if math.isnan(v) else f"{v:.9g}" for s in scores for v in s]
        own = [row.parameters[p] for p in table.parameters]
        first = [table.sweep.name, row.job + 1, *own, row.camera, row.key, f"{row.seconds:.2f}"]
        writer.writerow([*first, *cells])
    return out.getvalue()


def short_names(parameters: Sequence[str]) -> dict[str, str]:
    """Return the last part of each dotted name if it is unique, otherwise the whole name."""
    last = [p.rpartition(".")[2] for p in parameters]
    return {p: end if last.count(end) == 1 else p for p, end in zip(parameters, last, strict=True)}
