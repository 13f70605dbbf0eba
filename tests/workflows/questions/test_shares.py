"""Shares add up and are fair, and their intervals are those of a ratio."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from isethdr_workflows.questions.shares import ratio_over_roads, shares

TERMS = ("a", "b", "c")
SUBSETS = [frozenset(s) for n in range(4) for s in combinations(TERMS, n)]


def test_of_terms_that_commute_every_rule_says_the_same():
    cost = {"a": 1.0, "b": 2.0, "c": 4.0}
    found = shares({s: sum(cost[t] for t in s) for s in SUBSETS}, TERMS)
    for term, share in found.items():
        assert (share.first, share.last, share.shapley) == (cost[term],) * 3


def test_shapley_values_add_up_and_split_what_two_terms_do_together():
    """A loss of 6 that needs both a and b is split evenly between them; c costs 1 in every order.
    By hand, a costs 0 as the first term, 6 as the last, and 3 in the mean of all orders.
    """
    scores = {s: 6.0 * ({"a", "b"} <= s) + 1.0 * ("c" in s) for s in SUBSETS}
    found = shares(scores, TERMS)
    assert (found["a"].first, found["a"].last, found["a"].shapley) == (0.0, 6.0, 3.0)
    assert found["b"].shapley == 3.0 and found["c"].shapley == 1.0
    random = np.random.default_rng(2)
    scores = dict(zip(SUBSETS, random.normal(size=8), strict=True))
    total = sum(share.shapley for share in shares(scores, TERMS).values())
    assert total == pytest.approx(scores[frozenset(TERMS)] - scores[frozenset()], abs=1e-12)


def test_what_has_no_value_makes_no_share():
    scores = {s: (1.0 if "c" in s else math.nan) for s in SUBSETS}
    found = shares(scores, TERMS)
    assert found["a"].last == 0.0 and math.isnan(found["a"].shapley)


def test_the_interval_of_a_share_holds_it_in_95_of_100_cases():
    """The parts are 30 % of wholes that vary from road to road. The limits of 0.91 and 0.985 allow
    for the standard error of 400 cases, 1.1 %, and for a ratio of two sums over twelve roads that
    is not quite normal.
    """
    random = np.random.default_rng(5)
    inside = 0
    for _ in range(400):
        wholes = random.gamma(4.0, size=12)
        parts = 0.3 * wholes + 0.3 * random.normal(size=12)
        found = ratio_over_roads(parts, wholes, range(12))
        inside += found.low <= 0.3 <= found.high
    assert 0.91 < inside / 400 < 0.985


def test_of_a_loss_that_may_be_nothing_there_is_no_share():
    found = ratio_over_roads([1.0, -1.0, 0.5], [2.0, -2.5, 0.6], range(3))
    assert math.isnan(found.value) and found.roads == 3
