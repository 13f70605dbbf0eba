"""The ledger: one row per stage, with seconds, memory, errors and omissions."""

from __future__ import annotations

import json
import mmap
import time

import pytest

from isethdr_core.errors import PluginError
from isethdr_core.ledger import Ledger
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.error_terms import ErrorTerm, Quantity, Source


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


@pytest.mark.parametrize("value", [-0.2, float("nan")])
def test_an_error_without_a_size_is_refused(value):
    said = "lens acme: the error 'veil' has the value .*; type abs\\(value\\), or math.inf"
    term = ErrorTerm(Source(key="veil"), Quantity.IRRADIANCE, None, value, "relative", "bound")
    with ledger.stage(Ledger(), "lens acme"):
        with pytest.raises(PluginError, match=said):
            ledger.error(value, "relative", "bound", "veil")
        with pytest.raises(PluginError, match=said):
            ledger.record(term)
    with pytest.raises(PluginError, match="^the error 'veil' has"):  # a test of a plugin sees it
        ledger.error(value, "relative", "bound", "veil")


def test_an_error_that_is_known_in_an_unknown_way_is_refused():
    with pytest.raises(PluginError, match="how='maximum'; expected one of 'measured', 'bound',"):
        ledger.error(0.1, "relative", "maximum", "veil")


def test_errors_of_stored_ledgers_are_restated_as_they_are():
    source = Source("lens", "acme")
    term = ErrorTerm(source, Quantity.IRRADIANCE, None, -0.2, "relative", "bound", "veil")
    with ledger.stage(rows := Ledger(), "radiance"):
        ledger.record(term)
        ledger.error(float("inf"), "relative", "bound", "not known")
    assert [e.value for e in rows[0].errors] == [-0.2, float("inf")]
