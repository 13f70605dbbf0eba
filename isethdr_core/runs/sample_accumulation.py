"""Sample accumulation: several renderings of the same light are averaged.

A renderer that continues from stored radiance numbers its samples per tile, the paths. For each
light group it states the range of paths that it followed: the attribute `path_span` {group: [first,
end]} of scene radiance. Renderings with different paths are independent. Their mean, weighted by
the number of paths, is as good as one rendering of all paths. Stores never change: they are
averaged when they are read.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..plugins.protocols import AccumulatesSamples

if TYPE_CHECKING:
    import xarray as xr

    from ..data.scene_description import SceneDescription
    from ..pipeline.demand import Demand

ALL_BANDS = (None,)  # a demand without bands asks for all bands of the renderer


@dataclass(frozen=True)
class Known:
    """The stored paths of one light group."""

    paths: int = 0  # number of paths per tile that can be pooled
    noise: float | None = None  # relative noise of their mean; None if they found no light
    next: int = 0  # the first path that no rendering has followed


def rendered_anew(renderer: Any, description: SceneDescription, demand: Demand) -> xr.Dataset:
    """Return what a renderer makes without stored samples; one that accumulates samples is told
    that there are none.

    Parameters
    ----------
    renderer : renderer of any class.
    description : description of the scene.
    demand : light groups, bands and labels that are needed.
    """
    if not isinstance(renderer, AccumulatesSamples):
        scene: xr.Dataset = renderer(description, demand)
        return scene
    groups = description.light_groups() if demand.groups is None else demand.groups
    return renderer(description, demand, {group: Known() for group in groups})


def pooled(spans: Sequence[tuple[int, int] | None]) -> list[int]:
    """Return which of `spans`, (first, end) or None, are pooled: the spans without overlap that
    contain the most paths together.

    A single path has no known noise, so it counts only if there are no other paths. If no span is
    stated, the first store is used alone.
    """
    known = [k for k, span in enumerate(spans) if span]
    if not known:
        return [0]
    known = [k for k in known if spans[k][1] - spans[k][0] > 1] or known[:1]
    # (paths, spans) of the best choice among the first n spans, in the order of their ends
    best: list[tuple[int, list[int]]] = [(0, [])]
    order = sorted(known, key=lambda k: (spans[k][1], k))
    for position, k in enumerate(order):
        first, end = spans[k]
        without_overlap = sum(spans[j][1] <= first for j in order[:position])
        candidate = best[without_overlap][0] + end - first, [*best[without_overlap][1], k]
        best.append(max(best[-1], candidate, key=lambda choice: choice[0]))
    return sorted(best[-1][1])


def pooled_noise(paths: Sequence[int], noises: Sequence[float]) -> float | None:
    """Return the relative noise of the mean of independent renderings, each with the weight of its
    `paths`; None if all are dark.

    A rendering that found no light is assumed to be as noisy as the noisiest of the others.
    """
    lit_noises = [n for n in noises if n is not None]
    if not lit_noises:
        return None
    return math.hypot(
        *(p * (max(lit_noises) if n is None else n) for p, n in zip(paths, noises, strict=True))
    ) / sum(paths)


def holds(attributes: dict, group: str, band: float | None) -> bool:
    """Return whether a store holds one light group at a band, or records the group as dark.

    Parameters
    ----------
    attributes : attributes of the store.
    group : name of the light group.
    band : band centre, nm; None for all bands of the renderer.
    """
    all_bands = attributes.get("bands_asked") is None
    return group in (*attributes["groups"], *attributes["absent_groups"]) and (
        all_bands if band is None else band in attributes["wavelength_nm"]
    )


def known(stores: list[dict], group: str, bands: Sequence[float | None]) -> Known:
    """Return the stored paths of a light group that hold at all of `bands`: those of the band with
    the fewest paths.

    If one band has no stored paths, all bands start again from the first path: they share their
    paths, so that colours stay consistent.

    Parameters
    ----------
    stores : root attributes of stores.
    group : name of the light group.
    bands : nm, or `ALL_BANDS`.
    """
    worst = None
    last_end = 0
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
