"""The cache of results stays below its bound, and never returns a changed result."""

import os
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from isethdr_core.storage.bounded_cache import BoundedCache, entries, trim

MB = 1_000_000
NAME = "0123456789abcdef"


def names(folder):
    return {entry.path.stem for entry in entries(folder)}


def test_a_result_is_what_was_kept_and_others_are_none(tmp_path):
    cache = BoundedCache(tmp_path / "cache", MB)
    assert cache.get(NAME) is None and not (tmp_path / "cache").exists()
    assert cache.put(NAME, {"light": np.arange(5.0)})
    np.testing.assert_array_equal(cache.get(NAME)["light"], np.arange(5.0))
    assert cache.get("fedcba9876543210") is None


def test_what_was_used_longest_ago_goes_first_and_the_bound_holds(tmp_path):
    cache = BoundedCache(tmp_path, MB)
    plane = np.random.default_rng(0).bytes(100_000)
    for k in range(30):
        assert cache.put(f"{k:016x}", plane.hex()[:100_000])
        os.utime(tmp_path / f"{k:016x}.result", ns=(k, k))  # distinct times, one per result
        if k > 1:
            assert cache.get(f"{0:016x}") is not None  # in use all the time
            os.utime(tmp_path / f"{0:016x}.result", ns=(k, k + 1))
        assert sum(entry.size for entry in entries(tmp_path)) <= MB
    kept = names(tmp_path)
    assert f"{0:016x}" in kept and f"{29:016x}" in kept and f"{1:016x}" not in kept
    assert len(kept) >= 8  # of 100 kB each: the bound is used


def test_what_is_too_large_or_not_worth_its_space_is_not_kept(tmp_path):
    cache = BoundedCache(tmp_path, MB)
    assert not cache.put(NAME, np.zeros(MB // 4, np.uint8))  # a quarter and a header: too much
    assert not cache.put(NAME, np.zeros(2000), worth_bytes=8000)
    assert not cache.put(NAME, object())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("harm", ["flipped bit", "cut", "empty", "another name", "older format"])
def test_a_damaged_file_is_not_served_and_is_removed(tmp_path, harm):
    cache = BoundedCache(tmp_path, MB)
    cache.put(NAME, np.arange(1000.0))
    path = tmp_path / f"{NAME}.result"
    other = "fedcba9876543210"
    data = bytearray(path.read_bytes())
    if harm == "flipped bit":
        data[len(data) // 2] ^= 4
    elif harm == "cut":
        del data[-1:]
    elif harm == "empty":
        data.clear()
    elif harm == "older format":
        data[15:16] = b"0"
    path.write_bytes(data)
    if harm == "another name":
        path = path.rename(tmp_path / f"{other}.result")
    assert cache.get(path.stem) is None
    assert not path.exists()


def test_a_folder_that_cannot_be_written_keeps_nothing_and_fails_nobody(tmp_path):
    file = tmp_path / "file"
    file.write_text("in the way")
    cache = BoundedCache(file / "cache", MB)
    assert not cache.put(NAME, 1.0)
    assert cache.get(NAME) is None


def test_trim_removes_all_but_what_is_allowed(tmp_path):
    cache = BoundedCache(tmp_path, MB)
    for k in range(4):
        cache.put(f"{k:016x}", np.zeros(4000))
    size = next(entries(tmp_path)).size
    assert len(trim(tmp_path, 2 * size)) == 2 and len(names(tmp_path)) == 2
    trim(tmp_path, 0)
    assert names(tmp_path) == set() and trim(tmp_path / "absent", 0) == []


def work(folder: Path) -> None:
    cache = BoundedCache(folder, 150_000)
    for k in range(100):
        found = cache.get(f"{k % 7:016x}")
        assert found is None or (found == k % 7).all(), found
        assert cache.put(f"{k % 7:016x}", np.full(4000, k % 7, float))


def test_processes_share_a_folder_that_is_too_small_for_all(tmp_path):
    """Seven results of 32 kB each share 150 kB, so that files are replaced and removed while other
    processes read them.
    """
    workers = [get_context("fork").Process(target=work, args=(tmp_path,)) for _ in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
    assert [worker.exitcode for worker in workers] == [0, 0, 0]
    assert not list(tmp_path.glob(".*.tmp"))
    assert 0 < len(names(tmp_path)) < 7


def test_a_damaged_file_in_a_folder_that_is_read_only_counts_as_absent(tmp_path, monkeypatch):
    cache = BoundedCache(tmp_path, MB)
    cache.put(NAME, 1.0)
    path = tmp_path / f"{NAME}.result"
    path.write_bytes(path.read_bytes()[:-1])

    def refused(path, missing_ok=False):
        raise PermissionError(13, "read-only")

    monkeypatch.setattr(Path, "unlink", refused)
    assert cache.get(NAME) is None
