"""Object homes: a published store is whole for every machine, whatever happens to its writers.

The bucket is kept in memory by obstore; two machines are two scratch folders.
"""

import os
import shutil
import threading
from datetime import timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
import xarray as xr
from isethdr_catalog import query, space
from isethdr_catalog.index import stores
from isethdr_catalog.verify import verify

from isethdr_core.cli import plan_summary
from isethdr_core.cli.home_option import use_home
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.runs.labels import Labels, add_labels, read_labels
from isethdr_core.storage import store
from isethdr_core.storage.home_folder import existing_home, existing_homes
from isethdr_core.storage.object_home.address import SCRATCH, Address, scratch_folder
from isethdr_core.storage.object_home.calls import (
    interrupted_uploads,
    kept_here,
    prepare_writing,
    remove_uploads,
)

pytest.importorskip("obstore")

from obstore.store import MemoryStore

from isethdr_core.storage.object_home import bucket as bucket_module
from isethdr_core.storage.object_home.bucket import Bucket
from isethdr_core.storage.object_home.scratch import pending, publish_pending

ADDRESS = Address.parsed("s3://bucket/lab")


@pytest.fixture
def bucket(monkeypatch):
    """Return a home in memory, which stands in for a home on an S3 server."""
    memory = Bucket(ADDRESS, MemoryStore())
    monkeypatch.setattr(bucket_module, "_bucket", lambda *_: memory)
    monkeypatch.setenv("ISETHDR_HOME", ADDRESS.url)
    return memory


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """Return a function that lets this process act as one of several machines."""

    def be(name):
        monkeypatch.setenv(SCRATCH, str(tmp_path / name))
        return store.home()

    return be


def picture(seed=0):
    values = np.random.default_rng(seed).random((20, 30)).astype(np.float32)
    return xr.Dataset({"luminance": (("y", "x"), values)})


def write(name="1f3a", seed=0, **attributes):
    attributes = {"kind": "run", "cameras": ["bayer"], "seed": seed, **attributes}
    return store.write_store(
        store.home() / "runs", name, {"picture/bayer": picture(seed)}, attributes
    )


def visible():
    """Return the names of the stores that this machine finds; a query would take longer."""
    return [path.stem for path in stores(existing_home()) if store.read_attrs(path)]


def keys(bucket, prefix=""):
    parts = ("catalog/", "runs/", "labels/", "probe/")
    return [e.key for part in parts for e in bucket.listing(part) if e.key.startswith(prefix)]


def test_queries_read_a_folder_and_an_object_home_at_once(bucket, machine, tmp_path, monkeypatch):
    machine("a")
    write(name="1f3a")
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "folder"))
    write(name="77c0")
    machine("b")
    homes = existing_homes([tmp_path / "folder", ADDRESS.url])
    rows = query.find(homes, kind="run", order_by="id")
    expected = [("1f3a", ADDRESS.url), ("77c0", str(tmp_path / "folder"))]
    assert [(row["id"], row["home"]) for row in rows] == expected
    assert query.path_of(rows[0], homes).exists()


def test_another_machine_finds_and_reads_what_was_written(bucket, machine):
    machine("a")
    write(name="1f3a")
    folder = machine("b")
    assert not (folder / "runs").exists()
    [row] = query.find(existing_home(), kind="run", camera="bayer")
    assert row["id"] == "1f3a" and query.show(folder, "1f3")["seed"] == 0
    path = folder / row["path"]
    assert not [p for p in path.rglob("c.*")]  # no pixel is kept here
    stored = store.open_store(path, "picture/bayer")
    assert np.array_equal(stored["luminance"].values, picture()["luminance"].values)
    assert store.find_complete(folder / "runs", "1f3a") == path
    with pytest.raises(CatalogError, match="groups it holds: 'picture', 'picture/bayer'"):
        store.open_store(path, "captures")


