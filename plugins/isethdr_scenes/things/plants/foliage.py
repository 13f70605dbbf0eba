"""Leaves at three levels of detail, and meshes fitted to the size that a thing states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, pose, unit
from ...geometry.surroundings.plants import cards
from ..detail import centred, clean, extent_m
from ..thing import Detail

# share of the leaves that a level shows; fewer leaves are larger, so that their area is the same
SHOWN: dict[Detail, float] = {"near": 1.0, "middle": 0.27, "far": 0.06}
LARGEST = 3.2  # largest factor on the size of leaves


@dataclass(frozen=True)
class Leaves:
    """Leaves in random order, so that the first ones are an unbiased sample."""

    centres: np.ndarray  # (n, 3) points where the leaves begin, m
    normals: np.ndarray  # (n, 3) directions that the leaves face
    along: np.ndarray  # (n, 3) directions from stalk to tip
    length_m: float
    slim: float  # width / length

    def piece(self, name: str, material: str, detail: Detail) -> Piece:
        """Return the mesh of the leaves that a level of detail shows.

        Parameters
        ----------
        name : name of the piece.
        material : name of the leaves' material.
        detail : level of detail; coarser levels have fewer and larger leaves.
        """
        count = max(1, round(SHOWN[detail] * len(self.centres)))
        grown = min(LARGEST, float(np.sqrt(1 / SHOWN[detail])))
        sizes = self.length_m * grown * (0.75 + 0.5 * _spread(count))
        # a large leaf stands for a clump, which is wider than a slim leaf
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
    """Return numbers (count,) that fill 0 to 1 evenly, the same at each level of detail."""
    return np.modf(np.arange(count) * 0.6180339887)[0]


def fitted(model: Assembly, size_m: tuple[float, float, float]) -> Assembly:
    """Return the model stretched to `size_m`, m, centred in x and y, on z = 0."""
    model = clean(model)
    low, high = extent_m(model)
    stretch = np.asarray(size_m) / (high - low)
    model = centred(model.moved(pose(scale=tuple(stretch))))
    return model.moved(pose(z=-extent_m(model)[0][2]))
