"""Profiles: piecewise cubic polynomials along a road, as OpenDRIVE stores heights and widths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class Cubic(NamedTuple):
    """One piece: a + b ds + c ds^2 + d ds^3, with ds = s - start_m."""

    start_m: float
    a: float = 0.0
    b: float = 0.0
    c: float = 0.0
    d: float = 0.0


@dataclass(frozen=True)
class Profile:
    """A function of s in pieces, each valid until the next one starts; without pieces it is 0.

    Before the first piece and after the last one the nearest piece continues.
    """

    pieces: tuple[Cubic, ...] = ()

    @classmethod
    def constant(cls, value: float) -> Profile:
        """Return the profile that is `value` everywhere."""
        return cls((Cubic(0.0, float(value)),))

    @classmethod
    def straight(cls, nodes: Sequence[tuple[float, float]]) -> Profile:
        """Return straight pieces through the nodes (s_m, value), constant outside."""
        first = nodes[0]
        last = nodes[-1]
        pieces = [Cubic(min(first[0], 0.0) - 1.0, first[1])]
        for (s, value), (after, then) in zip(nodes, nodes[1:]):
            pieces.append(Cubic(s, value, (then - value) / (after - s)))
        return cls((*pieces, Cubic(last[0], last[1])))

    @classmethod
    def smooth(cls, nodes: Sequence[tuple[float, float, float]]) -> Profile:
        """Return Hermite cubics through the nodes (s_m, value, slope), straight outside."""
        first = nodes[0]
        last = nodes[-1]
        before = min(first[0], 0.0) - 1.0
        pieces = [Cubic(before, first[1] - (first[0] - before) * first[2], first[2])]
        for (s, value, slope), (after, then, end_slope) in zip(nodes, nodes[1:]):
            length = after - s
            chord = (then - value) / length
            c = (3 * chord - 2 * slope - end_slope) / length
            d = (slope + end_slope - 2 * chord) / length**2
            pieces.append(Cubic(s, value, slope, c, d))
        return cls((*pieces, Cubic(last[0], last[1], last[2])))

    def between(self, first_m: float, last_m: float) -> Profile:
        """Return the function from `first_m` to `last_m`, with s counted from `first_m`."""
        starts = [piece.start_m for piece in self.pieces]
        first = max(int(np.searchsorted(starts, first_m, side="right")) - 1, 0)
        found = []
        for piece in self.pieces[first:]:
            start = first_m if not found else piece.start_m
            if found and start >= last_m:
                break
            found.append(_from(piece, start)._replace(start_m=start - first_m))
        return Profile(tuple(found))

    @cached_property
    def _table(self) -> Floats:
        return np.array(self.pieces or (Cubic(0.0),), float)

    def _pieces_at(self, s_m: ArrayLike) -> tuple[Floats, Floats]:
        s = np.asarray(s_m, float)
        k = np.searchsorted(self._table[:, 0], s, side="right") - 1
        piece = self._table[np.maximum(k, 0)]
        return s - piece[..., 0], piece

    def at(self, s_m: ArrayLike) -> Floats:
        """Return the values at `s_m`, in its shape."""
        if not self.pieces:
            return np.zeros(np.shape(s_m))
        if len(self.pieces) == 1:
            start, a, b, c, d = self.pieces[0]
            ds = np.asarray(s_m, float) - start
            return np.asarray(a + ds * (b + ds * (c + ds * d)))
        ds, piece = self._pieces_at(s_m)
        cubic = piece[..., 3] + ds * piece[..., 4]
        return np.asarray(piece[..., 1] + ds * (piece[..., 2] + ds * cubic))

    def slope(self, s_m: ArrayLike) -> Floats:
        """Return the derivative by s at `s_m`."""
        ds, piece = self._pieces_at(s_m)
        b, c, d = np.moveaxis(piece[..., 2:], -1, 0)
        return np.asarray(b + ds * (2 * c + ds * 3 * d))

    def bend(self, s_m: ArrayLike) -> Floats:
        """Return the second derivative by s at `s_m`."""
        ds, piece = self._pieces_at(s_m)
        return np.asarray(2 * piece[..., 3] + 6 * ds * piece[..., 4])


def _from(piece: Cubic, start_m: float) -> Cubic:
    """Return the same polynomial with ds counted from `start_m`."""
    ds = start_m - piece.start_m
    _, a, b, c, d = piece
    return Cubic(
        start_m,
        a + ds * (b + ds * (c + ds * d)),
        b + ds * (2 * c + ds * 3 * d),
        c + ds * 3 * d,
        d,
    )
