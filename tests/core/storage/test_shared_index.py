"""Index of a bucket: it saves requests, and never decides what a home holds.

The bucket is kept in memory by obstore; two machines are two scratch folders.
"""

import json
import logging
from datetime import timedelta

import pytest

pytest.importorskip("obstore")

import obstore
from obstore.store import MemoryStore

from isethdr_core.errors import CatalogError
from isethdr_core.storage.home_folder import existing_home
from isethdr_core.storage.object_home import bucket as bucket_module
from isethdr_core.storage.object_home import index_segment, shared_index
from isethdr_core.storage.object_home.address import SCRATCH, Address, scratch_folder
from isethdr_core.storage.object_home.bucket import Bucket
from isethdr_core.storage.object_home.calls import prepare_writing
from isethdr_core.storage.object_home.index_segment import Segment, Version, packs
from isethdr_core.storage.object_home.index_upkeep import IndexUpkeep, tidy_index
from isethdr_core.storage.object_home.publication import Published, catalog_key, withdraw
from isethdr_core.storage.object_home.shared_index import INDEX, add, contents, segments
from isethdr_core.storage.object_home.shared_labels import merge_labels

ADDRESS = Address.parsed("s3://bucket/lab")
NOTHING_TO_DO = IndexUpkeep(0, 0, 0)


class CountedBucket(Bucket):
    """A bucket in memory that records which objects are read."""

    def __init__(self):
        super().__init__(ADDRESS, MemoryStore())
        self.read = []

    def get(self, key):
        self.read.append(key)
        return super().get(key)

    def objects_read(self):
        """Return how many objects outside the index were read since the last call."""
        read = [key for key in self.read if not key.startswith(INDEX)]
        self.read.clear()
        return len(read)


@pytest.fixture
def bucket(monkeypatch):
    counted = CountedBucket()
    monkeypatch.setattr(bucket_module, "_bucket", lambda *_: counted)
    monkeypatch.setattr(shared_index, "FEW", 0)  # use the index for a single store too
    monkeypatch.setattr(shared_index, "PAUSE_S", 0.0)
    monkeypatch.setenv("ISETHDR_HOME", ADDRESS.url)
    shared_index._say_ignored.cache_clear()
    return counted


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """Return a function that lets this process act as one of several machines."""

    def be(name):
        monkeypatch.setenv(SCRATCH, str(tmp_path / name))
        return scratch_folder(ADDRESS)

    return be


def publish(bucket, name, text="root", indexed=True):
    """Write the entry of a store without files, as a writer on another machine does."""
    entry = Published(f"runs/{name}-{text}.zarr", 0, json.dumps({"text": text}), "{}").encoded()
    etag = bucket.create(f"catalog/runs/{name}.json", entry)
    assert etag is not None
    if indexed:
        add(bucket, [Version(f"catalog/runs/{name}.json", etag, entry)])


def label(folder, name, text):
    (folder / "runs").mkdir(exist_ok=True)
    merge_labels(folder / "runs" / f"{name}.labels.json", ADDRESS, lambda _: text)


def here(folder):
    """Return the root metadata of the stores, and the labels, of a scratch folder."""
    stores = {
        path.stem: json.loads((path / "zarr.json").read_text())["text"]
        for path in (folder / "runs").glob("*.zarr")
    }
    labels = {p.name.split(".")[0]: p.read_text() for p in (folder / "runs").glob("*.labels.json")}
    return stores, labels


def indexed(bucket):
    """Return the objects whose current version the index holds."""
    listed = [*bucket.listing("catalog/"), *bucket.listing("labels/")]
    etags = {entry.key: entry.etag for entry in listed}
    read = [Segment.decoded(bucket.get(entry.key).content) for entry in segments(bucket)]
    versions = [version for segment in read if segment for version in segment.versions]
    return {version.key for version in versions if etags.get(version.key) == version.etag}


def test_a_segment_holds_any_bytes_and_tells_damage():
    versions = (Version("a", '"1"', b"text"), Version("b", '"2"', b"\xff\x00 no UTF-8 \xc3"))
    content = Segment(versions).encoded()
    assert Segment.decoded(content) == Segment(versions)
    assert Segment.decoded(Segment(closed=True).encoded()) == Segment(closed=True)
    for position in range(len(content)):
        damaged = bytearray(content)
        damaged[position] ^= 1
        assert Segment.decoded(bytes(damaged)) is None
        assert Segment.decoded(content[:position]) is None


