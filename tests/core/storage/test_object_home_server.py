"""An object home at a local S3 server: writers in processes of their own, some of them killed."""

import os
import re
import signal
import subprocess
import sys
import threading
import urllib.request

import numpy as np
import pytest

pytest.importorskip("obstore")
pytest.importorskip("moto.server", reason="a local S3 server; type make test-extras")

from isethdr_catalog import query
from isethdr_catalog.index import stores
from isethdr_catalog.space import usage
from isethdr_catalog.verify import verify

from isethdr_core.storage import store
from isethdr_core.storage.home_folder import existing_home
from isethdr_core.storage.object_home import shared_index
from isethdr_core.storage.object_home.address import SCRATCH, address_of
from isethdr_core.storage.object_home.bucket import bucket_of
from isethdr_core.storage.object_home.calls import prepare_writing
from isethdr_core.storage.object_home.index_segment import Segment
from isethdr_core.storage.object_home.index_upkeep import tidy_index
from isethdr_core.storage.object_home.publication import Published

pytestmark = pytest.mark.slow

WRITER = """
import itertools, os, signal, sys, numpy as np, xarray as xr
import obstore
from isethdr_core.storage import store
from isethdr_core.runs.labels import Labels, add_labels
put, count = obstore.put, itertools.count(1)
def put_or_die(*args, **kwargs):
    if next(count) == int(os.environ.get("DIE_AT_WRITE", 0)):
        os.kill(os.getpid(), signal.SIGKILL)
    return put(*args, **kwargs)
obstore.put = put_or_die
values = np.random.default_rng(1).random((400, 400)).astype(np.float32)
for name in sys.argv[2:]:
    path = store.write_store(
        store.home() / "runs",
        name,
        {"picture/bayer": xr.Dataset({"luminance": (("y", "x"), values)})},
        {"kind": "run", "cameras": ["bayer"], "writer": sys.argv[1]},
    )
    add_labels(path, Labels(tags=(sys.argv[1],)))
    print(name, flush=True)
"""


TINY_STORES = """
import sys, xarray as xr
from isethdr_core.storage import store
from isethdr_core.runs.labels import Labels, add_labels
for name in sys.argv[2:]:
    path = store.write_store(store.home() / "runs", name, {"": xr.Dataset()}, {"kind": "run"})
    add_labels(path, Labels(tags=(sys.argv[1],)))
"""


@pytest.fixture
def s3(tmp_path, monkeypatch):
    """Start a moto server with a bucket that holds the home of this process. Yield the list of
    requests, each as method and path with query.
    """
    from moto.server import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import WSGIRequestHandler, make_server

    application = DomainDispatcherApplication(create_backend_app)
    requests = []
    one_at_a_time = threading.Lock()

    class Silent(WSGIRequestHandler):
        def log_request(self, *_):
            pass

    def answered(environ, start_response):
        # moto tests the condition of a write and writes in two steps; Amazon S3 does so in one
        with one_at_a_time:
            path = f"{environ['PATH_INFO']}?{environ['QUERY_STRING']}"
            requests.append((environ["REQUEST_METHOD"], path))
            return application(environ, start_response)

    server = make_server("127.0.0.1", 0, answered, threaded=True, request_handler=Silent)
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    settings = {
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{server.server_port}",
        "AWS_ALLOW_HTTP": "true",
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_REGION": "us-east-1",
        "ISETHDR_HOME": "s3://bucket/lab",
        SCRATCH: str(tmp_path / "here"),
    }
    for name, value in settings.items():
        monkeypatch.setenv(name, value)
    base = settings["AWS_ENDPOINT_URL"]
    # all moto servers of one process share their content
    for method, path in (("POST", "moto-api/reset"), ("PUT", "bucket")):
        urllib.request.urlopen(urllib.request.Request(f"{base}/{path}", method=method)).close()
    requests.clear()
    yield requests
    server.shutdown()
    thread.join()


def writer(scratch, tag, names, die_at_write=0, script=WRITER):
    """Start a process that writes stores, as one on another machine does.

    `die_at_write` is the number of the write to the bucket at which it kills itself; 0 for none.
    """
    return subprocess.Popen(
        [sys.executable, "-c", script, tag, *names],
        env=os.environ | {SCRATCH: str(scratch), "DIE_AT_WRITE": str(die_at_write)},
        stdout=subprocess.DEVNULL,
    )


def test_two_writers_at_once_end_in_one_catalog(s3, tmp_path):
    names = [f"{k:016x}" for k in range(15)]
    one = writer(tmp_path / "one", "one", names[:10])
    two = writer(tmp_path / "two", "two", names[5:][::-1])
    assert (one.wait(300), two.wait(300)) == (0, 0)
    folder = existing_home()
    rows = query.find(folder, kind="run", limit=100)
    assert sorted(row["id"] for row in rows) == names
    assert len(query.find(folder, tags="one")) == len(query.find(folder, tags="two")) == 10
    both = {row["id"] for row in query.find(folder, tags="one")}
    both &= {row["id"] for row in query.find(folder, tags="two")}
    assert both == set(names[5:10])
    # files of the writer that came second are removed again
    assert [(use.entries, use.part) for use in usage(folder)[:1]] == [(15, "s3://bucket/lab/runs")]
    values = np.random.default_rng(1).random((400, 400)).astype(np.float32)
    stored = store.open_store(folder / rows[0]["path"], "picture/bayer")
    assert np.array_equal(stored["luminance"].values, values)
    assert all(not report.problems for report in verify(folder))


