"""Accuracy: error against run time of any configuration, by the accuracy knobs that its components
declare.

| file               | content                                                                  |
|--------------------|--------------------------------------------------------------------------|
| `configured_knobs` | the knobs of a composed configuration, and the settings to measure       |
| `stage_results`    | the chain stage by stage, with the CPU seconds of the stages             |
| `differences`      | error of a setting against the reference, in its own unit and in noise   |
| `summary`          | one row for each knob, for a terminal                                    |
| `point`            | one setting measured, and which settings no other beats                  |
| `kept_rows`        | rows that an earlier call of the same study has measured                 |
| `isp_cost`         | CPU seconds and memory of isps on one shot, each in a process of its own |
| `diagram`          | work-precision diagrams: error against seconds                           |
"""

from __future__ import annotations

import math
import sys
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import process_time
from typing import Any

from threadpoolctl import threadpool_limits

from isethdr_core.cli.progress import shown, track
from isethdr_core.cli.terminal import number_of
from isethdr_core.config.composition import compose
from isethdr_core.errors import CatalogError
from isethdr_core.pipeline.chain import chain, checked_config
from isethdr_core.storage import store
from isethdr_core.uncertainty.error_terms import Quantity

from .configured_knobs import ConfiguredKnob, Setting, chosen, configured_knobs, setting
from .diagram import check_library, draw
from .differences import Noise, difference, noise_of
from .kept_rows import TABLE, read_rows, row_key, write_rows
from .point import Point, Work
from .stage_results import SENSOR, Results, all_stages, measured, span

PICTURE = "accuracy.png"
REFERENCE = "reference"  # stands for the value in the job of a reference
SAME = "as the reference"
COLUMNS = 80  # width of printed text, characters
OF = {
    Quantity.PICTURE: "error of luminance, in standard deviations of the picture's noise",
    Quantity.SCORE: "error of scores, over half of their 95 % intervals",
}
OF_ELECTRONS = "error of electrons, in standard deviations of the sensor's noise"


@dataclass(frozen=True)
class Job:
    """One setting of one knob to measure."""

    configured: ConfiguredKnob
    setting: Setting
    value: Any
    is_reference: bool = False
    key: str = ""  # names the row among those of earlier calls; empty for a reference


@dataclass
class Study:
    """The state of a running study."""

    base: Results  # results of the configuration as it is
    noise: Noise
    allowed: float  # error allowed, as a share of the noise
    references: dict[str, Results] = field(default_factory=dict)

    def measure(self, job: Job) -> dict | None:
        """Run a job and return its row. The results of a reference are kept instead, without a row:
        None.
        """
        configured = job.configured
        knob = job.configured.knob
        first, last = span(configured.kind, knob.error_of)
        exact = job.is_reference and configured.exact
        measurement = measured(job.setting, self.base, first, last, exact)
        if job.is_reference:
            self.references[configured.name] = measurement.results
            return None
        off = difference(
            measurement.results, self.references[configured.name], knob.error_of, self.noise
        )
        row = {
            "knob": configured.name,
            "value": job.value,
            "now": job.value == configured.now,
            "error": off.own,
            "error_of_half": off.half,
            "unit": off.unit,
            "compared": str(off.compared),
            "error_of_noise": off.of_noise,
            "cpu_s": measurement.first_s,
            "cpu_s_again": measurement.again_s,
            "relative_cost": knob.relative_cost(job.value, configured.values()[0]),
            "part": knob.part or "",
            "reference": _written(configured),
            "allowed": self.allowed,
            "noise": "all" if self.noise.known else "shot noise alone",
        }
        return row


