"""An object home at a local S3 server: writers in processes of their own, some of them killed."""

import os
import signal
import subprocess
import sys
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
from isethdr_core.storage.object_home.address import SCRATCH, address_of
from isethdr_core.storage.object_home.bucket import bucket_of

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


@pytest.fixture
def s3(tmp_path, monkeypatch):
    """A bucket at a server of moto; the home of this process is in it."""
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    _, port = server.get_host_and_port()
    settings = {
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
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
    # servers of one process share what they hold
    for method, path in (("POST", "moto-api/reset"), ("PUT", "bucket")):
        urllib.request.urlopen(urllib.request.Request(f"{base}/{path}", method=method)).close()
    yield
    server.stop()


def writer(scratch, tag, names, die_at_write=0):
    """Start a process that writes stores, as one on another machine does.

    `die_at_write` : the write to the bucket at which it kills itself; 0 for none.
    """
    return subprocess.Popen(
        [sys.executable, "-c", WRITER, tag, *names],
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
    # the files of those who were second are removed again
    assert [(use.entries, use.part) for use in usage(folder)[:1]] == [(15, "s3://bucket/lab/runs")]
    values = np.random.default_rng(1).random((400, 400)).astype(np.float32)
    stored = store.open_store(folder / rows[0]["path"], "picture/bayer")
    assert np.array_equal(stored["luminance"].values, values)
    assert all(not report.problems for report in verify(folder))


def test_killed_writers_leave_nothing_or_the_whole(s3, tmp_path):
    names = [f"{k:016x}" for k in range(4)]
    # each store is six files, its entry in the catalog, and its labels
    for write in range(1, 17, 2):
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