@pytest.mark.parametrize("failing", ["put_files", "create"])
def test_an_interrupted_upload_is_invisible_and_is_published_later(
    bucket, machine, monkeypatch, failing
):
    folder = machine("a")
    original = getattr(bucket, failing)

    def interrupted(first, *rest):
        if failing == "put_files":
            original(list(first)[:3])
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(bucket, failing, interrupted)
        with pytest.raises(KeyboardInterrupt):
            write()
    assert keys(bucket, "catalog/") == []
    # files of an upload that fails before the conditional write are removed at once; once that
    # write has started, its result is not known
    assert bool(keys(bucket)) == (failing == "create")
    machine("b")
    assert visible() == []
    machine("a")
    assert [p.stem for p in pending(folder)] == ["1f3a"]
    prepare_writing(folder)  # as the next run does
    assert pending(folder) == [] and keys(bucket, "catalog/") == ["catalog/runs/1f3a.json"]
    machine("b")
    assert visible() == ["1f3a"]


def test_only_old_uploads_that_no_catalog_names_are_removed(bucket, machine, monkeypatch):
    folder = machine("a")
    write(name="whole")
    with monkeypatch.context() as patch:
        patch.setattr(bucket, "create", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            write(name="half")
    assert interrupted_uploads(folder, timedelta(hours=24)) == [], "it may be under way"
    [upload] = interrupted_uploads(folder, timedelta(seconds=-60))
    assert upload.location.startswith("runs/half-") and upload.size > 1000
    remove_uploads(folder, [upload])
    assert all("half" not in key for key in keys(bucket))
    machine("b")
    assert visible() == ["whole"]


def test_files_that_the_bucket_holds_as_well_can_go(bucket, machine):
    folder = machine("a")
    path = write(name="1f3a")
    assert space.local_copies(folder) == [], "a run may be at work on it"
    os.utime(path, (1e9, 1e9))
    [copy] = space.local_copies(folder)
    [chunk] = [key for key in keys(bucket, "runs/") if "/luminance/c" in key]
    content = bucket.get(chunk).content
    bucket.delete([chunk])
    with pytest.raises(CatalogError, match="is missing"):
        space.release_copies([copy])
    assert (path / "picture/bayer/luminance/zarr.json").exists()
    bucket.create(chunk, content)
    assert space.release_copies([copy]) == copy.size
    assert not (path / "picture").exists() and space.local_copies(folder) == []
    stored = store.open_store(path, "picture/bayer")
    assert np.array_equal(stored["luminance"].values, picture()["luminance"].values)


def test_a_page_says_that_no_other_machine_has_it(bucket, machine, tmp_path):
    folder = machine("a")
    said = "page (on this machine only, not in s3://bucket/lab)"
    assert kept_here("page", folder / "sweeps" / "exposures" / "index.html") == said
    assert kept_here("page", tmp_path / "home" / "runs" / "1f3a.html") == "page"


def test_of_two_writers_of_one_store_the_first_counts_for_both(bucket, machine):
    first = machine("a")
    second = machine("b")
    machine("a")
    write(seed=1)
    machine("b")
    write(seed=2)  # does not know of the first one
    assert len({key.split("/")[1] for key in keys(bucket, "runs/")}) == 1
    for folder in (first, second):
        path = folder / "runs" / "1f3a.zarr"
        assert store.read_attrs(path)["seed"] == 1
        values = store.open_store(path, "picture/bayer")["luminance"].values
        assert np.array_equal(values, picture(1)["luminance"].values)
    machine("a")
    assert visible() == ["1f3a"]


def test_a_write_whose_answer_was_lost_is_recognised(bucket, machine, monkeypatch):
    machine("a")
    create = bucket.create
    monkeypatch.setattr(bucket, "create", lambda *args: create(*args) and False)
    path = write()
    machine("b")
    existing_home()
    values = store.open_store(store.home() / "runs" / path.name, "picture/bayer")["luminance"]
    assert np.array_equal(values, picture()["luminance"])


def test_many_writers_at_once_lose_nothing(bucket, machine, tmp_path):
    folders = [machine(name) for name in "abc"]
    names = [[f"{k:04x}" for k in range(start, start + 4)] for start in (0, 2, 4)]

    def work(folder, own):
        for name in own:
            store.write_store(folder / "runs", name, {"": picture()}, {"kind": "run"})

    threads = [
        threading.Thread(target=work, args=pair) for pair in zip(folders, names, strict=True)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name in "abc":
        machine(name)
        assert len(visible()) == 8
    assert len({key.split("/")[1] for key in keys(bucket, "runs/")}) == 8


def test_labels_of_two_machines_are_merged(bucket, machine, monkeypatch):
    machine("a")
    path = write()
    folder = machine("b")
    existing_home()
    other = folder / "runs" / path.name
    add_labels(path, Labels(tags=("wet",)))
    replace = bucket.replace
    late = iter([True])

    def overtaken(*args):
        if next(late, False):
            add_labels(path, Labels(tags=("night",)))  # between reading and writing
        return replace(*args)

    monkeypatch.setattr(bucket, "replace", overtaken)
    add_labels(other, Labels(name="first", tags=("dry",)))
    assert read_labels(other) == Labels("first", ("wet", "night", "dry"))
    machine("a")
    existing_home()
    assert read_labels(path) == Labels("first", ("wet", "night", "dry"))


def test_damage_in_the_bucket_is_an_error(bucket, machine):
    import obstore

    machine("a")
    write()
    folder = machine("b")
    existing_home()
    path = folder / "runs" / "1f3a.zarr"
    assert [r.problems for r in verify(folder)] == [()]
    [chunk] = [key for key in keys(bucket) if "luminance/c" in key]
    content = bytearray(bucket.get(chunk).content)
    content[len(content) // 3] ^= 1
    obstore.put(bucket.objects, chunk, bytes(content))
    with pytest.raises(CatalogError, match="damaged: picture/bayer/luminance/c"):
        store.open_store(path, "picture/bayer").load()
    [report] = verify(folder)
    assert "holds other bytes" in report.state
    bucket.delete([chunk])
    with pytest.raises(CatalogError, match="is missing"):
        store.open_store(path, "picture/bayer")


def test_a_removed_store_is_gone_everywhere(bucket, machine):
    folder = machine("a")
    write("1f3a")
    write("77c0")
    assert [(u.entries, u.part) for u in space.usage(folder)[:1]] == [(2, f"{ADDRESS.url}/runs")]
    machine("b")
    assert visible() == ["1f3a", "77c0"]
    space.remove_store(store.home(), store.home() / "runs" / "1f3a.zarr")
    assert {key.split("/")[1].split("-")[0] for key in keys(bucket, "runs/")} == {"77c0"}
    machine("a")
    assert visible() == ["77c0"]
    assert publish_pending(folder, ADDRESS) == []


def test_the_labels_of_a_removed_run_are_gone_everywhere(bucket, machine):
    machine("a")
    kept = write("1f3a")
    removed = write("77c0", 1)
    for path in (kept, removed):
        add_labels(path, Labels(tags=("wet",)))
    folder = machine("b")
    existing_home()
    assert read_labels(folder / "runs" / removed.name).tags == ("wet",)
    machine("a")
    space.remove_store(store.home(), removed)
    assert keys(bucket, "labels/") == ["labels/1f3a.labels.json"]
    machine("b")
    assert visible() == ["1f3a"]
    assert [p.name for p in (folder / "runs").glob("*.labels.json")] == ["1f3a.labels.json"]
    # a run of the same name has no labels of the removed one
    machine("a")
    assert read_labels(write("77c0", 1)) == Labels()


def test_a_removal_that_ends_at_any_request_leaves_a_run_whole_or_gone(
    bucket, machine, monkeypatch
):
    """The run is whole, or it is gone and the objects that are left of it belong to no run."""
    delete = bucket.delete
    for sent in range(3):
        machine(f"a{sent}")
        path = write("1f3a")
        add_labels(path, Labels(tags=("wet",)))
        rest = iter(range(sent))

        def killed(listed, rest=rest):
            if next(rest, None) is None:
                raise KeyboardInterrupt
            delete(listed)

        monkeypatch.setattr(bucket, "delete", killed)
        with pytest.raises(KeyboardInterrupt):
            space.remove_store(store.home(), path)
        monkeypatch.setattr(bucket, "delete", delete)
        folder = machine(f"b{sent}")
        there = visible()
        assert there == ([] if sent else ["1f3a"])
        if there:
            assert read_labels(folder / "runs" / path.name).tags == ("wet",)
            assert [r.problems for r in verify(folder)] == [()]
        delete(keys(bucket))


def test_a_server_without_conditional_writes_is_refused(bucket, machine, monkeypatch):
    folder = machine("a")
    monkeypatch.setattr(bucket, "create", lambda *_: True)
    with pytest.raises(CatalogError, match="ignores the condition If-None-Match"):
        prepare_writing(folder)
    assert keys(bucket) == []


class _Refuses(BaseHTTPRequestHandler):
    """Answers each request as S3 does without permission, or without a bucket."""

    status = 403
    code = "AccessDenied"

    def _answer(self):
        self.rfile.read(int(self.headers.get("Content-Length") or 0))
        text = f"<?xml version='1.0'?><Error><Code>{self.code}</Code></Error>".encode()
        self.send_response(self.status)
        self.send_header("Content-Type", "application/xml")
        self.send_header("Content-Length", str(len(text)))
        self.end_headers()
        self.wfile.write(text)

    do_GET = do_PUT = do_POST = do_DELETE = _answer

    def log_message(self, *_):
        pass


@pytest.mark.parametrize(
    "status, code, expected",
    [
        (403, "AccessDenied", "no permission to (write|list) objects in s3://bucket/lab"),
        (404, "NoSuchBucket", "there is no bucket 'bucket'"),
    ],
)
@pytest.mark.parametrize("command", ["run", "catalog"])
def test_a_bucket_that_refuses_is_one_error_before_the_work(
    monkeypatch, machine, status, code, expected, command
):
    handler = type("Refuses", (_Refuses,), {"status": status, "code": code})
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        settings = {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{server.server_port}",
            "AWS_ALLOW_HTTP": "true",
            "AWS_ACCESS_KEY_ID": "key",
            "AWS_SECRET_ACCESS_KEY": "secret",
            "AWS_REGION": "us-east-1",
            "ISETHDR_HOME": "",
        }
        for name, value in settings.items():
            monkeypatch.setenv(name, value)
        machine("a")
        bucket_module._bucket.cache_clear()
        with pytest.raises(CatalogError, match=expected):
            use_home(ADDRESS.url, command)
            existing_home()
        server.shutdown()
    bucket_module._bucket.cache_clear()


@pytest.mark.parametrize("text", ["s3://", "s3:///runs", "gs://bucket", "s3://b/../c", "s3://b//c"])
def test_an_address_of_another_kind_is_refused(text):
    with pytest.raises(ConfigError, match="expected a folder, or s3://bucket/prefix"):
        Address.parsed(text)


def test_each_server_and_address_has_its_scratch_folder(machine, monkeypatch):
    machine("a")
    one = scratch_folder(ADDRESS)
    assert one == scratch_folder(Address.parsed("s3://bucket/lab/"))
    assert one != scratch_folder(Address.parsed("s3://bucket/lab2"))
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://other")
    assert one != scratch_folder(ADDRESS)


def test_stores_come_back_after_visible_files_of_the_scratch_folder_were_removed(bucket, machine):
    """`rm -r FOLDER/*` leaves the hidden records of what was read from the bucket."""
    folder = machine("a")
    path = write()
    add_labels(path, Labels("first"))
    for entry in folder.glob("[!.]*"):
        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
    assert visible() == ["1f3a"] and read_labels(path) == Labels("first")
    stored = store.open_store(path, "picture/bayer")
    assert np.array_equal(stored["luminance"].values, picture()["luminance"].values)
    shutil.rmtree(path)
    assert visible() == ["1f3a"]


def test_a_plan_knows_the_stores_of_other_machines(bucket, machine, monkeypatch):
    machine("a")
    write()
    folder = machine("b")
    chart = ["scene=uniform", "~renderer", "lighting=ideal", "lens=ideal", "sensor=bayer"]

    def seen(*_):
        assert [path.name for path in (folder / "runs").iterdir()] == ["1f3a.zarr"]
        raise CatalogError("seen")

    monkeypatch.setattr(plan_summary, "plan", seen)
    with pytest.raises(CatalogError, match="seen"):
        plan_summary.print_plan(chart)
