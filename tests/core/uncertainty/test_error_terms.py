"""Error terms: code decides by their fields, old ledgers still load, and no figure of a picture is
smaller than a part of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from isethdr_core.data import quantities
from isethdr_core.ledger import Ledger, Row
from isethdr_core.uncertainty import error_terms, ledger, propagation
from isethdr_core.uncertainty.error_terms import DIRECT, SPREAD, ErrorNote, Quantity
from isethdr_core.uncertainty.propagation import (
    AFTER_RENDERER,
    RENDERER,
    SENSOR,
    UNIT,
    WHOLE,
    Electrons,
)

ROUNDING = 1e-6  # relative: figures are found by bisection to 1e-9


def shot_of(seed: int, capture: str = "a", pixels: int = 400, **fields) -> Electrons:
    """Return electrons over four decades, of which any share comes straight, and any noise of a
    renderer.
    """
    rng = np.random.default_rng(seed)
    total = 10.0 ** rng.uniform(0, 4, pixels)
    noise = rng.choice([0.0, 1.0]) * 10.0 ** rng.uniform(-3, 1) * rng.exponential(size=pixels)
    sigma = np.sqrt(total + 4.0)
    lit = rng.random(pixels) < rng.uniform(0.05, 1.0)
    return Electrons(
        capture, total, total * rng.random(pixels), sigma, noise * sigma, lit, 2.0, **fields
    )


def stated(shots, rows) -> list[ErrorNote]:
    with ledger.stage(Ledger(), "picture") as row:
        propagation.state(shots, rows, 0.1, (0.0, 0.0))
    return row.errors


NOTES = st.builds(
    ErrorNote,
    value=st.floats(0, 0.2),
    unit=st.sampled_from(
        [*propagation.RELATIVE, quantities.IRRADIANCE, "electrons", UNIT, "fraction of energy"]
    ),
    how=st.sampled_from(["measured", "bound", "statistical"]),
    what=st.sampled_from(["kernel", "radiance as stored", ""]),
    source=st.sampled_from(["", "a", "b", error_terms.KERNELS]),
    quantity=st.sampled_from(list(Quantity)),
    part=st.sampled_from(["", DIRECT, SPREAD, "light of a flare"]),
)
LEDGERS = st.lists(
    st.tuples(st.sampled_from(["scene s", "radiance", "lighting n", "lens l", "sensor c"]), NOTES),
    max_size=8,
)


@settings(max_examples=60, deadline=None)
@given(LEDGERS, st.integers(0, 10**6), st.booleans())
def test_no_figure_is_smaller_than_a_part_of_it(notes, seed, two):
    rows = [Row(stage, errors=[note]) for stage, note in notes]
    shots = [shot_of(seed + k, capture) for k, capture in enumerate("ab"[: 1 + two])]
    whole, *parts = stated(shots, rows)
    if not any(shot.unsaturated.any() for shot in shots):
        return
    assert whole.source == WHOLE and {note.source for note in parts} == {
        RENDERER,
        AFTER_RENDERER,
        SENSOR,
    }
    assert whole.value * (1 + ROUNDING) >= max(note.value for note in parts)
    for shot in shots:  # and the figure of every stage alone is at most that of all
        kept, _ = propagation.notes_after(rows)
        if shot.unsaturated.any():
            alone = [propagation.figures_of(shot, [note]).later for note in kept]
            assert (
                max(alone, default=0.0)
                <= propagation.figures_of(shot, kept).later * (1 + ROUNDING) + 1e-12
            )


@settings(max_examples=40, deadline=None)
@given(LEDGERS, st.integers(0, 10**6))
def test_labels_decide_nothing(notes, seed):
    rows, shot = [Row(stage, errors=[note]) for stage, note in notes], shot_of(seed)
    relabelled = [
        Row(stage, errors=[replace(note, what=f"other words {k}")])
        for k, (stage, note) in enumerate(notes)
    ]
    assert [n.value for n in stated([shot], rows)] == [n.value for n in stated([shot], relabelled)]


def test_the_headline_of_a_bound_and_of_two_deviations_in_closed_form():
    ones = np.ones(50)
    shot = Electrons("a", 1e4 * ones, 1e4 * ones, 100 * ones, 30 * ones, ones > 0, 2.0)
    rows = [Row("lens l", errors=[ErrorNote(0.4, UNIT, "statistical")])]
    whole, renderer, later, _ = (note.value for note in stated([shot], rows))
    # 99 % of normal deviates are within 2.5758 standard deviations: 0.3 and 0.4 of the noise,
    # together 0.5
    assert (renderer, later, whole) == pytest.approx((0.77274, 1.03032, 1.2879), rel=1e-4)
    rows = [
        Row(
            "lens l",
            errors=[ErrorNote(0.2, UNIT, "bound"), ErrorNote(1e-3, "relative", "measured")],
        )
    ]
    rows.append(
        Row(
            "sensor s",
            errors=[ErrorNote(2e-3, "relative", "measured", quantity=Quantity.ELECTRONS)],
        )
    )
    whole, renderer, later, sensor = (note.value for note in stated([shot], rows))
    assert sensor == pytest.approx(0.2, rel=1e-6)
    assert later == pytest.approx(0.3, rel=1e-6) and whole == pytest.approx(
        0.5 + renderer, rel=1e-6
    )


def test_an_error_acts_on_its_part_of_the_light_alone():
    ones = np.ones(4)
    shot = Electrons(
        "a",
        1000 * ones,
        700 * ones,
        ones,
        0 * ones,
        ones > 0,
        2.0,
        parts={"light of a flare": 20 * ones},
    )

    def bound(**fields):
        return propagation.after(shot, [ErrorNote(0.1, "relative", "bound", **fields)])[0][0]

    assert [
        bound(),
        bound(part=DIRECT),
        bound(part=SPREAD),
        bound(part="light of a flare"),
    ] == pytest.approx([100, 70, 30, 2])
    assert bound(part="light that nobody declared") == pytest.approx(
        100
    )  # no part is more than all light


def test_what_attributes_say_and_shapes_are_no_errors_of_a_pixel():
    for quantity in (Quantity.ATTRIBUTES, Quantity.POINT_SPREAD, Quantity.SCORE, Quantity.PICTURE):
        note = ErrorNote(0.3, "relative", "measured", "said", quantity=quantity)
        assert propagation.notes_after([Row("lens l", errors=[note])]) == ([], [note])


def test_a_sensor_states_errors_of_electrons_and_keeps_those_of_its_own():
    counted = ErrorNote(0.01, "relative", "bound", quantity=Quantity.ELECTRONS)
    own = ErrorNote(0.5, "electrons", "bound", "non-linearity")
    rows = [Row("sensor s", errors=[counted, own])]
    assert propagation.notes_of_sensor(rows) == [counted] and propagation.notes_after(rows) == (
        [],
        [],
    )


def test_a_ledger_stored_without_the_new_fields_loads():
    old = [
        {
            "stage": "lens l",
            "seconds": 1.0,
            "peak_bytes": 2,
            "left_out": [],
            "errors": [
                {
                    "value": 0.02,
                    "unit": "relative per tile",
                    "how": "statistical",
                    "what": "speckle",
                }
            ],
        }
    ]
    [row] = Ledger.from_records(old)
    assert (
        error_terms.part_of(row.errors[0]) == SPREAD and row.errors[0].quantity == Quantity.UNSTATED
    )


def test_declared_light_adds_up_and_is_not_stored():
    light = xr.DataArray(
        np.ones((1, 2, 2)), dims=("wavelength", "y", "x"), attrs={"units": quantities.IRRADIANCE}
    )
    with ledger.stage(rows := Ledger(), "lens l"):
        ledger.light_part("light of a flare", light)
        ledger.light_part("light of a flare", light.copy(data=2 * light.values))
    part = rows[0].light_parts["light of a flare"]
    assert part.light.attrs == light.attrs
    np.testing.assert_array_equal(part.light.values, 3.0)
    assert (
        "light_parts" not in rows.as_records()[0] and Ledger.from_records(rows.as_records()) == rows
    )
    ledger.light_part("outside a run", light)  # nobody listens: nothing fails
