"""Queries of the catalog over 20,000 and one million records, against DuckDB on a plain file.

The records are synthetic. Each has 150 properties, eight scores of the picture, four of objects,
and three objects, 5 kB as JSON. The 20,000 records are stores on disk, so a query includes the
check that no store is new. The million records are made from them inside the index, with other
names, seeds and scores; they have no stores.

For each query the table states the wall and CPU time (of all threads) of the library call, worst of
five; the times of the same query by DuckDB over a Parquet file of the records (properties as JSON),
worst of two; and the wall time of the command, which includes the start of Python. The targets are
for the CPU time of the library call: 50 ms for 20,000 records, 200 ms for a million. Run:

    python benchmarks/catalog_queries.py            # 20,000
    python benchmarks/catalog_queries.py million    # and a million, 2 GB of disk
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import duckdb
from isethdr_catalog import index, index_file, query

REPEATS = 5
REPEATS_PLAIN = 2  # repeats of the plain file, which takes most of the time
RECORDS = 20_000
COPIES = 50
SENSORS = ("bayer", "rgbw", "split_pixel")
LIGHTINGS = ("night_rural", "night_urban", "dusk", "day")
METRICS = ("valid_share", "saturated_share", "ssim", "ciede2000", "log_luminance_error")
MORE_METRICS = ("contrast_detection", "ssim_white", "ciede2000_white")
OF_OBJECTS = ("person", "car", "deer", "cyclist")
SETTINGS = 130  # number of further properties of a record


class Query(NamedTuple):
    """One query: as a call of the catalog, as SQL over a plain file, and as a command."""

    title: str
    ask: Callable[[Path], object]
    plain: str  # SQL over the Parquet file `records`
    command: tuple[str, ...]


def by_find(title: str, plain: str, *typed: str) -> Query:
    """Return a query that `find` answers."""
    conditions = dict(text.split("=", 1) for text in typed)

    def ask(home: Path) -> object:
        rest = dict(conditions)
        return query.find(home, rest.pop("order_by", None), **rest)

    return Query(title, ask, plain, ("find", *typed))


def by_sql(title: str, plain: str, text: str) -> Query:
    """Return a query that `sql` answers."""
    return Query(title, lambda home: query.sql(home, text), plain, ("sql", text))


PLACE = "properties->>'/{}'"
SHOWN = f"id, {PLACE.format('sensor')}"
QUERIES = (
    by_find(
        "runs of a sensor, best first",
        f"SELECT {SHOWN} FROM records WHERE kind = 'run' AND {PLACE.format('sensor')} = 'rgbw' AND"
        f" ({PLACE.format('ssim')})::DOUBLE >= 0.9 ORDER BY ({PLACE.format('ssim')})::DOUBLE DESC"
        " LIMIT 50",
        "kind=run",
        "sensor=rgbw",
        "ssim__ge=0.9",
        "order_by=-ssim",
    ),
    by_find(
        "scenes with a person within 30 m",
        f"SELECT {SHOWN} FROM records WHERE kind = 'scene' AND"
        f" ({PLACE.format('person.distance_m')})::DOUBLE <= 30 ORDER BY created DESC LIMIT 50",
        "kind=scene",
        "lighting=night_rural",
        "person.distance_m__le=30",
    ),
    by_find(
        "one seed",
        f"SELECT {SHOWN} FROM records WHERE ({PLACE.format('config.seed')})::DOUBLE = 1234"
        " ORDER BY created DESC LIMIT 50",
        "config.seed=1234",
    ),
    by_find(
        "a tag",
        f"SELECT {SHOWN} FROM records WHERE json_contains(properties->'/tags', '\"wet\"')"
        " ORDER BY created DESC LIMIT 50",
        "tags=wet",
    ),
    by_sql(
        "median score by sensor and lighting",
        f"SELECT {PLACE.format('sensor')}, {PLACE.format('lighting')},"
        f" median(({PLACE.format('ssim')})::DOUBLE) FROM records WHERE kind = 'run' GROUP BY ALL",
        "SELECT sensor, lighting, median(value) FROM scores WHERE metric='ssim' GROUP BY ALL",
    ),
    by_sql(
        "near persons",
        "SELECT id, o->>'name' FROM (SELECT id, unnest(from_json(objects, '[\"JSON\"]')) AS o"
        " FROM records) WHERE o->>'category' = 'person' AND (o->>'distance_m')::DOUBLE < 6"
        " ORDER BY (o->>'distance_m')::DOUBLE LIMIT 50",
        "SELECT id, name, distance_m FROM objects WHERE category='person' AND distance_m < 6"
        " ORDER BY distance_m LIMIT 50",
    ),
    by_sql(
        "two properties",
        f"SELECT ({PLACE.format('config.lens.f_number')})::DOUBLE,"
        f" avg(({PLACE.format('ssim')})::DOUBLE) FROM records WHERE kind = 'run' GROUP BY ALL",
        "SELECT \"config.lens.f_number\", avg(ssim) FROM properties WHERE kind='run' GROUP BY ALL",
    ),
)


def attributes(k: int) -> dict[str, object]:
    """Return the root attributes of record `k`: every tenth is a scene, the others are runs."""
    draw = random.Random(k)
    objects = [
        {
            "instance": i + 1,
            "category": category,
            "name": f"{category} {i}",
            "box": [draw.randrange(600), draw.randrange(300), 40, 60],
            "visible_fraction": draw.random(),
            "distance_m": draw.uniform(5, 80),
        }
        for i, category in enumerate(draw.sample(OF_OBJECTS, 3))
    ]
    settings = {
        f"setting_{n}_um": (k * (n + 1)) % 17 / 16 if n % 3 else 0.5 for n in range(SETTINGS)
    }
    common = {
        "format": 1,
        "complete": True,
        "created": f"2026-{1 + k % 12:02d}-{1 + k % 28:02d}T12:00:00+00:00",
        "objects": objects,
        "scene": {"component": "scene/night_drive", "seed": k % 500},
    }
    if k % 10 == 0:
        return common | {"kind": "scene", "recipe": f"{k:016x}", "renderer": settings}
    sensor = SENSORS[k % 3]
    lighting = LIGHTINGS[k // 3 % 4]
    scores = [
        {"camera": "a", "metric": m, "object": "", "value": draw.random(), "unit": "1"}
        for m in METRICS + MORE_METRICS
    ]
    scores += [
        {"camera": "a", "metric": "contrast", "object": o, "value": draw.random(), "unit": "1"}
        for o in OF_OBJECTS
    ]
    return common | {
        "kind": "run",
        "scene_ids": [f"r{k - k % 10:07d}"],
        "lighting": lighting,
        "lens": "diffraction_limited",
        "cameras": ["a"],
        "config": {
            "seed": k,
            "sensor": {"name": sensor, **settings},
            "lens": {"f_number": 1.4 + k % 7 / 5},
        },
        "scores": [s | {"low": s["value"] - 0.01, "high": s["value"] + 0.01} for s in scores],
        "warnings": [],
        "ledger": [{"stage": "lens", "seconds": 1.0}],
    }


def make(home: Path) -> None:
    """Make the stores, which hold root attributes only."""
    for k in range(RECORDS):
        found = attributes(k)
        part = home / ("runs" if found["kind"] == "run" else "scenes")
        store = part / f"r{k:07d}.zarr"
        store.mkdir(parents=True)
        whole = {"zarr_format": 3, "node_type": "group", "attributes": found}
        (store / "zarr.json").write_text(json.dumps(whole))
        if k % 100 == 1:
            labels = {"name": f"run_{k}", "tags": ["wet", "night"], "sweeps": []}
            store.with_suffix(".labels.json").write_text(json.dumps(labels))


def multiply(home: Path) -> None:
    """Make a million records from the 20,000 inside the index, with new names, seeds and scores."""
    path = home / index.INDEX
    with duckdb.connect() as base:
        base.execute(f"ATTACH '{path}' AS idx")
        known = index_file.properties(base)
        seed = known["config.seed"].column
        ssim = known["ssim"].column
        for table in ("shots", "scores", "object_scores", "objects", "store"):
            name = {"store": "path"}.get(table, "id")
            number = {"store": "number"}.get(table, "store")
            other = f"'c' || copy || '-' || {name} AS {name}, {number} + copy * 100000 AS {number}"
            if table == "shots":
                other += f", {seed} + copy * {RECORDS} AS {seed}, ({ssim} * copy) % 1 AS {ssim}"
            if table in ("scores", "object_scores"):
                other += ", (value * copy) % 1 AS value"
            base.execute(f"CREATE TABLE first AS SELECT * FROM idx.{table}")
            base.execute(
                f"INSERT INTO idx.{table} BY NAME SELECT * EXCLUDE (copy) REPLACE ({other}) FROM"
                f" first, range(1, {COPIES}) AS copies(copy)"
            )
            base.execute("DROP TABLE first")
    state = json.loads((home / index.STATE).read_text())
    (home / index.STATE).write_text(json.dumps(state | {"index": index._stamp(path)}))


def plain_file(home: Path) -> Path:
    """Write the records as a user without an index would: properties and objects as JSON."""
    path = home / "records.parquet"
    with duckdb.connect() as base:
        base.execute(f"ATTACH '{home / index.INDEX}' AS idx (READ_ONLY)")
        base.execute(
            "COPY (SELECT id, kind, created, properties, (SELECT to_json(list(o)) FROM idx.objects"
            f" AS o WHERE o.store = s.store) AS objects FROM idx.shots AS s) TO '{path}'"
        )
    return path


class Spent(NamedTuple):
    """The worst times of several calls, ms."""

    wall: float
    cpu: float


def worst(call: Callable[[], object], repeats: int = REPEATS) -> Spent:
    """Return the worst times of several calls after a first call that is not timed."""
    call()
    spent = []
    for _ in range(repeats):
        wall = time.perf_counter()
        cpu = time.process_time()
        call()
        spent.append((1e3 * (time.perf_counter() - wall), 1e3 * (time.process_time() - cpu)))
    return Spent(*map(max, zip(*spent, strict=True)))


def of_plain(records: Path, text: str) -> Spent:
    """Return the time that DuckDB takes for the same query over the plain Parquet file."""
    with duckdb.connect() as base:
        base.execute(f"CREATE VIEW records AS SELECT * FROM read_parquet('{records}')")
        return worst(lambda: base.execute(text).fetchall(), REPEATS_PLAIN)


def of_command(home: Path, words: tuple[str, ...]) -> float:
    """Return the wall seconds of the command, least of three; most is the start of Python."""
    environment = os.environ | {"ISETHDR_HOME": str(home)}
    call = [sys.executable, "-c", "from isethdr_core.cli.commands import main; main()"]
    spent = []
    for _ in range(3):
        start = time.perf_counter()
        subprocess.run(
            [*call, "catalog", *words], env=environment, check=True, stdout=subprocess.DEVNULL
        )
        spent.append(time.perf_counter() - start)
    return min(spent)


def report(home: Path, records: str, target_ms: float, commands: bool) -> bool:
    """Print one line for each query; return whether all targets were met."""
    plain = plain_file(home)
    size = (home / index.INDEX).stat().st_size / 1e6
    print(f"{records} records, index of {size:.0f} MB")
    print(f"ms, the worst of {REPEATS} calls; of the plain file, of {REPEATS_PLAIN}")
    head = f"{'query':37}{'wall':>7}{'CPU':>7}{'plain wall':>12}{'CPU':>8}{'ratio':>8}"
    print(head + (f"{'command s':>11}" if commands else ""))
    met = True
    for asked in QUERIES:
        own = worst(lambda asked=asked: asked.ask(home))
        other = of_plain(plain, asked.plain)
        line = f"{asked.title:37}{own.wall:7.1f}{own.cpu:7.1f}{other.wall:12.1f}{other.cpu:8.1f}"
        line += f"{own.cpu / other.cpu:8.3f}"
        print(line + (f"{of_command(home, asked.command):11.2f}" if commands else ""), flush=True)
        met &= own.cpu < target_ms
    print(f"target {target_ms:.0f} ms of CPU: {'met' if met else 'missed'}\n")
    return met


def main() -> int:
    """Measure all queries; return 1 if a target is missed."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        make(home)
        time.sleep(index.SETTLED_S + 1)  # until changes of the home count as settled
        start = time.process_time()
        query.find(home, kind="run", limit=1)
        print(f"first query, which reads all stores: {time.process_time() - start:.1f} CPU s")
        changed = worst(lambda: (index.forget(home), query.find(home, kind="run", limit=1)))
        print(f"query after a change of a folder: {changed.cpu:.0f} CPU ms\n")
        met = report(home, f"{RECORDS:,}", 50.0, commands=True)
        if sys.argv[1:] == ["million"]:
            query._KEPT.clear()  # closes the connection that holds the file open
            multiply(home)
            met &= report(home, f"{RECORDS * COPIES:,}", 200.0, commands=True)
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
