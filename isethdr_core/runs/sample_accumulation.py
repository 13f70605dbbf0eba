"""Pooling: what several renderings of the same light know together.

A renderer that can go on from what is stored says of each light group which paths of an endless
sequence it followed: the attribute `path_span` {group: [first, end]} of scene radiance. Renderings
of different paths are independent; their mean, each with the weight of its paths, is as good as one
rendering of all of them. Nothing that is stored is ever changed: stores are pooled as they are
read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

ALL_BANDS = (None,)  # a demand that names no band asks for all that the renderer makes


@dataclass(frozen=True)
class Known:
    """What is stored of one light group."""

    paths: int = 0  # per tile, that can be pooled
    noise: float | None = None  # relative, of their mean; None where no light was found
    next: int = 0  # the first path that no rendering has followed


def pooled(spans) -> list[int]:
    """Return which of `spans`, (first, end) or None, are pooled: those without overlap that hold
    most paths together.

    One path alone knows no noise, so that it counts only where there is nothing else. Where no span
    is stated, the first stands alone.
    """
    known = [k for k, span in enumerate(spans) if span]
    if not known:
        return [0]
    known = [k for k in known if spans[k][1] - spans[k][0] > 1] or known[:1]
    best: list[tuple[int, list[int]]] = [(0, [])]  # of the spans up to each, by their ends
    order = sorted(known, key=lambda k: (spans[k][1], k))
    for position, k in enumerate(order):
        first, end = spans[k]
        without_overlap = sum(spans[j][1] <= first for j in order[:position])
        candidate = best[without_overlap][0] + end - first, [*best[without_overlap][1], k]
        best.append(max(best[-1], candidate, key=lambda choice: choice[0]))
    return sorted(best[-1][1])


def pooled_noise(paths, noises) -> float | None:
    """Return the relative noise of the mean of independent renderings, each with the weight of its
    `paths`; None where all are dark.

    One in which no light was found counts as noisy as the noisiest other.
    """
    lit_noises = [n for n in noises if n is not None]
    if not lit_noises:
        return None
    return math.hypot(
        *(p * (max(lit_noises) if n is None else n) for p, n in zip(paths, noises, strict=True))
    ) / sum(paths)


def holds(attributes: dict, group: str, band) -> bool:
    """Return whether a store holds one light group, or knows that it is dark, at a band in nm or at
    `ALL_BANDS`.
    """
    whole = attributes.get("bands_asked") is None
    return group in (*attributes["groups"], *attributes["absent_groups"]) and (
        whole if band is None else band in attributes["wavelength_nm"]
    )


def known(stores: list[dict], group: str, bands) -> Known:
    """Return what stores know of a light group at all of `bands`: of the band that is known worst.

    Where a band is not known at all, its first paths are the next: all bands share their paths, so
    that colours hold together.

    Parameters
    ----------
    stores : root attributes of stores. `bands` : nm, or `ALL_BANDS`.
    """
    worst, last_end = None, 0
    for band in bands:
        holding = [
            s for s in stores if holds(s, group, band) and (s.get("path_span") or {}).get(group)
        ]
        spans = [s["path_span"][group] for s in holding]
        last_end = max([last_end, *(end for _, end in spans)])
        pooled_stores = pooled(spans) if spans else []
        paths = [spans[k][1] - spans[k][0] for k in pooled_stores]
        noise = pooled_noise(
            paths, [(holding[k].get("noise") or {}).get(group) for k in pooled_stores]
        )
        if worst is None or (sum(paths), -(noise or 0.0)) < (worst.paths, -(worst.noise or 0.0)):
            worst = Known(sum(paths), noise)
    return Known(worst.paths, worst.noise, last_end) if worst and worst.paths else Known()
