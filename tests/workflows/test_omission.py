"""Runs that leave out what they do not need agree with runs that compute everything. The comparison
finds a difference if there is one.
"""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_measured.omission import omission
from isethdr_measured.omission.cases import (
    BY_GROUP,
    CASES,
    CHART,
    PICTURE,
    SHARP,
    TILES,
    Case,
    only,
)
from isethdr_measured.omission.compare import NOISE_SD, compared, largest
from isethdr_optics.psf import error_parts

from isethdr_core.errors import ConfigError
from isethdr_core.ledger import LeftOut, Row
from isethdr_core.pipeline.bands import BANDS
from isethdr_core.uncertainty import ledger


def test_there_are_ten_cases():
    assert len(CASES) == 10 and sum(case.rendered for case in CASES.values()) == 3


def test_a_case_without_noise_agrees_bit_for_bit():
    row = compared(
        "tiny",
        Case(
            (
                "scene=uniform",
                *CHART,
                *SHARP,
                "sensor=ideal",
                "sensor.rows=16",
                "sensor.columns=24",
                *only("snr"),
            )
        ),
        turns=1,
    )
    assert row["agree"] and row["difference_e"] == row["bound_e"] == 0.0
    assert row["left out"].split("; ") == [
        "display view of the scene",
        "99.9 % of the camera's field through the lens",
        "1532 of 1536 tiles of the field, beyond the middle 2 x 2",
        "3 more noise realisations",
    ]
    assert row["cpu_s"] > 0


def window(case, rows, columns):
    """Return a case with a sensor that keeps only the middle rows and columns."""
    overrides = (*case.overrides, f"sensor.rows={rows}", f"sensor.columns={columns}")
    return Case(overrides, case.rendered)


@pytest.mark.slow
def test_the_study_runs_both_ways_in_turn(monkeypatch):
    """With 160 x 240 pixels, runs that compute everything take twice as long."""
    one = {"ramp": window(CASES["ramp, soft knee, mean"], 160, 240)}
    monkeypatch.setattr("isethdr_measured.omission.CASES", one)
    [row] = omission()
    assert row["agree"] and row["case"] == "ramp" and row["ratio"] > 1


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, case in CASES.items() if not case.rendered])
def test_every_chart_agrees_with_the_run_that_computes_everything(name):
    """Lenses without blur image each pixel by itself, so a window tests as much as the picture."""
    case = CASES[name]
    if set(PICTURE) <= set(case.overrides):
        case = window(case, 320, 480)
    row = compared(name, case, turns=1)
    assert row["agree"], row


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.rendered])
def test_every_rendered_case_agrees_on_few_paths(name):
    """Runs with fewer groups, bands and tiles have the same bits of light, stored as finely.
    Through lenses without blur they have the same readings.

    The number of paths is fixed here. If paths were distributed by need, those that one group does
    not need would go to the others.
    """
    few = Case(
        (
            *(o for o in CASES[name].overrides if o not in (*TILES, *BY_GROUP)),
            "renderer.width=64",
            "renderer.height=36",
            "renderer.noise_share_allowed=null",
            "renderer.samples=8",
        ),
        rendered=True,
    )
    row = compared(name, few, turns=1)
    assert row["agree"] and (row["bound_e"] == 0.0 or "lens=ideal" not in few.overrides), row


def readings(electrons, rows=()):
    electrons = np.array([[electrons]], float)
    return {
        "electrons": electrons,
        "noise_e": np.full(electrons.shape, 10.0),
        "step_e": np.full((1, 1, 1), 2.0),
        "noisy": True,
        "ledger": rows,
    }


def test_what_may_differ_is_what_the_ledger_bounds():
    with ledger.stage(ledger.Ledger(), "lens l") as lens:
        ledger.error(0.1, NOISE_SD, "measured")
    # the bound is twice 0.1 of 10 e, plus one electron, plus one code of 2 e
    assert largest(readings([100.0, 104.0], [lens]), readings([100.0, 100.0]))[1] == pytest.approx(
        2 * 1.0 + 1 + 2, rel=1e-3
    )
    difference, bound = largest(readings([100.0, 109.0], [lens]), readings([100.0, 100.0]))
    assert difference == 9.0 > bound
    blind = Row(
        "plan",
        left_out=[LeftOut("some", "unseen", 1e-6, "e", BANDS, needless=True)],
    )
    assert largest(readings([100.0], [blind]), readings([100.0]))[1] == pytest.approx(3.0, rel=1e-3)
    assert largest(readings([100.0, 100.5]), readings([100.0, 100.0])) == (0.5, 0.0), (
        "nothing that could differ was left out"
    )


def test_only_kernels_of_different_accuracy_may_differ_by_their_errors():
    def lens(error):
        term = error_parts.term(error, "relative", "measured", "", key=error_parts.SPECKLE)
        with ledger.stage(ledger.Ledger(), "lens l") as row:
            ledger.record(term)
        return row

    usual = lens(0.02)
    fine = lens(0.01)
    other = readings([100.0], [fine])
    # twice the sum of both errors of 100 e, plus one electron, plus one code of 2 e
    assert largest(readings([100.0], [usual]), other)[1] == pytest.approx(2 * 3.0 + 1 + 2)
    assert largest(readings([100.5], [fine]), other) == (0.5, 0.0)


def test_reasons_that_are_no_omission_are_not_counted():
    unknown = Row(
        "sensor s",
        left_out=[LeftOut("position within a band", "it holds band means", 0.5, "e", BANDS)],
    )
    assert largest(readings([1.0], [unknown]), readings([1.0])) == (0.0, 0.0)


def test_an_unknown_case_is_refused():
    with pytest.raises(ConfigError, match="no case 'noon'"):
        omission("noon", rendered=0)
