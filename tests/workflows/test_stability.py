"""The stability study: no stage is wrong except where docs/measured/stability.md says so, and wrong
results are called wrong.
"""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_measured.stability import STAGES, lens, stability
from isethdr_measured.stability.dynamics import exact
from isethdr_measured.stability.verdict import Case, Measured, judged, relative

from isethdr_core.errors import ConfigError, IsetHdrError, UnitError

KNOWN: set[tuple[str, str]] = set()


@pytest.mark.slow  # 50 waves of defocus need many points of the pupil
def test_much_defocus_is_right():
    rows = [r for r in stability("lens") if "50.5 waves" in r["case"]]
    assert len(rows) == 3 and {r["verdict"] for r in rows} == {"right"}


# stages with cases that take a second or more
LONG = {"lens", "chain", "isp", "convolve", "sensor", "spectra"}


@pytest.mark.parametrize(
    "stage", [pytest.param(s, marks=[pytest.mark.slow] * (s in LONG)) for s in STAGES]
)
def test_no_stage_is_wrong_but_where_it_is_known(stage, monkeypatch):
    monkeypatch.setattr(lens, "DEFOCUS", lens.DEFOCUS[:2])
    rows = stability(stage)
    wrong = {(r["stage"], r["case"]) for r in rows if r["verdict"] == "WRONG"}
    assert wrong == {k for k in KNOWN if k[0] == stage}, [
        r for r in rows if r["verdict"] == "WRONG"
    ]
    assert len({r["case"] for r in rows}) == len(rows)
    assert {r["verdict"] for r in rows} <= {"right", "refused"}


def fails(error):
    def measure():
        raise error

    return measure


NEGATIVE = UnitError("light is negative; expected light, which never is")


@pytest.mark.parametrize(
    ("measure", "refused_with", "verdict"),
    [
        (lambda: Measured(1.0, 1.0, ""), None, "right"),
        (lambda: Measured(1.1, 1.0, ""), None, "WRONG"),
        (lambda: Measured(float("nan"), 1.0, ""), None, "WRONG"),
        # numpy warns during the measurement
        (lambda: Measured(float((np.zeros(1) / np.zeros(1)).size - 1), 1.0, ""), None, "WRONG"),
        (fails(NEGATIVE), UnitError, "refused"),
        (fails(NEGATIVE), IsetHdrError, "refused"),
        (fails(NEGATIVE), ConfigError, "WRONG"),  # another error than expected
        (fails(NEGATIVE), None, "WRONG"),  # it should have been right
        (lambda: Measured(0.0, 1.0, ""), UnitError, "WRONG"),  # it should have been refused
        (fails(UnitError("no")), UnitError, "WRONG"),  # the message explains nothing
        (fails(ValueError("a plain error of 25 characters or more")), UnitError, "WRONG"),
        (fails(ValueError("a plain error of 25 characters or more")), None, "WRONG"),
        (fails(ZeroDivisionError("division by zero, a long message")), None, "WRONG"),
    ],
)
def test_verdicts(measure, refused_with, verdict):
    assert judged("stage", Case("case", measure, refused_with))["verdict"] == verdict


def test_relative_wants_exact_darkness():
    assert relative([1.0, 0.0], [2.0, 0.0]) == 0.5
    assert relative([1e-300], [0.0]) == np.inf


def test_the_closed_form_of_a_well_agrees_with_its_limits():
    little, lost = exact(1.0, 1.0, 7000.0, 240.0, 4.4e5)  # far below the knee no charge is lost
    assert float(little) == pytest.approx(1.0, rel=1e-6) and float(little + lost) == pytest.approx(
        1.0, rel=1e-15
    )
    full, _ = exact(1e12, 1.0, 7000.0, 240.0, 4.4e5)  # far beyond: overflow = current
    assert float(full) == pytest.approx(7000 + 240 * np.log(1e12 / 4.4e5), rel=1e-12)


def test_an_unknown_stage_is_refused():
    with pytest.raises(ConfigError, match="did you mean 'lens'"):
        stability("lans")
