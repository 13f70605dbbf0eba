"""A fleet: vehicles of which no two have the same silhouettes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw

from .registry import group_named
from .stock import BUNDLED
from .thing import Thing

GROUPS = ("car", "truck", "bus", "motorcycle")
ALIKE = 0.93  # intersection over union, of the side and of the front, above which two are alike
MARGIN = 0.005  # below it, for the pixels of the silhouettes
PIXELS = 384  # along the length of a vehicle
HIGH = 0.9  # of a picture, relative to the length
TRIES = 40  # members of a family that are looked at, before the family is left out


def fleet(count: int = 80, seed: int = 0, groups: Sequence[str] = GROUPS) -> tuple[Thing, ...]:
    """Return vehicles of which no two are alike, family after family in turn.

    Candidates are built at the coarsest level: 80 vehicles need 169 of them, about 75 CPU seconds.

    Parameters
    ----------
    count : number of vehicles.
    seed : of the draw.
    groups : groups of vehicles that take part.

    Raises
    ------
    ValueError
        If the families hold no such number of vehicles, or there is no such group.
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
    """Return the intersection over union of two silhouettes (2, y, x): the lesser one of the side
    and the front. Two vehicles are alike where both are large.
    """
    both = (one & other).sum((1, 2))
    either = (one | other).sum((1, 2))
    return float((both / either).min())


def silhouettes(thing: Thing, pixels: int = PIXELS) -> np.ndarray:
    """Return what a thing hides (2, y, x) bool, seen from its side and from its front, both scaled
    to one length; it stands on the lower edge.
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
        # pixel k reaches from k to k + 1
        for triangle in np.stack([across, up], -1) - 0.5:
            draw.polygon([tuple(point) for point in triangle.tolist()], fill=1)
        out[k] = np.asarray(picture)
    return out