def test_packs_hold_each_version_once(monkeypatch):
    monkeypatch.setattr(index_segment, "PACK_BYTES", 10)
    versions = [Version(str(k), "", b"1234") for k in range(7)]
    assert [len(pack) for pack in packs(versions)] == [3, 3, 1]
    assert [version for pack in packs(versions) for version in pack] == versions
    assert list(packs([])) == []


def test_a_new_machine_reads_the_index_only(bucket, machine):
    folder = machine("a")
    for k in range(5):
        publish(bucket, f"{k:04x}", text=f"root {k}")
    label(folder, "0003", "wet")
    bucket.read.clear()
    existing_home()
    stores, labels = here(folder)
    assert stores == {f"{k:04x}": f"root {k}" for k in range(5)}
    assert labels == {"0003": "wet"}
    assert len(bucket.read) == 1 and bucket.objects_read() == 0
    existing_home()
    assert bucket.read == []  # all is known


def test_what_the_index_lacks_is_read_and_completed_by_a_writer(bucket, machine):
    publish(bucket, "0001")
    publish(bucket, "0002", indexed=False)  # its writer was killed
    reader = machine("a")
    bucket.objects_read()
    existing_home()
    assert set(here(reader)[0]) == {"0001", "0002"}
    assert bucket.objects_read() == 1
    assert len(indexed(bucket)) == 1, "a reader writes nothing"
    prepare_writing(machine("b"))
    assert len(indexed(bucket)) == 2
    machine("c")
    bucket.objects_read()
    existing_home()
    assert bucket.objects_read() == 0


def test_entries_that_are_younger_than_all_segments_read_none(bucket, monkeypatch):
    """Segments that have not changed since a store was published cannot hold it."""
    publish(bucket, "0001")
    for name in ("0002", "0003"):
        publish(bucket, name, indexed=False)
    monkeypatch.setattr(shared_index, "CLOCKS", timedelta(0))
    [segment] = segments(bucket)
    later = [entry for entry in bucket.listing("catalog/") if entry.changed > segment.changed]
    keys = [entry.key for entry in later]
    assert sorted(keys) == ["catalog/runs/0002.json", "catalog/runs/0003.json"]
    bucket.read.clear()
    assert [version.key for version in contents(bucket, later)] == keys
    assert sorted(bucket.read) == sorted(keys)


def test_removed_and_changed_objects_are_not_read_from_the_index(bucket, machine):
    writer = machine("a")
    for name in ("gone", "again", "stays"):
        publish(bucket, name, text="before")
    label(writer, "stays", "dry")
    stale = bucket.get(segments(bucket)[0].key).content
    existing_home()
    for name in ("gone", "again"):
        store = writer / "runs" / f"{name}.zarr"
        withdraw(store, store.with_suffix(".labels.json"), ADDRESS)
    publish(bucket, "again", text="afterwards", indexed=False)
    label(writer, "stays", "wet")
    # restore the index as it was before these changes
    obstore.put(bucket.objects, segments(bucket)[0].key, stale)
    reader = machine("b")
    existing_home()
    stores, labels = here(reader)
    assert stores == {"again": "afterwards", "stays": "before"}
    assert labels == {"stays": "wet"}
    assert tidy_index(ADDRESS) == IndexUpkeep(added=2, removed=3, merged=1)
    assert indexed(bucket) == {
        catalog_key(reader / "runs/again.zarr"),
        catalog_key(reader / "runs/stays.zarr"),
        "labels/stays.labels.json",
    }
    assert tidy_index(ADDRESS) == NOTHING_TO_DO