def accuracy(*overrides: str, knob: str = "", values: str = "", folder: str = "") -> list[dict]:
    """Measure error against run time for every accuracy setting of your configuration.

    The same call with the same code goes on where an earlier one was stopped.

    Parameters
    ----------
    overrides : overrides of the configuration, as for `isethdr run`: scene=... lens=...
    knob : name of one knob, for example lens.speckle_error; empty takes all.
    values : values of that knob, from the cheapest to the finest, for example 0.1,0.03; empty takes
        those that the component declares.
    folder : folder for accuracy.csv and accuracy.png; empty takes one in the home folder that is
        named by the other parameters.

    Returns
    -------
    rows with knob, value, now (whether the configuration has this value), error (largest error of
    99 % of the values) and error_of_half (of half of them) with their unit and the quantity
    compared, error_of_noise (largest error of 99 % of the pixels in standard deviations of the
    sensor's noise), cpu_s and cpu_s_again (CPU seconds of a first run without stored results, and
    of a second run directly after it), relative_cost (cost over that of the knob's first value by
    the component's model; NaN: not known), the part of the light, the reference, allowed (error
    that the configuration allows, as a share of the noise), and noise (whether all noise is known).

    Raises
    ------
    ConfigError : no component declares a knob, a component refuses a value of its knob, or the
        library that draws the diagrams is not installed.
    KeyboardInterrupt : after Ctrl-C; the rows measured so far are in the folder.
    """
    check_library()
    config = checked_config(compose(list(overrides)))
    base = Setting(config, chain(config))
    configured = chosen(configured_knobs(config, base.parts), knob, values)
    # all settings are built first, so that a wrong value is refused before any work
    jobs = [job for knob_found in configured for job in _jobs(base, knob_found)]
    into = _folder(folder, [*overrides, knob, values])
    last = max(
        SENSOR, *(span(knob_found.kind, knob_found.knob.error_of)[1] for knob_found in configured)
    )
    earlier = read_rows(into)
    kept = {job.key: earlier[job.key] for job in jobs if job.key in earlier}
    left = _left(jobs, kept)
    tried = sum(not job.is_reference for job in jobs)
    tell(f"{number_of(tried, 'setting')} of {', '.join(one.name for one in configured)}")
    if kept:
        tell(f"{len(kept)} of them were measured before; to measure them again, remove the folder")
        print(into, file=sys.stderr)  # `tell` would break a long path into lines
    try:
        if left:
            with threadpool_limits(1, "blas"):  # as in a run
                study = _of_base(base, last)
                for job in track(left, "settings"):
                    row = study.measure(job)
                    if row is not None:
                        kept[job.key] = row
                        # keep the rows of other knobs and values in the same folder
                        write_rows(into, earlier | kept, _ordered(jobs, kept))
    except KeyboardInterrupt:
        tell(
            f"stopped: {len(kept)} of {tried} settings are measured; type the same command again to"
            " continue"
        )
        raise
    finally:
        rows = _ordered(jobs, kept)
        if rows:
            draw(works(rows), into / PICTURE)
        tell("table and picture:")
        print(into, file=sys.stderr)
    return rows


def tell(text: str) -> None:
    """Print text to standard error, in lines of a terminal; the study's rows go to standard
    output.
    """
    print(textwrap.fill(text, COLUMNS), file=sys.stderr)


def works(rows: Sequence[dict]) -> list[Work]:
    """Return one diagram per knob: error in units of the noise against CPU seconds."""
    work_of: dict[str, Work] = {}
    for row in rows:
        error_of = OF.get(row["compared"], OF_ELECTRONS)
        work = work_of.setdefault(
            row["knob"],
            Work(
                row["knob"],
                error_of,
                row["reference"],
                math.nan,
                [],
                row["allowed"],
                math.inf,
                SAME,
            ),
        )
        mark = "now" if row["now"] else ""
        text = f"{row['value']:g}" if isinstance(row["value"], float) else str(row["value"])
        work.points.append(Point(text, row["error_of_noise"], row["cpu_s"], mark=mark))
    return list(work_of.values())


def _of_base(base: Setting, last: int) -> Study:
    """Run the configuration as it is, up to the stage number `last`, and say how long that took."""
    start_s = process_time()
    with shown("the configuration as it is"):
        results = all_stages(base, Results(), 0, last, exact=False)
    tell(
        f"the configuration as it is took {process_time() - start_s:.0f} CPU s; each setting"
        " runs its own stages twice, a renderer once. Is that too long? Stop with Ctrl-C, and"
        " choose a smaller frame, fewer bands, or one knob with knob=NAME"
    )
    return Study(results, noise_of(base, results), base.parts.allowed.noise_fraction)


def _jobs(base: Setting, configured: ConfiguredKnob) -> list[Job]:
    """Return the reference of a knob, and its settings from the cheapest to the finest."""
    reference = setting(base.config, configured, configured.reference)
    jobs = [Job(configured, reference, REFERENCE, is_reference=True)]
    for value in configured.values():
        one = setting(base.config, configured, {configured.name: value})
        key = row_key(base, reference, one, configured.name, value)
        jobs.append(Job(configured, one, value, key=key))
    return jobs


def _left(jobs: Sequence[Job], kept: Mapping[str, dict]) -> list[Job]:
    """Return the jobs without a row, and the references that these need."""
    needed = {job.configured.name for job in jobs if job.key and job.key not in kept}
    return [
        job
        for job in jobs
        if job.configured.name in needed and (job.is_reference or job.key not in kept)
    ]


def _ordered(jobs: Sequence[Job], kept: Mapping[str, dict]) -> list[dict]:
    """Return the rows in the order of the jobs."""
    return [kept[job.key] for job in jobs if job.key in kept]


def _written(configured: ConfiguredKnob) -> str:
    """Return the reference of a knob as the command line takes it."""
    listed = " ".join(f"{path}={value}" for path, value in configured.reference.items())
    return f"{listed} nothing left out".strip() if configured.exact else listed


def _folder(name: str, arguments: Sequence[str]) -> Path:
    """Return the folder of the study, which exists and can be written.

    Parameters
    ----------
    name : as typed; empty: the folder in the home folder that the arguments of the study name.
    arguments : overrides, knob and values, as typed.
    """
    folder_name = f"accuracy-{store.content_hash(list(arguments))[:8]}"
    folder = Path(name) if name else store.home() / "studies" / folder_name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / TABLE).touch()
    except OSError as err:
        raise CatalogError(
            f"cannot write into {folder}: {err.strerror}; choose another folder with folder=PATH"
        ) from err
    return folder
