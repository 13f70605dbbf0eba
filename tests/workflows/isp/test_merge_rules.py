"""The merge study: its claims about the default rule, and checks of its own estimators."""

import numpy as np
import pytest
from isethdr_measured.merge_rules import (
    default_levels,
    ends_e,
    judged,
    merge_rules,
    required_figures,
    rules,
    shot,
    verdict,
)

from isethdr_core.plugins.registry import build

MODEL = build("sensor", "split_pixel").model()
# levels in each decade, where rules switch (95 % of a top), and in the default's ramp
LEVELS = "1,3,10,100,1e4,20900,21407,21555,22000,22445,1e5,7.5e5"


@pytest.fixture(scope="module")
def rows():
    return merge_rules(draws=40000, levels=LEVELS)


def test_the_default_is_unbiased_rightly_reported_and_not_beaten(rows):
    found = verdict([r for r in rows if not r["check"]], MODEL)
    assert found["worst_bias_percent"] < 0.1
    # 5 %: 3.3 % in the ramp, and 0.7 % from 40 000 draws
    assert found["worst_variance"] == pytest.approx(1, abs=0.05)
    assert found["most_beaten_db"] < 0.1  # 40 000 shared draws have 0.03 dB of noise
    assert found["unbiased"] == "none"  # every other rule is biased somewhere


def test_every_figure_with_a_limit_has_a_row(rows):
    said = [r["check"] for r in rows if r["check"]]
    assert [text.split(":")[-1].strip() for text in said] == ["0.1 %", "5 %", "0.1 dB", "0.1 dB"]
    assert "0 other rules without bias at every level: nobody" in said[2]
    assert all(set(r) == set(rows[0]) for r in rows)  # one table


def test_a_rule_that_is_unbiased_and_better_would_be_named(rows):
    better = [
        {**r, "rule": "oracle", "snr_db": r["snr_db"] + 0.2}
        for r in rows
        if r["rule"] == "inverse_variance" and not r["check"]
    ]
    found = required_figures([r for r in rows if not r["check"]] + better, MODEL)
    assert (
        found[2]["rule"] == "oracle"
        and "of 1 other rules without bias at every level: +0.200 dB" in found[2]["check"]
    )


def test_other_rules_show_their_known_faults(rows):
    by = {(r["level_e"], r["rule"]): r for r in rows if not r["check"]}
    # weights that follow the noise favour low values
    assert by[1, "own_noise"]["bias_percent"] < -5
    assert by[20900, "average"]["bias_percent"] < -0.1  # a switch on noisy data
    assert by[22000, "hard_switch"]["bias_percent"] < -0.1
    # `average` gives readings of 3.05 and 0.83 e of read noise equal weights
    assert by[1, "inverse_variance"]["snr_db"] > by[1, "average"]["snr_db"] + 2.5
    assert by[100, "own_noise"]["reported_over_true"] < 0.6  # one charge counted as two


def test_control_variates_find_a_bias_that_plain_means_do_not():
    groups, light, controls = shot(MODEL, 10.0, 20000, np.random.default_rng(0))
    merged = rules()["inverse_variance"](groups, light)
    found = judged(merged, controls, 10.0)
    plain = 100 * merged.signal_e.std() / np.sqrt(20000) / 10
    assert found["bias_error_percent"] < plain / 8
    assert abs(found["bias_percent"]) < 4 * found["bias_error_percent"] + 0.02
    # an added bias of 1 % is found
    object.__setattr__(merged, "signal_e", merged.signal_e * 1.01)
    assert judged(merged, controls, 10.0)["bias_percent"] == pytest.approx(
        found["bias_percent"] + 1, abs=0.05
    )


def test_levels_span_eight_decades_and_every_end():
    levels = default_levels(MODEL)
    assert np.log10(max(levels) / min(levels)) >= 8
    assert ends_e(MODEL) == pytest.approx([22000, 5390, 790000], rel=1e-3)
    assert all(any(abs(level - end) < 1e-3 * end for level in levels) for end in ends_e(MODEL))