@pytest.mark.parametrize("content", [b"", b"notes of somebody", b"isethdr index segment\n12345"])
def test_damage_is_named_in_one_line_and_mended(bucket, machine, caplog, content):
    for name in ("0001", "0002"):
        publish(bucket, name)
    [segment] = segments(bucket)
    obstore.put(bucket.objects, segment.key, content)
    obstore.put(bucket.objects, f"{INDEX}/notes.txt", b"of somebody")
    reader = machine("a")
    with caplog.at_level(logging.WARNING):
        existing_home()
    assert set(here(reader)[0]) == {"0001", "0002"}
    said = [record.getMessage() for record in caplog.records]
    assert sorted(said) == [
        f"ignored {segment.key} in {ADDRESS.url}: it is damaged; type isethdr catalog gc to repair"
        " the index",
        f"ignored {INDEX}/notes.txt in {ADDRESS.url}: it is no part of the index",
    ]
    assert tidy_index(ADDRESS, dry_run=True) == tidy_index(ADDRESS) == IndexUpkeep(2, 0, 1)
    assert len(indexed(bucket)) == 2
    assert segment.key not in {entry.key for entry in bucket.listing(f"{INDEX}/")}
    assert bucket.get(f"{INDEX}/notes.txt") is not None, "files of others stay"


def test_a_writer_overwrites_a_damaged_segment(bucket):
    publish(bucket, "0001")
    [segment] = segments(bucket)
    obstore.put(bucket.objects, segment.key, b"damaged")
    publish(bucket, "0002")
    assert [entry.key for entry in segments(bucket)] == [segment.key]
    assert indexed(bucket) == {"catalog/runs/0002.json"}


def test_a_lost_race_is_tried_again(bucket, monkeypatch):
    publish(bucket, "0001")
    replace = bucket.replace
    late = iter([True])

    def overtaken(*args):
        if next(late, False):
            publish(bucket, "0002")  # between reading and writing
        return replace(*args)

    monkeypatch.setattr(bucket, "replace", overtaken)
    publish(bucket, "0003")
    assert len(segments(bucket)) == 1
    assert len(indexed(bucket)) == 3


def test_who_loses_every_race_begins_a_segment(bucket, monkeypatch):
    publish(bucket, "0001")
    tries = []
    with monkeypatch.context() as patch:
        patch.setattr(bucket, "replace", lambda *_: tries.append(1))
        publish(bucket, "0002")
    assert len(tries) == shared_index.TRIES
    assert len(segments(bucket)) == 2
    assert len(indexed(bucket)) == 2
    assert tidy_index(ADDRESS) == IndexUpkeep(0, 0, merged=2)
    assert len(segments(bucket)) == 1
    assert len(indexed(bucket)) == 2


def test_nothing_is_added_to_a_full_segment(bucket, monkeypatch):
    monkeypatch.setattr(shared_index, "FULL_BYTES", 1)
    for k in range(3):
        publish(bucket, str(k))
    assert len(segments(bucket)) == len(indexed(bucket)) == 3


def test_a_failed_index_costs_reads_only(bucket, machine, monkeypatch, caplog):
    def refused(*_):
        raise CatalogError("no permission to write")

    with monkeypatch.context() as patch:
        patch.setattr(shared_index, "begin_segment", refused)
        publish(bucket, "0001")
    assert len(caplog.records) == 1 and "no permission to write" in caplog.text
    reader = machine("a")
    existing_home()
    assert set(here(reader)[0]) == {"0001"}


def test_upkeep_leaves_a_segment_that_a_writer_changes(bucket, monkeypatch):
    """A writer adds to a segment while it is merged: the segment stays, with its entry."""
    with monkeypatch.context() as patch:
        patch.setattr(shared_index, "FULL_BYTES", 1)
        publish(bucket, "0001")
        publish(bucket, "0002")
    create = bucket.create

    def overtaken(key, content):
        monkeypatch.setattr(bucket, "create", create)
        publish(bucket, "0003")  # after the segments were read, before they are closed
        return create(key, content)

    monkeypatch.setattr(bucket, "create", overtaken)
    tidy_index(ADDRESS)
    assert len(segments(bucket)) == 2  # the merged one, and the one that was changed
    assert len(indexed(bucket)) == 3
    tidy_index(ADDRESS)
    assert len(segments(bucket)) == 1
    assert len(indexed(bucket)) == 3


def test_nothing_is_added_to_a_closed_segment(bucket):
    publish(bucket, "0001")
    [segment] = segments(bucket)
    obstore.put(bucket.objects, segment.key, Segment(closed=True).encoded())  # upkeep was killed
    publish(bucket, "0002")
    assert indexed(bucket) == {"catalog/runs/0002.json"}
    assert len(segments(bucket)) == 2
    assert tidy_index(ADDRESS) == IndexUpkeep(added=1, removed=0, merged=2)
    assert len(segments(bucket)) == 1
    assert len(indexed(bucket)) == 2
