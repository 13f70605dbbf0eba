"""The memory estimate is the sum of what components state. A similar stored run adds what it took
beyond its own sum.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from isethdr_core import compose
from isethdr_core.cli.summary_tables import memory_text
from isethdr_core.pipeline import memory_estimate
from isethdr_core.pipeline.chain import chain, frame_of, plan
from isethdr_core.pipeline.memory_estimate import (
    PROGRAM,
    PROGRAM_BYTES,
    STATED,
    Expected,
    expected_memory,
    stated_parts,
)
from isethdr_core.runs.run import plain
from isethdr_core.uncertainty.ledger import Ledger

from .test_chain import SMALL

FAST = [*SMALL, "sensor=bayer", "report=false", "draws=1"]


@pytest.fixture(scope="module")
def planned():
    """Return the chain of a chart, its settings and its frame."""
    config = compose(FAST)
    parts = chain(config)
    return parts, plain(config), frame_of(parts, plan(parts, Ledger()))


def expected(planned, missing=None, **config):
    parts, settings, frame = planned
    return expected_memory(parts, {**settings, **config}, missing, frame)


def took(config, peak_bytes, stated_bytes, stage="lens ideal"):
    row = {"stage": stage, "peak_bytes": peak_bytes}
    return {"config": config, "ledger": [row], STATED: stated_bytes}


def stored(monkeypatch, *runs):
    monkeypatch.setattr(memory_estimate, "newest", lambda kind: runs)


def test_all_that_components_state_is_summed(planned, monkeypatch):
    stored(monkeypatch)
    parts, _, frame = planned
    found = expected(planned)
    assert found.parts[PROGRAM] == PROGRAM_BYTES
    assert {"light", "pixels of bayer"} <= found.parts.keys()
    assert found.total_bytes == sum(found.parts.values()) > PROGRAM_BYTES
    two = replace(parts, cameras={"a": parts.cameras["bayer"], "b": parts.cameras["bayer"]})
    assert stated_parts(two, frame, False)["pixels of b"] == found.parts["pixels of bayer"]
    assert stated_parts(parts, None, False) is None


class Renders:
    """A renderer that states its memory."""

    def memory_bytes(self, frame):
        return 1e9


def test_a_renderer_counts_where_it_renders(planned):
    parts, _, frame = planned
    rendered = replace(parts, renderer=Renders())
    assert stated_parts(rendered, frame, True)["renderer"] == 1e9
    assert "renderer" not in stated_parts(rendered, frame, False)


def test_what_a_similar_run_took_beyond_its_statement_is_added(planned, monkeypatch):
    settings = planned[1]
    stated = sum(expected(planned).parts.values())
    other_lens = {**settings, "lens": {"name": "other"}}
    rendered = {**settings, "renderer": {"name": "mitsuba"}}
    stored(
        monkeypatch,
        took(other_lens, 9e9, stated),  # nearer in size, but with another lens
        took(settings, 5e8, 2 * stated),
        took(rendered, 8e9, stated, "renderer mitsuba"),
        {"config": settings, "ledger": [{"stage": "plan", "peak_bytes": 7e9}]},  # earlier version
    )
    assert expected(planned).more_bytes == 5e8 - 2 * stated
    assert expected(planned, missing=object(), **rendered).more_bytes == 8e9 - stated


def test_the_text_lists_parts_from_the_largest_on():
    text = memory_text(Expected({"program": 1e8, "lens": 1.2e9, "light": 1e5}, 2e8))
    assert "1500 MB expected at the peak: lens 1200, program 100; a similar run took 200 m" in text
