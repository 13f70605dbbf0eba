"""A fleet: vehicles with silhouettes that all differ."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw

from .registry import group_named
from .stock import BUNDLED
from .thing import Thing

GROUPS = ("car", "truck", "bus", "motorcycle")
# Two vehicles are alike if the intersection over union of their silhouettes is larger than this,
# both from the side and from the front.
ALIKE = 0.93
MARGIN = 0.005  # distance that is kept from `ALIKE`, for the error of pixels
PIXELS = 384  # pixels along the length of a vehicle
HIGH = 0.9  # height of a picture of a silhouette / its width
TRIES = 40  # number of candidates of a family in each round


def fleet(count: int = 80, seed: int = 0, groups: Sequence[str] = GROUPS) -> tuple[Thing, ...]:
    """Return vehicles of which no two are alike. The families take turns.

    Candidates are built at the coarsest level. A fleet of 80 vehicles needs 169 candidates, which
    take about 75 s of CPU time.

    Parameters
    ----------
    count : number of vehicles.
    seed : seed of the draw.
    groups : groups of the vehicles.

    Raises
    ------
    ValueError
        If the families do not hold that many different vehicles, or there is no such group.
    """
    families = [(group, family) for group in groups for family in group_named(group).shares()]
    rng = np.random.default_rng(seed)
    chosen: list[Thing] = []
    shown: list[np.ndarray] = []
    while len(chosen) < count:
        found = 0
        for group, family in families:
            if len(chosen) == count:
                break
            for _ in range(TRIES):
                thing = BUNDLED.draw(group, rng, family)
                one = silhouettes(thing)
                if all(likeness(one, other) <= ALIKE - MARGIN for other in shown):
                    chosen.append(thing)
                    shown.append(one)
                    found += 1
                    break
        if not found:
            raise ValueError(
                f"{', '.join(groups)} hold only {len(chosen)} vehicles that are not alike;"
                f" expected at most that many, not {count}"
            )
    return tuple(chosen)


def likeness(one: np.ndarray, other: np.ndarray) -> float:
    """Return the lesser intersection over union of two pairs of silhouettes (2, y, x).

    A pair has the side and the front of a vehicle.
    """
    both = (one & other).sum((1, 2))
    either = (one | other).sum((1, 2))
    return float((both / either).min())


def silhouettes(thing: Thing, pixels: int = PIXELS) -> np.ndarray:
    """Return the silhouettes of a thing (2, y, x) bool, from its side and from its front.

    In both pictures the scale is the one at which its length fills the width. It stands on the
    lower edge.
    """
    return _silhouettes(thing, pixels)


@lru_cache(maxsize=512)
def _silhouettes(thing: Thing, pixels: int) -> np.ndarray:
    parts = group_named(thing.group).build(thing, "far").parts
    corners = np.concatenate([part.vertices[part.faces] for part in parts])
    scale = pixels / thing.size_m[0]
    rows = round(HIGH * pixels)
    out = np.zeros((2, rows, pixels), bool)
    for k, axis in enumerate((0, 1)):
        across = scale * corners[:, :, axis] + pixels / 2
        up = rows - scale * corners[:, :, 2]
        picture = Image.new("1", (pixels, rows))
        draw = ImageDraw.Draw(picture)
        # pixel k reaches from k to k + 1, so its middle is at k + 0.5
        for triangle in np.stack([across, up], -1) - 0.5:
            draw.polygon([tuple(point) for point in triangle.tolist()], fill=1)
        out[k] = np.asarray(picture)
    return out
