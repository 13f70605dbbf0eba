"""Lateral shape: the height of a road across it, as polynomials of t at places along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .profile import Floats, Profile


class ShapeRow(NamedTuple):
    """The height over t at one place; between two places it changes linearly with s."""

    s_m: float
    height: Profile  # height as a function of t


@dataclass(frozen=True)
class LateralShape:
    """Rows in the order of s. Before the first and after the last row the shape is constant."""

    rows: tuple[ShapeRow, ...]

    def at(self, s_m: ArrayLike, t_m: ArrayLike) -> Floats:
        """Return the heights at (s, t), arrays of one shape, m."""
        s, t = np.broadcast_arrays(np.asarray(s_m, float), np.asarray(t_m, float))
        starts = np.array([row.s_m for row in self.rows])
        before = np.clip(np.searchsorted(starts, s, side="right") - 1, 0, len(starts) - 1)
        out = np.empty(s.shape)
        for k in np.unique(before):
            here = before == k
            low = self.rows[k]
            height = low.height.at(t[here])
            if k + 1 < len(self.rows):
                high = self.rows[k + 1]
                share = np.clip((s[here] - low.s_m) / (high.s_m - low.s_m), 0.0, 1.0)
                height = height + share * (high.height.at(t[here]) - height)
            out[here] = height
        return out
