"""The ledger: one row per stage, with seconds, memory, errors and omissions."""

from __future__ import annotations

import json
import mmap
import time

import pytest

from isethdr_core.ledger import Ledger
from isethdr_core.uncertainty import ledger


def test_a_row_holds_what_the_stage_stated():
    rows = Ledger()
    with ledger.stage(rows, "lens ideal"):
        ledger.error(0.03, "relative", "bound", "blur")
        ledger.left_out("group sky", "weight 0", 0.0, "cd/m2")
        time.sleep(0.05)
    [row] = rows
    assert row.stage == "lens ideal" and row.seconds >= 0.05
    assert (row.error, row.error_unit) == (0.03, "relative") and row.errors[0].how == "bound"
    assert row.left_out[0].what == "group sky" and row.left_out[0].bound == 0


def test_outside_a_run_nothing_is_recorded_and_nothing_fails():
    ledger.error(1.0, "e", "measured")
    ledger.left_out("a", "b", 0.0, "e")
    rows = Ledger()
    with ledger.stage(rows, "scene"):
        pass
    assert (
        rows[0].errors == []
        and rows[0].left_out == []
        and rows[0].error is None
        and rows[0].error_unit == ""
    )


def test_inner_stages_do_not_write_into_outer_rows():
    rows = Ledger()
    with ledger.stage(rows, "outer"):
        with ledger.stage(rows, "inner"):
            ledger.error(1.0, "e", "measured")
        ledger.error(2.0, "e", "measured")
    assert [(r.stage, r.error) for r in rows] == [("inner", 1.0), ("outer", 2.0)]


def test_a_stage_that_raises_still_has_its_row():
    rows = Ledger()
    with pytest.raises(ZeroDivisionError), ledger.stage(rows, "isp"):
        raise ZeroDivisionError
    assert rows[0].stage == "isp"
    ledger.error(1.0, "e", "measured")  # the row is closed: not recorded
    assert rows[0].errors == []


def test_peak_memory_is_seen(monkeypatch):
    looks = []
    resident_bytes = ledger._resident_bytes
    monkeypatch.setattr(ledger, "_resident_bytes", lambda: looks.append(1) or resident_bytes())
    rows = Ledger()
    with ledger.stage(rows, "small"):
        pass
    with ledger.stage(rows, "large"):
        # map fresh pages: the allocator may still hold memory of earlier tests, and use it again
        with mmap.mmap(-1, 160_000_000, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS) as block:
            for _ in range(160):
                block.write(bytes(1_000_000))
            before = len(looks)
            end = time.monotonic() + 600
            while len(looks) < before + 2 and time.monotonic() < end:  # one may have begun before
                time.sleep(0.01)
    assert rows[1].peak_bytes - rows[0].peak_bytes > 150e6 or rows[0].peak_bytes == 0


def test_records_survive_json():
    rows = Ledger()
    with ledger.stage(rows, "lens"):
        ledger.error(0.03, "relative", "bound", "blur")
        ledger.left_out("group sky", "weight 0", 0.0, "cd/m2")
    assert Ledger.from_records(json.loads(json.dumps(rows.as_records()))) == rows
