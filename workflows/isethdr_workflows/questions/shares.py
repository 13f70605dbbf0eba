"""Division of a loss among terms with effects that depend on each other.

The loss of a term depends on the terms that are switched on already: noise hides scatter, and
scatter hides noise. Three values are computed for each term: its loss as the first term, its loss
as the last term, and the mean over all orders, the Shapley value (Shapley 1953, "A value for
n-person games"). Shapley values add up to the whole loss.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

from ..dataset.study.intervals import Mean, mean_over_roads

Scores = Mapping[frozenset[str], float]


@dataclass(frozen=True)
class Share:
    """Loss of a score by one term."""

    first: float  # loss if the term alone is switched on
    last: float  # additional loss if the term is switched on after all others
    shapley: float  # mean additional loss over all orders


def shares(scores: Scores, terms: Sequence[str]) -> dict[str, Share]:
    """Return the loss of a score by each term.

    Parameters
    ----------
    scores : {set of terms switched on: score} for all subsets; NaN if there is no score.
    terms : names of the terms.
    """
    every = frozenset(terms)
    found = {}
    orders = list(permutations(terms))
    for term in terms:
        added = []
        for order in orders:
            before = frozenset(order[: order.index(term)])
            added.append(scores[before | {term}] - scores[before])
        found[term] = Share(
            first=scores[frozenset({term})] - scores[frozenset()],
            last=scores[every] - scores[every - {term}],
            shapley=math.fsum(added) / len(added) if all(map(math.isfinite, added)) else math.nan,
        )
    return found


def ratio_over_roads(
    parts: Sequence[float], wholes: Sequence[float], roads: Sequence[Hashable]
) -> Mean:
    """Return the ratio of two sums over scenes, and its 95 % interval over roads.

    Parameters
    ----------
    parts, wholes : value of each scene; scenes in which one of them is not finite are left out.
    roads : road of each scene.

    Notes
    -----
    With r = sum(part) / sum(whole), the deviations part - r whole have the mean 0. Their interval
    divided by the mean whole is the interval of r (Cochran 1977, chapter 6). This assumes a normal
    ratio. If the whole itself may be 0, ratio and interval would mean little and are left out.
    """
    kept = [
        (p, w, r)
        for p, w, r in zip(parts, wholes, roads, strict=True)
        if math.isfinite(p) and math.isfinite(w)
    ]
    whole = mean_over_roads([w for _, w, _ in kept], [r for _, _, r in kept])
    unknown = not kept or math.isnan(whole.low) or whole.low <= 0 <= whole.high
    if unknown:
        return Mean(math.nan, math.nan, math.nan, whole.count, whole.roads)
    ratio = math.fsum(p for p, _, _ in kept) / math.fsum(w for _, w, _ in kept)
    rest = mean_over_roads([p - ratio * w for p, w, _ in kept], [r for _, _, r in kept])
    half = (rest.high - rest.low) / 2 / abs(whole.value)
    return Mean(ratio, ratio - half, ratio + half, whole.count, whole.roads)
