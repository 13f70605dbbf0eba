"""Commands: `isethdr catalog find|sql|show|report|score|compare|verify|adopt|refresh|du|gc|rm`, on
the folder ISETHDR_HOME or ./runs. Those that only look something up read several homes.
"""

from __future__ import annotations

import sys
from datetime import timedelta
from importlib import import_module
from types import ModuleType
from typing import Any

import typer

from isethdr_core.cli.terminal import number_of, print_path, print_table
from isethdr_core.data.scores import UNLIKE_SHARES, are_unlike
from isethdr_core.errors import CatalogError
from isethdr_core.plugins.registry import build
from isethdr_core.storage.home_folder import existing_home as home
from isethdr_core.storage.home_folder import existing_homes as homes
from isethdr_core.storage.object_home.calls import (
    interrupted_uploads,
    kept_here,
    remove_uploads,
    tidy_index,
)

# columns with keys, names and paths, which users type again, so they are printed in full
TYPED = ("id", "name", "path", "derived_from", "home", "store")
SCENE = "scene.component"  # property that names the scene of a store, as "scene/street"
ALSO = (SCENE, "lighting")  # properties that `find` shows where no condition names a property
MOST_ROWS = 2**31 - 2  # one more is still a number of rows for DuckDB
UPLOADS_OLDER_H = 24.0  # longer than the upload of any file

catalog = typer.Typer(
    no_args_is_help=True, help="Find, query, check and index stored scenes and runs."
)


@catalog.command(
    help=(
        "List the stores that meet all conditions. Example: isethdr catalog find kind=run"
        " sensor=rgbw ssim__ge=0.9 --order-by ssim"
    )
)
def find(
    conditions: list[str] = typer.Argument(
        None, help="name=value or name__ge|le|gt|lt|ne|in=value"
    ),
    order_by: list[str] = typer.Option(
        [], help="sort by this property; --order-by=-ssim puts the largest first"
    ),
    limit: int = typer.Option(50, help="largest number of rows"),
) -> None:
    """Print one row per scene, and per camera of a run."""
    places = homes()
    if wrong := [c for c in conditions or () if "=" not in c]:
        raise CatalogError(
            f"{wrong[0]!r} is no condition; expected name=value, for example kind=run or"
            " person.distance_m__le=30"
        )
    pairs: dict[str, Any] = _query().typed_conditions(conditions or ())
    orders = [*order_by, *([pairs.pop("order_by")] if "order_by" in pairs else [])]
    if len(orders) > 1:
        raise CatalogError(
            f"{len(orders)} properties to sort by are typed; expected one; type for example"
            f" --order-by={orders[0]}"
        )
    limit = min(_count(pairs.pop("limit", limit)), MOST_ROWS)
    also = () if orders or pairs.keys() - {"kind"} else ALSO
    rows = _query().find(places, orders[0] if orders else None, limit + 1, also, **pairs)
    more = len(rows) > limit
    rows = rows[:limit]
    paths = list(dict.fromkeys(str(_query().path_of(row, places)) for row in rows))
    left_out = {"path"} | ({"kind"} & pairs.keys())  # a condition on kind gives all rows one kind
    left_out |= {name for name in ALSO if all(row.get(name) is None for row in rows)}
    rows = [{name: cell for name, cell in row.items() if name not in left_out} for row in rows]
    heads = ["scene" if name == SCENE else name for name in rows[0]] if rows else ["nothing found"]
    print_table(heads, [_cells(row) for row in rows], whole=TYPED)
    if remark := _remark_on_shares(rows):
        print(remark)
    if more:
        print(f"More rows match than the {limit} that are shown; type --limit {10 * limit or 50}.")
    if paths:
        print("\n".join(["paths:", *paths]))


def _cells(row: dict[str, Any]) -> list[Any]:
    """Return the cells of a row; a scene by its name alone."""
    return [
        cell.removeprefix("scene/") if name == SCENE and isinstance(cell, str) else cell
        for name, cell in row.items()
    ]


def _remark_on_shares(rows: list[dict]) -> str:
    """Return a remark if the rows show scores of pictures with unlike shares of valid pixels."""
    shares = [row["valid_share"] for row in rows if row.get("valid_share") is not None]
    if not are_unlike(shares):
        return ""
    return (
        f"Shares of valid pixels range from {min(shares):.2f} to {max(shares):.2f}, more than "
        f"{UNLIKE_SHARES:g} apart: these scores describe different parts of the frame."
    )


@catalog.command(
    help=(
        "Query the records with SQL. Views: stores, shots, properties, objects, scores,"
        ' object_scores. Example: isethdr catalog sql "select * from scores"'
    )
)
def sql(text: str) -> None:
    """Print the result of one DuckDB query."""
    columns, rows = _query().sql(homes(), text)
    print_table(columns, rows, whole=TYPED)


