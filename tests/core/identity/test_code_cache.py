"""The file of a cache holds the newest records of several processes; a damaged file is replaced."""

from __future__ import annotations

import pytest

from isethdr_core.identity import code_cache
from isethdr_core.identity.code_cache import KeptTable


def saved(path, *records):
    """Write `records`, pairs of key and record, as one process does."""
    table = KeptTable(path)
    for key, record in records:
        table.put(key, record)
    table.save()


def test_records_of_two_processes_stay_and_the_later_record_of_a_key_counts(tmp_path):
    path = tmp_path / "folder" / "table.sqlite"
    saved(path, ("a", {"names": ["x", 1]}), ("b", 2))
    saved(path, ("b", 3), ("c", None))
    table = KeptTable(path)
    assert [table.get(key) for key in "abcd"] == [{"names": ["x", 1]}, 3, None, None]


def test_the_newest_records_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(code_cache, "MOST_ENTRIES", 3)
    path = tmp_path / "table.sqlite"
    saved(path, *((str(number), number) for number in range(4)))
    saved(path, ("1", 10))  # written again, so it is the newest
    saved(path, ("4", 4))
    table = KeptTable(path)
    assert [table.get(str(number)) for number in range(5)] == [None, 10, None, 3, 4]


@pytest.mark.parametrize("content", ["", "[]", "no database" * 100])
def test_a_damaged_file_is_empty_and_is_replaced(tmp_path, content):
    path = tmp_path / "table.sqlite"
    path.write_text(content)
    assert KeptTable(path).get("a") is None
    saved(path, ("a", 1))
    assert KeptTable(path).get("a") == 1


def test_nothing_is_kept_where_nothing_can_be_written(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    table = KeptTable(blocked / "table.sqlite")
    table.put("a", 1)
    table.save()
    assert table.get("a") == 1
    assert KeptTable(blocked / "table.sqlite").get("a") is None
    assert KeptTable(None).get("a") is None
