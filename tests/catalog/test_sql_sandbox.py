"""A query has access to the records only: no file, no network, no extension, no configuration."""

from __future__ import annotations

import json
import os
from pathlib import Path

import duckdb
import pytest
from isethdr_catalog import query
from isethdr_catalog.index import STATE, refresh
from isethdr_catalog.query import find, sql

from isethdr_core.errors import CatalogError

READS = [
    "SELECT * FROM read_text('{secret}')",
    "SELECT * FROM read_blob('{secret}')",
    "SELECT * FROM '{secret}'",
    "SELECT * FROM read_csv('{secret}')",
    "SELECT * FROM read_csv_auto('{secret}')",
    "SELECT * FROM read_json('{secret}')",
    "SELECT * FROM read_ndjson_objects('{secret}')",
    "SELECT * FROM read_parquet('{secret}')",
    "SELECT * FROM parquet_metadata('{secret}')",
    "SELECT * FROM parquet_schema('{secret}')",
    "SELECT * FROM sniff_csv('{secret}')",
    "SELECT * FROM glob('{folder}/*')",
    "CREATE TABLE t AS SELECT * FROM read_text('{secret}')",
    "COPY scratch FROM '{secret}'",
    "IMPORT DATABASE '{folder}'",
    "SELECT getenv('HOME')",
]
WRITES = [
    "COPY (SELECT 1) TO '{folder}/out.csv'",
    "COPY (SELECT 1) TO '{folder}/out.parquet' (FORMAT parquet)",
    "COPY shots TO '{folder}/out' (FORMAT csv, PER_THREAD_OUTPUT)",
    "COPY shots TO '{index}' (FORMAT parquet)",
    "COPY (SELECT 1) TO '{index}'",
    "COPY (SELECT 1) TO '/dev/stdout'",
    "EXPORT DATABASE '{folder}/out'",
    "PRAGMA enable_profiling='json'",
    "SET profiling_output='{folder}/out.json'",
    "SET log_query_path='{folder}/out.log'",
]
ATTACHES = [
    "ATTACH '{folder}/out.db'",
    "ATTACH '{folder}/out.db' AS other (READ_ONLY)",
    "ATTACH IF NOT EXISTS '{index}' AS other",
    "DETACH idx",
    "DETACH idx; ATTACH '{index}' AS idx; DELETE FROM idx.shots",
    "DELETE FROM idx.shots",
    "DROP TABLE idx.shots",
    "CREATE PERSISTENT SECRET s (TYPE http)",
]
EXTENSIONS = [
    "INSTALL httpfs",
    "FORCE INSTALL spatial",
    "INSTALL spatial FROM community",
    "INSTALL '{folder}/mine.duckdb_extension'",
    "LOAD httpfs",
    "LOAD '{folder}/mine.duckdb_extension'",
    "UPDATE EXTENSIONS",
]
NETWORK = [
    "SELECT * FROM read_csv('http://localhost:9/x.csv')",
    "SELECT * FROM read_parquet('s3://bucket/x.parquet')",
    "ATTACH 'http://localhost:9/x.db'",
    "COPY (SELECT 1) TO 'http://localhost:9/x.csv'",
]
SETTINGS = [
    "SET enable_external_access=true",
    "RESET enable_external_access",
    "SET lock_configuration=false",
    "SET GLOBAL lock_configuration=false",
    "SET allowed_directories=['/']",
    "SET allowed_paths=['{secret}']",
    "SET allow_unsigned_extensions=true",
    "SET temp_directory='{folder}/spill'",
    "SET python_enable_replacements=true",
    "PRAGMA enable_external_access=true",
]
MISTAKES = [
    "",
    ";",
    " ; ; ",
    "-- a comment alone",
    "SELECT",
    "SELECT nonsense FROM nowhere",
    "SELECT ?",
    "SELECT 'no end",
    "SELECT 1 / 'x'",
    "SELECT * FROM texts",  # a Python variable of the caller
    "\x00",
]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a home folder with one run and its index; a secret file lies next to the folder."""
    store = tmp_path / "home" / "runs" / "run0.zarr"
    store.mkdir(parents=True)
    attributes = {"format": 1, "complete": True, "kind": "run", "cameras": ["bayer"], "scores": []}
    metadata = {"zarr_format": 3, "node_type": "group", "attributes": attributes}
    (store / "zarr.json").write_text(json.dumps(metadata))
    (tmp_path / "secret").write_text("word\n1\n")
    refresh(tmp_path / "home")
    return tmp_path / "home"


def state_of(folder: Path) -> dict[Path, int]:
    """Return the modification time, ns, of each path in and next to a home.

    The home folder itself and the state of the index are left out, because a query may write them.
    """
    paths = {*folder.parent.rglob("*")} - {folder, folder / STATE}
    return {path: path.stat().st_mtime_ns for path in sorted(paths)}


@pytest.mark.slow
@pytest.mark.parametrize(
    "statements",
    [READS, WRITES, ATTACHES, EXTENSIONS, NETWORK, SETTINGS, MISTAKES],
    ids=["reads", "writes", "attaches", "extensions", "network", "settings", "mistakes"],
)
def test_every_statement_that_leaves_the_records_is_refused(folder: Path, statements: list[str]):
    before = state_of(folder)
    texts = duckdb.sql("SELECT 'a Python variable'")  # noqa: F841
    names = {
        "folder": folder,
        "secret": folder.parent / "secret",
        "index": folder / "index.duckdb",
    }
    for statement in statements:
        text = statement.format(**names)
        with pytest.raises(CatalogError, match=r"the query (does not run|is empty)"):
            sql(folder, text)
        if statements is not MISTAKES:
            with pytest.raises(CatalogError, match="the query does not run"):
                sql(folder, f"SELECT 1; {text}")
    assert state_of(folder) == before


def test_a_misspelt_column_is_one_line(folder: Path):
    with pytest.raises(CatalogError, match=r'"sensr" not found.*views: stores') as error:
        sql(folder, "SELECT sensr FROM scores")
    assert "\n" not in str(error.value)


def test_python_values_that_cannot_be_made_are_a_users_error(folder: Path):
    with pytest.raises(CatalogError, match="does not run"):
        sql(folder, "SELECT INTERVAL 40000000 YEARS")


def test_harmless_statements_still_run(folder: Path):
    assert sql(folder, "SELECT count(*) FROM shots;")[1] == [(1,)]
    assert sql(folder, "CREATE TEMP TABLE t AS SELECT 2 AS a; SELECT a FROM t")[1] == [(2,)]
    assert sql(folder, "DESCRIBE scores")[1]


@pytest.mark.parametrize("damage", ["columns", "cut off", "text", "directory"])
def test_an_index_that_is_not_ours_is_made_again(folder: Path, damage: str):
    index = folder / "index.duckdb"
    index.unlink()
    if damage == "columns":
        duckdb.sql("SELECT 1 AS id, 'evil' AS kind").write_parquet(str(index))
    elif damage == "directory":
        index.mkdir()
        (index / "x").write_text("x")
    else:
        index.write_bytes(b"PAR1" if damage == "cut off" else b"no parquet at all")
    newer = index.stat().st_mtime_ns + 10**12
    os.utime(index, ns=(newer, newer))
    if damage == "directory":
        with pytest.raises(CatalogError, match=r"index.duckdb"):
            refresh(folder)
    assert [row["id"] for row in find(folder, kind="run")] == ["run0"]


def test_the_configuration_is_locked_last():
    assert query.SANDBOX[-1] == "SET lock_configuration=true"