@catalog.command(
    help=(
        "Show all that is recorded about one store. NAME is its key, the first digits of the key,"
        " or a name."
    )
)
def show(name: str) -> None:
    """Print the root attributes as JSON."""
    print(_query().shown(homes(), name))


@catalog.command(
    help=(
        "Print the path of a run's report; write a missing one. NAME is the key of the run, its"
        " first digits, or a name."
    )
)
def report(name: str) -> None:
    """Print the path of the page, in the home folder of the run or in its scratch folder."""
    reports = import_module(".report.named_report", __package__)
    page = reports.named_report(homes(), name)
    print_path(kept_here("report", page), page)


@catalog.command(
    help=(
        "Score the stored pictures of a run by another metric. Example: isethdr catalog score 1f3a"
        " metric=ssim_pu21; fields of the metric follow as name=value."
    )
)
def score(
    name: str, asked: list[str] = typer.Argument(help="metric=name, then field=value")
) -> None:
    """Print one row per camera and score; nothing is stored."""
    from omegaconf import OmegaConf

    from .stored_scores import scores_of

    if wrong := [text for text in asked if "=" not in text]:
        raise CatalogError(
            f"{wrong[0]!r} has no value; expected name=value, for example metric=ssim_pu21"
        )
    fields = dict(OmegaConf.to_container(OmegaConf.from_dotlist(asked)))
    if "metric" not in fields:
        raise CatalogError("no metric is named; type for example metric=ssim_pu21")
    metric = build("metric", fields.pop("metric"), **fields)
    rows = scores_of(_query().show(homes(), name)["path"], metric)
    columns = ("camera", "metric", "object", "value", "unit", "low", "high")
    cells = [[row[column] for column in columns] for row in rows]
    # a score without an interval has empty cells
    print_table(columns, [[None if cell != cell else cell for cell in row] for row in cells])


@catalog.command(
    name="compare",
    short_help="Compare two runs: settings, scores, pictures.",
    help=(
        "Compare two runs, named by key, first digits or name. Prints the settings that differ and"
        " the scores that differ by more than their intervals, and writes a page with the pictures"
        " side by side."
    ),
)
def compare_runs(a: str, b: str) -> None:
    """Print the differences, and the path of the page."""
    from .comparison_summary import print_comparison

    print_comparison(homes(), a, b)


@catalog.command(help="Read every byte of every store. Exit code 1 if one is damaged.")
def verify() -> None:
    """Print one row per store."""
    from .verify import verify as check

    reports = check(home())
    rows = [[r.path.name, r.arrays, r.state] for r in reports]
    print_table(["store", "arrays", "state"], rows, whole=TYPED)
    damaged = [str(r.path) for r in reports if r.problems]
    if damaged:
        print("\n".join(["damaged:", *damaged]))
    if any(r.problems for r in reports):
        raise typer.Exit(1)


@catalog.command(help="Give stores of format 1 a manifest. Exit code 1 if one is not adopted.")
def adopt() -> None:
    """Print how many stores were adopted, and why others were not."""
    from .adopt import adopt as adopt_all

    adoptions = adopt_all(home())
    refused = [refusal for refusal in adoptions if refusal.reason]
    adopted = number_of(len(adoptions) - len(refused), "store")
    print(f"{adopted} adopted, {len(refused)} not")
    for refusal in refused:
        print(f"not adopted: {refusal.path}: {refusal.reason}")
    if refused:
        raise typer.Exit(1)


@catalog.command(
    help=(
        "Rebuild the index from the stores. find and sql do this by themselves when stores were"
        " added."
    )
)
def refresh() -> None:
    """Print how many records there are and which stores were skipped."""
    from .index import refresh as rebuild

    summary = rebuild(home())
    print_path(f"{number_of(summary.records, 'record')} in", summary.path)
    for path, why in summary.skipped.items():
        print_path(f"skipped ({why})", path)


@catalog.command(help="Show the disk space of each part; --stores lists every store.")
def du(stores: bool = typer.Option(False, help="list every store, the largest first")) -> None:
    """Print one row per part of the home folder, and with `stores` one per store."""
    from . import space

    folder = home()
    parts = space.usage(folder)
    rows = [[u.part, u.what, u.entries, _megabytes(u.size)] for u in parts]
    rows.append(["all", "", "", _megabytes(sum(u.size for u in parts))])
    print_table(["part", "what", "entries", "MB"], rows)
    if stores:
        sizes = {path: space.size_of(path) for path in space.stores(folder)}
        largest = sorted(sizes, key=lambda path: -sizes[path])
        cells = [[p.parent.name, p.stem, _megabytes(sizes[p])] for p in largest]
        print_table(["part", "store", "MB"], cells, whole=TYPED)


