"""Error terms: code uses their fields and not their labels, old ledgers still load, and no figure
of a picture is smaller than a part of it.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from isethdr_core.data import quantities
from isethdr_core.errors import PluginError
from isethdr_core.ledger import Ledger, Row
from isethdr_core.pipeline.demand import Demand
from isethdr_core.runs.radiance_cache import joined_radiance
from isethdr_core.runs.sample_accumulation import Known
from isethdr_core.uncertainty import error_terms, ledger, propagation
from isethdr_core.uncertainty.earlier_terms import DIRECT, SPREAD, ErrorNote, maps_of
from isethdr_core.uncertainty.error_terms import ErrorTerm, Quantity, Source
from isethdr_core.uncertainty.propagation import (
    AFTER_RENDERER,
    RENDERER,
    SENSOR,
    UNIT,
    WHOLE,
    Electrons,
)

from ..stated_rows import row, said

ROUNDING = 1e-6  # relative tolerance: figures are found by bisection to 1e-9
LENS = Source("lens", "l")


def shot_of(seed: int, capture: str = "a", pixels: int = 400, **fields) -> Electrons:
    """Return random electrons over four decades, with random shares of direct light, of renderer
    noise and of unsaturated pixels.
    """
    rng = np.random.default_rng(seed)
    total = 10.0 ** rng.uniform(0, 4, pixels)
    noise = rng.choice([0.0, 1.0]) * 10.0 ** rng.uniform(-3, 1) * rng.exponential(size=pixels)
    sigma = np.sqrt(total + 4.0)
    lit = rng.random(pixels) < rng.uniform(0.05, 1.0)
    image = total * rng.random(pixels)
    parts = {"halo": np.maximum(total - image, 0.0)}
    return Electrons(capture, total, image, sigma, noise * sigma, lit, 2.0, parts=parts, **fields)


def stated(shots, rows) -> list[ErrorTerm]:
    with ledger.stage(Ledger(), "picture") as row:
        propagation.record_figures(shots, rows, 0.1, propagation.Seconds(0.0, 0.0))
    return row.errors


# labels: words by which code might wrongly decide, and texts that are not words
LABELS = st.sampled_from(
    [
        "",
        "renderer",
        "ghosts",
        "halo",
        "lens l, light of one flare",
        "0.5 relative",
        "nan",
        "é {}\n",
    ]
)
TERMS = st.builds(
    ErrorTerm,
    source=st.builds(
        Source,
        st.sampled_from(["scene", "renderer", "radiance", "lighting", "lens", "sensor"]),
        st.sampled_from(["n", "m"]),
        st.sampled_from(["", "a", "b"]),
    ),
    acts_on=st.sampled_from(list(Quantity)),
    part=st.sampled_from([None, "halo", "light that nobody declared"]),
    value=st.floats(0, 0.2),
    unit=st.sampled_from([*propagation.UNITS, "fraction of energy"]),
    how=st.sampled_from(["measured", "bound", "statistical"]),
    label=LABELS,
)
LEDGERS = st.lists(
    st.tuples(st.sampled_from(["scene s", "radiance", "lighting n", "lens l", "sensor c"]), TERMS),
    max_size=8,
)


@pytest.mark.slow
@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(LEDGERS, st.integers(0, 10**6), st.booleans())
def test_no_figure_is_smaller_than_a_part_of_it(terms, seed, two):
    rows = [Row(stage, errors=[term]) for stage, term in terms]
    shots = [shot_of(seed + k, capture) for k, capture in enumerate("ab"[: 1 + two])]
    whole, *parts = stated(shots, rows)
    if not any(shot.unsaturated.any() for shot in shots):
        return
    keys = {term.source.key for term in parts}
    assert whole.source.key == WHOLE and keys == {RENDERER, AFTER_RENDERER, SENSOR}
    assert whole.value * (1 + ROUNDING) >= max(term.value for term in parts)
    for shot in shots:  # the figure of each stage alone is at most that of all stages
        kept, _ = propagation.terms_after(rows)
        if shot.unsaturated.any():
            alone = [propagation.figures_of(shot, [term]).later for term in kept]
            assert (
                max(alone, default=0.0)
                <= propagation.figures_of(shot, kept).later * (1 + ROUNDING) + 1e-12
            )


@settings(max_examples=15, deadline=None, derandomize=True, database=None)
@given(LEDGERS, st.lists(LABELS, min_size=8, max_size=8), st.integers(0, 10**6))
def test_labels_decide_nothing(terms, words, seed):
    rows = [Row(stage, errors=[term]) for stage, term in terms]
    shot = shot_of(seed)
    relabelled = [
        Row(stage, errors=[replace(term, label=word)])
        for (stage, term), word in zip(terms, words, strict=False)
    ]
    assert stated([shot], rows) == stated([shot], relabelled)
    assert propagation.stated_noise(rows) == propagation.stated_noise(relabelled)
    summed = [ledger.row_of_sum(each).errors for each in (rows, relabelled)]
    assert summed[0] == summed[1] and rows == relabelled


def test_the_headline_of_a_bound_and_of_two_deviations_in_closed_form():
    ones = np.ones(50)
    shot = Electrons("a", 1e4 * ones, 1e4 * ones, 100 * ones, 30 * ones, ones > 0, 2.0)
    rows = [row("lens l", said(0.4, UNIT, "statistical"))]
    whole, renderer, later, _ = (term.value for term in stated([shot], rows))
    # 99 % of normal deviates are within 2.5758 standard deviations: 0.3 and 0.4 of the noise,
    # together 0.5
    assert (renderer, later, whole) == pytest.approx((0.77274, 1.03032, 1.2879), rel=1e-4)
    rows = [row("lens l", said(0.2, UNIT, "bound"), said(1e-3, "relative", "measured"))]
    counted = said(2e-3, "relative", "measured", acts_on=Quantity.ELECTRONS)
    rows.append(row("sensor s", counted))
    whole, renderer, later, sensor = (term.value for term in stated([shot], rows))
    assert sensor == pytest.approx(0.2, rel=1e-6)
    assert later == pytest.approx(0.3, rel=1e-6) and whole == pytest.approx(
        0.5 + renderer, rel=1e-6
    )


def test_an_error_acts_on_its_part_of_the_light_alone():
    """A part may have any name: light that a stage passes on, the image, or the rest of the
    light.
    """
    ones = np.ones(4)
    shot = Electrons("a", 1000 * ones, 700 * ones, ones, 0 * ones, ones > 0, 2.0)
    with ledger.stage(Ledger(), "lens l") as declared:
        ledger.image_part("x")
        ledger.rest_part("y")
    [shot] = propagation.with_parts([shot], None, [declared])
    shot = replace(shot, parts=shot.parts | {"z": 20 * ones})

    def bound(part):
        term = ErrorTerm(LENS, Quantity.IRRADIANCE, part, 0.1, "relative", "bound")
        return propagation.after(shot, [term])[0][0]

    assert [bound(part) for part in (None, "x", "y", "z")] == pytest.approx([100, 70, 30, 2])
    for word in ("light that nobody declared", SPREAD, DIRECT):
        assert bound(word) == pytest.approx(100)  # an unknown part is all light


def test_what_attributes_say_and_shapes_are_no_errors_of_a_pixel():
    for quantity in set(Quantity) - set(error_terms.LIGHT) - {Quantity.TARGET}:
        stage = row("lens l", said(0.3, "relative", "measured", acts_on=quantity))
        assert propagation.terms_after([stage]) == ([], stage.errors)


def test_a_sensor_states_errors_of_electrons_and_keeps_those_of_its_own():
    counted = said(0.01, "relative", "bound", acts_on=Quantity.ELECTRONS)
    stage = row("sensor s", counted, said(0.5, "electrons", "bound", "non-linearity"))
    assert stage.errors[1].acts_on == Quantity.RAW
    assert propagation.terms_of_sensor([stage]) == stage.errors[:1]
    assert propagation.terms_after([stage]) == ([], [])


def test_both_spellings_of_the_unit_of_electrons_count():
    shot = shot_of(4)

    def bound(kind, unit):
        [term] = row(f"{kind} s", said(50.0, unit, "bound", acts_on=Quantity.ELECTRONS)).errors
        return propagation.figures_of(shot, [], [term]).sensor

    assert bound("sensor", "e") == bound("sensor", "electrons") > 0
    stage = row("sensor s", said(50.0, "e", "bound", acts_on=Quantity.ELECTRONS))
    assert propagation.terms_of_sensor([stage]) == stage.errors
    stage = row("lens l", said(50.0, "e", "bound"))
    assert propagation.terms_after([stage]) == (stage.errors, [])


@pytest.mark.parametrize(
    "unknown",
    [
        {"unit": "percent", "acts_on": Quantity.ELECTRONS},
        {"unit": "relative", "acts_on": Quantity.PHOTOCURRENT},
    ],
)
@pytest.mark.parametrize("kind", ["sensor", "lens"])
def test_errors_that_do_not_become_electrons_are_left_out(kind, unknown):
    stage = row(f"{kind} s", {**said(3.0, "", "bound", "spill"), **unknown})
    listed = kind == "sensor" or unknown["unit"] == "percent"
    with ledger.stage(Ledger(), "picture") as picture:
        propagation.record_figures([shot_of(4)], [stage], 0.1, propagation.Seconds(0.0, 0.0))
    notes = [(note.what, note.bound, note.unit) for note in picture.left_out]
    assert notes == ([("spill", 3.0, unknown["unit"])] if listed else [])


def test_an_error_of_light_that_a_stage_takes_away_adds_to_the_others():
    shot = shot_of(4)
    halo = said(0.1, "relative", "bound", part="halo")
    [term] = row("lens l", halo).errors
    taken_away = replace(shot, parts={"halo": -shot.parts["halo"]})
    bounds = [propagation.after(s, [term]).bound for s in (shot, taken_away)]
    np.testing.assert_array_equal(*bounds)


def test_a_stage_without_a_word_on_it_speaks_of_what_it_returns():
    for kind, quantity in (
        ("scene", Quantity.RADIANCE),
        ("lens", Quantity.IRRADIANCE),
        ("sensor", Quantity.RAW),
        ("isp", Quantity.PICTURE),
        ("metric", Quantity.SCORE),
        ("something else", Quantity.OTHER),
    ):
        [term] = row(f"{kind} n", said(1.0, "relative", "bound")).errors
        assert term.acts_on == quantity and term.source.kind == kind.split()[0]
    [term] = row("metric ssim bayer", said(1.0, "1", "bound")).errors
    assert term.source == Source("metric", "ssim bayer")


def test_errors_of_a_sum_of_light():
    """A sum has the largest of the relative errors and the total of the absolute errors. Terms of
    one identity are matched in their order.
    """

    def part(relative, absolute, *more):
        keyed = [said(value, "relative", "statistical", key="octave") for value in more]
        return row(
            "lens l",
            said(relative, "relative", "bound"),
            said(absolute, "electrons", "bound"),
            *keyed,
        )

    summed = ledger.row_of_sum([part(0.1, 2.0, 0.5, 0.3), part(0.4, 3.0, 0.2, 0.7, 0.1)]).errors
    assert [term.value for term in summed] == [0.4, 5.0, 0.5, 0.7, 0.1]
    assert [term.value for term in error_terms.largest_alternatives(summed)] == [0.4, 5.0, 0.7]


def test_left_out_of_several_parts_is_listed_once():
    def part(what, bound, key=""):
        with ledger.stage(Ledger(), "lens l") as stated:
            ledger.left_out(what, "too dark", bound, "relative", key=key)
        return stated

    rows = [part("a", 0.1), part("a", 0.2), part("3 of 5", 0.1, "bands"), part("4", 0.3, "bands")]
    assert [left.bound for left in ledger.row_of_sum(rows).left_out] == [0.2, 0.3]


def test_what_a_call_states_comes_back_with_its_result():
    def call():
        ledger.error(0.1, "relative", "bound")
        ledger.left_out("a", "b", 0.0, "1")
        ledger.rest_part("halo")
        return 7

    with ledger.stage(Ledger(), "lens l") as stage:
        found = ledger.collected(call)
        assert found.result == 7 and stage == replace(stage, errors=[], left_out=[])
        ledger.record_row(found.row)
    assert stage.errors == found.row.errors and stage.errors[0].source == LENS
    assert len(stage.left_out) == 1 and "halo" in stage.light_parts
    assert ledger.collected(ledger.records_errors).result is False  # not within a run


def test_ledgers_of_earlier_versions_load():
    def old(value, unit, how, **fields):
        return {"value": value, "unit": unit, "how": how, "what": "", **fields}

    records = [
        {
            "stage": "lens l",
            "seconds": 1.0,
            "peak_bytes": 2,
            "left_out": [{"what": "a", "why": "b", "bound": 0.0, "unit": "1"}],
            "errors": [
                old(0.02, "relative per tile", "statistical"),
                old(0.1, "relative", "bound", source="k", quantity="irradiance", part="ghosts"),
                old(0.3, "share of a point's light", "measured", source="", quantity="", part=""),
                old(0.5, "um rms", "measured", source="z", quantity="point spread", part=""),
            ],
        }
    ]
    [stage] = Ledger.from_records(json.loads(json.dumps(records)))
    assert stage.errors == [
        ErrorTerm(LENS, Quantity.IRRADIANCE, SPREAD, 0.02, "relative", "statistical"),
        ErrorTerm(replace(LENS, key="k"), Quantity.IRRADIANCE, "ghosts", 0.1, "relative", "bound"),
        ErrorTerm(LENS, Quantity.IRRADIANCE, None, 0.3, "relative", "measured"),
        ErrorTerm(
            replace(LENS, key="z"), Quantity.OTHER, "point spread", 0.5, "um rms", "measured"
        ),
    ]
    assert Ledger.from_records(Ledger([stage]).as_records()) == [stage]
    assert len(stage.left_out) == 1 and not stage.left_out[0].needless


def test_a_quantity_of_earlier_versions_is_read_as_a_part():
    term = ErrorTerm(LENS, Quantity.OTHER, "point spread", 0.5, "um rms", "measured")
    [record] = Ledger([Row("lens l", errors=[term])]).as_records()
    record["errors"][0] |= {"acts_on": "point spread", "part": None}
    [row] = Ledger.from_records([json.loads(json.dumps(record))])
    assert row.errors == [term]
    assert Quantity.POINT_SPREAD is Quantity.OTHER


def test_notes_of_earlier_plugins_act_on_what_they_did():
    ones = np.ones(4)
    shot = Electrons("a", 1000 * ones, 700 * ones, ones, 0 * ones, ones > 0, 2.0)
    with ledger.stage(Ledger(), "lens l") as stage:
        ledger.add_error(ErrorNote(0.1, "relative", "bound", "", "a", Quantity.IRRADIANCE, SPREAD))
        ledger.add_error(ErrorNote(0.1, "relative", "bound", part=DIRECT))
        ledger.add_error(ErrorNote(0.2, "relative per tile", "bound"))
        ledger.error(0.3, "share of a point's light", "bound")
        ledger.error(0.4, "relative of spread light", "bound")
    [shot] = propagation.with_parts([shot], None, [stage])
    each = [propagation.after(shot, [term])[0][0] for term in propagation.terms_after([stage])[0]]
    assert each == pytest.approx([30, 70, 60, 300, 120])


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
    ledger.light_part("outside a run", light)  # is not recorded and does not fail


@pytest.mark.parametrize(
    ("light", "said"),
    [
        (np.ones((1, 2, 2)), "is of type ndarray; expected an xarray.DataArray"),
        (xr.DataArray(np.ones((1, 2, 2)), dims=("wavelength", "y", "x")), "no attribute 'units'"),
        (
            xr.DataArray(np.ones(2), dims="wavelength", attrs={"units": quantities.IRRADIANCE}),
            "the dims \\('wavelength',\\).*ones_like",
        ),
        (
            xr.Dataset({"a": (("y", "x"), np.ones((2, 2)))}, attrs={"units": "W m-2 nm-1"}),
            "is of type Dataset; expected an xarray.DataArray",
        ),
    ],
    ids=["array", "no units", "no tiles", "dataset"],
)
def test_a_part_that_is_no_light_is_refused_where_it_is_declared(light, said):
    with ledger.stage(Ledger(), "lens l"), pytest.raises(PluginError, match=f"'veil'.*{said}"):
        ledger.light_part("veil", light)


@pytest.mark.parametrize(
    ("maps", "said"),
    [
        (0.1, "light_errors of the lens returned float; expected .*ErrorMaps"),
        ((0.1, 0.2, 0.3), "returned tuple"),
    ],
)
def test_error_maps_of_another_form_are_refused(maps, said):
    with pytest.raises(PluginError, match=said):
        maps_of(maps)


def test_error_maps_may_be_one_array_of_earlier_versions():
    both = np.stack([np.zeros((3, 4, 6)), np.ones((3, 4, 6))])
    maps = maps_of(both)
    assert maps.deviation.shape == maps.bound.shape == (3, 4, 6)
    assert (maps.deviation.max(), maps.bound.min()) == (0.0, 1.0)


@pytest.mark.parametrize("value", [-0.2, float("nan")])
def test_a_term_of_this_stage_is_checked_in_every_spelling(value):
    source = Source("lens", "l", "k")
    calls = [
        lambda: ledger.add_error(ErrorNote(value, "relative", "bound", "veil")),
        lambda: ledger.record(
            ErrorTerm(source, Quantity.IRRADIANCE, None, value, "relative", "bound", "veil")
        ),
    ]
    for call in calls:
        with ledger.stage(rows := Ledger(), "lens l"):
            with pytest.raises(PluginError, match="lens l: the error 'veil' has the value"):
                call()
        assert not rows[0].errors


def test_both_spellings_of_electrons_are_one_unit():
    source = Source("sensor", "s", "k")
    terms = [
        ErrorTerm(source, Quantity.ELECTRONS, None, 50.0, unit, "bound")
        for unit in ("e", "electrons")
    ]
    assert terms[0] == terms[1] and len(error_terms.largest_alternatives(terms)) == 1


def test_stored_terms_are_restated_by_their_fields(monkeypatch, tmp_path):
    """A term that this run has stated is not stated again, whatever its label. Noise of accumulated
    stores is stated only for groups for which no renderer of this run has stated it.
    """
    with ledger.stage(fresh := Ledger(), "renderer r"):
        ledger.error(0.1, "relative", "statistical", "new words", part="sky")
    with ledger.stage(old := Ledger(), "renderer r"):
        ledger.error(0.1, "relative", "statistical", "old words", part="sky")
        ledger.error(0.2, "relative", "bound", "of its own")
    scene = xr.Dataset({"radiance": xr.DataArray(0.0, attrs={"keepbits": 10})})
    whole = scene.assign_coords(wavelength=[550.0])
    held = [{"id": "s", "ledger": old.as_records()}]
    monkeypatch.setattr("isethdr_core.storage.store.open_store", lambda path: scene)
    monkeypatch.setattr(joined_radiance, "of_demand", lambda joined, demand: joined)
    monkeypatch.setattr(joined_radiance, "known", lambda *_: Known())

    def restated(attributes, rows):
        joined = whole.assign_attrs(attributes)
        monkeypatch.setattr(joined_radiance, "join_scenes", lambda *_: joined)
        with ledger.stage(Ledger(), "radiance") as stage:
            joined_radiance.opened(tmp_path, held, Demand(), rows)
        return [(t.source.kind, t.part, t.value) for t in stage.errors[1:]]

    assert restated({}, fresh) == [("renderer", None, 0.2)]
    assert restated({}, Ledger()) == [("renderer", "sky", 0.1), ("renderer", None, 0.2)]
    pooled = {"paths": {"sky": 8, "lamps": 8}, "noise": {"sky": 0.05, "lamps": 0.07}}
    of_lamps = ("renderer", "lamps", 0.07)
    assert restated(pooled, fresh) == [("renderer", None, 0.2), of_lamps]
    assert restated(pooled, Ledger())[1:] == [("renderer", "sky", 0.05), of_lamps]
