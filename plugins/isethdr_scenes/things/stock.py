"""Stock: the things that may be drawn, from the bundled families and from asset packs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .packs.asset import AssetThing
from .registry import group_named
from .thing import Thing


@dataclass(frozen=True)
class Stock:
    """The bundled families, together with things of packs.

    A thing of a pack gets its share of the draws of its group, and the same share of the draws of
    its family. The bundled things get the other draws.
    """

    own: tuple[AssetThing, ...] = ()

    def names(self, group: str) -> tuple[str, ...]:
        """Return the families of a group: the bundled ones, then those of the packs."""
        added = [thing.family for thing in self.own if thing.group == group]
        return tuple(dict.fromkeys([*group_named(group).shares(), *added]))

    def draw(self, group: str, rng: np.random.Generator, family: str | None = None) -> Thing:
        """Return a random thing of a group or a family.

        Parameters
        ----------
        group : car, truck, person, tree, ... (`isethdr things list`).
        rng : random numbers; a draw takes several.
        family : family of the group; None: drawn by the shares of the families.

        Raises
        ------
        ValueError
            If there is no such group, or no such family in it.
        """
        own = [t for t in self.own if t.group == group and family in (None, t.family)]
        bundled = group_named(group).shares()
        if own:
            # a family that only packs have has no bundled things to draw
            only = family is not None and family not in bundled
            place = float(rng.random()) * (sum(map(_share, own)) if only else 1.0)
            for thing, end in zip(own, np.cumsum([_share(t) for t in own])):
                if place < end:
                    return thing
            if only:  # rounding left `place` at the end of the sum
                return own[-1]
        return _bundled(group, rng, family)


def _share(thing: AssetThing) -> float:
    assert thing.asset is not None
    return thing.asset.share


def _bundled(group: str, rng: np.random.Generator, family: str | None) -> Thing:
    """Return a random thing of the bundled families."""
    families = group_named(group)
    shares = families.shares()
    if family is None:
        share = np.array(list(shares.values()), float)
        family = list(shares)[int(rng.choice(len(share), p=share / share.sum()))]
    elif family not in shares:
        raise ValueError(f"no family {family!r} in group {group!r}; expected {', '.join(shares)}")
    return families.thing(family, int(rng.integers(2**31)))


BUNDLED = Stock()