@catalog.command(
    help=(
        "Remove files that are made again when needed. --dry-run only lists them, --scenes adds"
        " radiance that no run has read and no dataset holds. In an object home interrupted uploads"
        " are removed as well, and the index of its bucket is completed;"
        " --copies adds local files of stores that the bucket holds."
    )
)
def gc(
    dry_run: bool = typer.Option(False, "--dry-run", help="list only, remove nothing"),
    scenes: bool = typer.Option(
        False, help="also remove radiance that no stored run has read and no dataset holds"
    ),
    copies: bool = typer.Option(
        False, help="also remove local files of stores that the bucket holds"
    ),
    uploads_older_h: float = typer.Option(
        UPLOADS_OLDER_H,
        min=1.0,
        help="least age of interrupted uploads to remove, in hours since their last file",
    ),
) -> None:
    """Print how much space was freed, or would be."""
    from . import space

    folder = home()
    items = space.removable(folder, scenes)
    kept_copies = space.local_copies(folder)
    together: dict[str, list[int]] = {}
    for item in items + (kept_copies if copies else []):
        together.setdefault(item.why, []).append(item.size)
    uploads = interrupted_uploads(folder, timedelta(hours=uploads_older_h))
    if uploads:
        why = f"upload in the bucket, interrupted over {uploads_older_h:g} h ago"
        together[why] = [upload.size for upload in uploads]
    rows = [[why, len(sizes), _megabytes(sum(sizes))] for why, sizes in together.items()]
    if dry_run:
        print_table(["would be removed", "entries", "MB"], rows)
    else:
        free = space.collect(folder, items) + (space.release_copies(kept_copies) if copies else 0)
        remove_uploads(folder, uploads)
        free += sum(upload.size for upload in uploads)
        print_table(["removed", "entries", "MB"], rows)
        print(f"{_megabytes(free)} MB freed")
    upkeep = tidy_index(folder, dry_run)
    if upkeep and any(upkeep):
        added = number_of(upkeep.added, "entry", "entries")
        removed = number_of(upkeep.removed, "stale entry", "stale entries")
        merged = number_of(upkeep.merged, "segment")
        verb = "would be" if dry_run else "were"
        print(f"index of the bucket: {added} {verb} added, {removed} removed, {merged} merged")
    unread: list[space.Removable] = []
    if not scenes:
        try:
            unread = space.unread_scenes(folder)
        except CatalogError as error:  # the removal asked for is done
            print(f"radiance that no run has read is not counted: {error}")
    if unread:
        size = _megabytes(sum(item.size for item in unread))
        scenes_kept = number_of(len(unread), "scene")
        print(f"kept: {scenes_kept} that no run has read, {size} MB; type --scenes to remove them")
    if kept_copies and not copies:
        size = _megabytes(sum(item.size for item in kept_copies))
        print(
            f"both on this machine and in the bucket: {number_of(len(kept_copies), 'store')},"
            f" {size} MB on this machine; type --copies to remove the local files"
        )


@catalog.command(help="Remove one run or scene. NAME is its key, or the first digits.")
def rm(
    name: str,
    yes: bool = typer.Option(False, "--yes", "-y", help="do not ask for confirmation"),
    force: bool = typer.Option(
        False, help="also remove radiance that runs have read or datasets hold"
    ),
) -> None:
    """Print the removed path; exit with code 1 if the user answers no.

    Parameters
    ----------
    name : name of the store, or its first digits.
    yes : whether to remove without asking.
    force : whether to remove radiance that runs have read or datasets hold.
    """
    from . import space

    folder = home()
    path = space.find_one(folder, name)
    users = space.dependents(folder, path)
    if force or not users.is_any:
        size = _megabytes(space.size_of(path))
        if not yes and sys.stdin is None:
            raise CatalogError(
                "no standard input, from which the answer to a question could be read; expected an"
                " answer or --yes; add --yes to the command"
            )
        if not (yes or typer.confirm(f"remove {path.parent.name}/{path.name}, {size} MB?")):
            raise typer.Exit(1)
    free = space.remove_store(folder, path, force)
    print_path(f"removed, {_megabytes(free)} MB freed", path)


REPRODUCE_HELP = (
    "Repeat a stored run from its record. Lists versions and numbers that differ. Exit code 0: no"
    " number differs; 3: all are within their intervals; 1: one differs by more. Nothing that is"
    " stored changes."
)


def reproduce_run(name: str) -> None:
    """Print which versions and numbers differ."""
    from .reproduce import print_reproduction, reproduce

    found = reproduce(homes(), name)
    print_reproduction(found)
    if found.outcome:
        raise typer.Exit(int(found.outcome))


def _query() -> ModuleType:
    """Import the module of queries, which takes long, and return it."""
    from . import query

    return query


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f}"


def _count(text: str | int) -> int:
    """Return a number of rows that a user typed."""
    if not str(text).isdecimal():
        raise CatalogError(
            f"limit is {text!r}; expected a whole number of rows; type for example limit=50"
        )
    return int(text)
