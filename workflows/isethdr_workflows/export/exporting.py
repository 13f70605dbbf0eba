"""From a selection to a folder: all checks first, then the files, then the manifest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

from isethdr_catalog.selection import StoredShot, select

import isethdr_core
from isethdr_core.cli.progress import track
from isethdr_core.cli.terminal import print_path, print_table
from isethdr_core.errors import CatalogError, ConfigError, did_you_mean
from isethdr_core.results.stored import open_run

from .formats import FORMATS
from .job import Item, Job, sha256
from .output_folder import MANIFEST, MARK, check_target, replaced

LAYOUT = 1  # version of the layout of the folder and its manifest


class Writer(Protocol):
    """The module of a format."""

    def check(self, job: Job) -> None:
        """Refuse pictures that the format cannot hold, without reading arrays."""

    def write(self, job: Job) -> None:
        """Write the files of all pictures of the job."""


def chosen(to: Sequence[str]) -> list[str]:
    """Return the names of the chosen formats in the order in which they are written.

    Parameters
    ----------
    to : names as typed; each text has one or more names, separated by commas.

    Raises
    ------
    ConfigError : a format is unknown, or none is named.
    """
    named = [name.strip() for text in to for name in text.split(",") if name.strip()]
    for name in named:
        if name not in FORMATS:
            raise ConfigError(f"there is no format {name!r}{did_you_mean(name, FORMATS)}")
    if not named:
        raise ConfigError(
            f"no format is named; expected some of {', '.join(FORMATS)}; type for example --to png"
        )
    return [name for name in FORMATS if name in named]


def exported(
    what: Sequence[str], folder: Path, to: Sequence[str], force: bool = False, **cards: str
) -> Job:
    """Write stored pictures as files of other programs; return the finished export.

    Parameters
    ----------
    what : runs, sweeps or conditions, as for `isethdr_catalog.selection.select`.
    folder : to make.
    to : names of formats, as typed.
    force : whether the folder of an earlier export is replaced.
    cards : `title` and `licence` of the data set, for its records.

    Raises
    ------
    ConfigError : a format is unknown.
    CatalogError : nothing is selected, a run lacks data that a format writes, or the folder cannot
        be made.
    UnitError : a format cannot hold the values.
    """
    names = chosen(to)
    check_target(folder, force)
    selection = select(what)
    items = in_order(selection.shots)
    job = Job(
        items=items,
        scenes=selection.scenes,
        folder=folder,
        title=cards.get("title") or folder.absolute().name,
        licence=cards.get("licence", ""),
        created=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    writers = {name: _writer(name) for name in names}
    for name, writer in writers.items():
        job.format = name
        if job.scenes and not FORMATS[name].of_scenes:
            raise CatalogError(
                f"the query finds {len(job.scenes)} scenes, and {name} writes pictures of runs;"
                " type kind=run, or --to radiance,depth,normals"
            )
        writer.check(job)
    with replaced(folder) as job.folder:
        for job.format, writer in writers.items():
            writer.write(job)
        _write_manifest(job, what)
    job.folder = folder
    return job


def in_order(shots: Sequence[StoredShot]) -> list[Item]:
    """Return the pictures to write, one sequence after the other, each in the order of the times of
    its scene; at the same time, in the order of keys and cameras. Runs of the same settings at
    different times are a sequence. Further runs of the same settings at the same time, whose
    exposures differ, go to further sequences, so that each sequence has each time once. Sequences
    are in the order of their first pictures.

    Parameters
    ----------
    shots : selected pictures.
    """
    # cameras of a run share it, and it is not opened again when its pictures are written
    runs = {path: open_run(path) for path in dict.fromkeys(shot.path for shot in shots)}
    found = [Item(0, shot, runs[shot.path]) for shot in shots]
    found.sort(key=lambda item: (item.time_s, item.shot))
    at_time: dict[tuple[str, float], list[Path]] = {}  # runs of the same settings and time
    numbers: dict[tuple[str, int], int] = {}
    numbered = []
    for item in found:
        paths = at_time.setdefault((item.settings, item.time_s), [])
        if item.shot.path not in paths:
            paths.append(item.shot.path)
        sequence = (item.settings, paths.index(item.shot.path))
        numbered.append((numbers.setdefault(sequence, len(numbers) + 1), item))
    numbered.sort(key=lambda pair: pair[0])  # stable: times stay in their order
    return [
        replace(item, number=number, sequence=sequence)
        for number, (sequence, item) in enumerate(numbered, 1)
    ]


def _writer(name: str) -> Writer:
    return cast(Writer, import_module(f".{FORMATS[name].module}", __package__))


def _write_manifest(job: Job, what: Sequence[str]) -> None:
    """Write the manifest: the list of all other files, with sizes and digests."""
    rows = []
    for written in track(job.files, "manifest"):
        path = job.folder / written.path
        row = {name: value for name, value in asdict(written).items() if value is not None}
        rows.append({**row, "bytes": path.stat().st_size, "sha256": sha256(path)})
    manifest = {
        MARK: LAYOUT,
        "title": job.title,
        "licence": job.licence,
        "created": job.created,
        "isethdr": isethdr_core.__version__,
        "selection": list(what),
        "files": rows,
    }
    job.format = ""
    job.write_json(MANIFEST, manifest)
    job.files.pop()  # the manifest is no file of a format


def run(what: Sequence[str], to: Sequence[str], force: bool, licence: str, title: str) -> None:
    """Export, and print the number of files of each format.

    Parameters
    ----------
    what : runs, sweeps or conditions; the folder comes last.
    to : names of formats, as typed.
    force : whether the folder of an earlier export is replaced.
    licence : licence of the files: an SPDX name or an address; "" states none.
    title : title of the data set; "" takes the folder's name.
    """
    *named, folder = what
    if not named or "=" in folder:
        raise ConfigError(
            f"no folder is named after {' '.join(what)}; type for example isethdr export"
            f" {' '.join(what)} my_export --to png"
        )
    job = exported(named, Path(folder).expanduser(), to, force, licence=licence, title=title)
    rows = []
    for name in dict.fromkeys(written.format for written in job.files):
        paths = [job.folder / written.path for written in job.files if written.format == name]
        size = sum(path.stat().st_size for path in paths)
        rows.append([name, len(paths), f"{size / 1e6:.3g}"])
    print_table(["format", "files", "MB"], rows)
    runs = _counted(len({item.key for item in job.items}), "run")
    pictures = f"{_counted(len(job.items), 'picture')} of {runs}"
    print(pictures if job.items else _counted(len(job.scenes), "scene"))
    print_path("exported", job.folder)


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
