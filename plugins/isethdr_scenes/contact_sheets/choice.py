"""Selection of the things that a contact sheet shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from isethdr_core.errors import ConfigError

from ..things import Thing, draw, names
from ..things.packs.pack import load_pack
from ..things.registry import COLLECTIONS, GROUPS


def print_groups() -> None:
    """Print the groups with their families, and the collections with their groups."""
    for group in GROUPS:
        print(f"{group}: {', '.join(names(group))}")
    for collection, groups in COLLECTIONS.items():
        print(f"{collection}: the groups {', '.join(groups)}")


def chosen(what: str, count: int, seed: int, shuffled: bool) -> list[Thing]:
    """Return `count` things that are drawn from groups or collections, or all things of a pack.

    Things of a group are spread evenly over its families.

    Parameters
    ----------
    what : groups or collections, separated by commas, or the folder of an asset pack.
    count : number of things; it has no effect on a pack.
    seed : seed of the draw.
    shuffled : whether families are mixed.

    Raises
    ------
    ConfigError
        If there is no such group, or the asset pack has mistakes.
    """
    if Path(what).is_dir():
        return list(load_pack(what).things)
    families = [(group, family) for group in _groups(what) for family in names(group)]
    rng = np.random.default_rng(seed)
    repeats = [count // len(families) + (k < count % len(families)) for k in range(len(families))]
    things = [
        draw(group, rng, family)
        for (group, family), times in zip(families, repeats)
        for _ in range(times)
    ]
    return [things[k] for k in rng.permutation(len(things))] if shuffled else things


def _groups(what: str) -> list[str]:
    groups: list[str] = []
    for name in what.split(","):
        if name not in GROUPS and name not in COLLECTIONS:
            raise ConfigError(
                f"no things {name!r}; expected {', '.join([*COLLECTIONS, *GROUPS])}; type"
                " isethdr things list, or name a folder with an asset pack"
            )
        groups += [group for group in COLLECTIONS.get(name, (name,)) if group not in groups]
    return groups