def test_killed_writers_leave_nothing_or_the_whole(s3, tmp_path):
    names = [f"{k:016x}" for k in range(4)]
    # each store takes ten writes: six files, its entry in catalog and index, and its labels in both
    for write in range(1, 21, 3):
        killed = writer(tmp_path / f"killed{write}", "one", names, die_at_write=write)
        assert killed.wait(120) == -signal.SIGKILL
        folder = existing_home()
        assert all(not report.problems for report in verify(folder))
        assert {p.stem for p in stores(folder)} <= set(names)
    assert writer(tmp_path / "killed1", "one", names).wait(120) == 0
    folder = existing_home()
    assert sorted(row["id"] for row in query.find(folder, limit=100)) == names
    assert all(not report.problems for report in verify(folder))
    bucket = bucket_of(address_of(folder))
    assert len(bucket.listing("catalog/")) == len(names)


def indexed(bucket):
    """Return the versions in the index of a bucket, as key and tag."""
    segments = [bucket.get(entry.key) for entry in shared_index.segments(bucket)]
    decoded = [Segment.decoded(stored.content) for stored in segments]
    return {(version.key, version.etag) for segment in decoded for version in segment.versions}


def versions(bucket):
    """Return the versions of the entries and labels of a bucket, as key and tag."""
    listed = [*bucket.listing("catalog/"), *bucket.listing("labels/")]
    return {(entry.key, entry.etag) for entry in listed}


def reads(requests):
    """Return the numbers of requests for listings, for the index and for other objects."""
    paths = [path for method, path in requests if method == "GET"]
    listings = [path for path in paths if "list-type=2" in path]
    of_index = [path for path in paths if re.match("/bucket/lab/index/", path)]
    return len(listings), len(of_index), len(paths) - len(listings) - len(of_index)


def test_two_writers_at_once_lose_no_entry_of_the_index(s3, tmp_path):
    names = [f"{k:016x}" for k in range(48)]
    both = [
        writer(tmp_path / tag, tag, names[start::2], script=TINY_STORES)
        for start, tag in enumerate(("one", "two"))
    ]
    assert [process.wait(300) for process in both] == [0, 0]
    bucket = bucket_of(address_of(existing_home()))
    assert len(versions(bucket)) == 2 * len(names)  # entries and labels
    assert versions(bucket) <= indexed(bucket)
    # one segment for each of the two writers, and rarely a third
    assert len(shared_index.segments(bucket)) <= 4


def test_what_a_killed_writer_did_not_add_is_completed(s3, tmp_path, monkeypatch):
    name = f"{1:016x}"
    killed = writer(tmp_path / "killed", "one", [name], die_at_write=8)
    assert killed.wait(120) == -signal.SIGKILL
    folder = existing_home()
    bucket = bucket_of(address_of(folder))
    assert [path.stem for path in stores(folder)] == [name]
    assert len(versions(bucket)) == 1 and indexed(bucket) == set()
    monkeypatch.setenv(SCRATCH, str(tmp_path / "killed"))
    prepare_writing(store.home())  # as the next command that writes does
    assert versions(bucket) == indexed(bucket)


def test_requests_of_a_new_machine_over_200_stores(s3, tmp_path, monkeypatch):
    bucket = bucket_of(address_of(store.home()))
    for k in range(200):
        entry = Published(f"runs/{k:04x}-.zarr", 0, "{}", "{}").encoded()
        bucket.create(f"catalog/runs/{k:04x}.json", entry)
    monkeypatch.setenv(SCRATCH, str(tmp_path / "before"))
    s3.clear()
    existing_home()
    assert reads(s3) == (3, 0, 200)  # lists catalog, labels and index, which is empty
    assert tidy_index(bucket.address).added == 200
    monkeypatch.setenv(SCRATCH, str(tmp_path / "afterwards"))
    s3.clear()
    folder = existing_home()
    assert reads(s3) == (3, 1, 0)
    assert len(stores(folder)) == 200
    # twenty stores that nobody has added to the index, and one that is gone
    for k in range(200, 220):
        entry = Published(f"runs/{k:04x}-.zarr", 0, "{}", "{}").encoded()
        bucket.create(f"catalog/runs/{k:04x}.json", entry)
    bucket.delete(["catalog/runs/0000.json"])
    monkeypatch.setenv(SCRATCH, str(tmp_path / "later"))
    s3.clear()
    folder = existing_home()
    assert reads(s3) == (3, 1, 20)
    assert len(stores(folder)) == 219
