"""Leaves at three levels of detail, and meshes fitted to the size that a thing states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, pose, unit
from ...geometry.surroundings.plants import cards
from ..detail import centred, clean, extent_m
from ..thing import Detail

# share of the leaves that a level shows; each is larger, so that their area stays
SHOWN: dict[Detail, float] = {"near": 1.0, "middle": 0.27, "far": 0.06}
LARGEST = 3.2  # leaves grow no more than this


@dataclass(frozen=True)
class Leaves:
    """Leaves in random order, so that the first of them are a fair sample."""

    centres: np.ndarray  # (n, 3), m
    normals: np.ndarray  # (n, 3)
    along: np.ndarray  # (n, 3): from stalk to tip
    length_m: float
    slim: float  # width over length

    def piece(self, name: str, material: str, detail: Detail) -> Piece:
        """Return the mesh of the leaves that a level of detail shows.

        Parameters
        ----------
        name : of the piece.
        material : name of the leaves' material.
        detail : level of the mesh; coarser ones have fewer and larger leaves.
        """
        count = max(1, round(SHOWN[detail] * len(self.centres)))
        grown = min(LARGEST, float(np.sqrt(1 / SHOWN[detail])))
        sizes = self.length_m * grown * (0.75 + 0.5 * _spread(count))
        # a clump of slim leaves is wider than one of them
        slim = min(1.0, self.slim * (1 + 0.35 * (grown - 1)))
        lengths = sizes * np.sqrt(self.slim / slim)
        return cards(
            self.centres[:count],
            unit(self.normals[:count]),
            self.along[:count],
            (lengths, lengths * slim),
            name,
            material,
        )


def _spread(count: int) -> np.ndarray:
    """Return numbers spread over 0 to 1, the same at each level of detail."""
    return np.modf(np.arange(count) * 0.6180339887)[0]


def fitted(model: Assembly, size_m: tuple[float, float, float]) -> Assembly:
    """Return the model stretched to `size_m`, centred in x and y, on z = 0."""
    model = clean(model)
    low, high = extent_m(model)
    stretch = np.asarray(size_m) / (high - low)
    model = centred(model.moved(pose(scale=tuple(stretch))))
    return model.moved(pose(z=-extent_m(model)[0][2]))
