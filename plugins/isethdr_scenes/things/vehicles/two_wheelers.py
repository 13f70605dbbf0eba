"""Functions for bicycles, motorcycles and scooters: shapes from `data/two_wheelers.yaml`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...geometry.mesh.piece import Assembly
from ..detail import clean, coarser
from ..ranges import drawn, generator, one_of, read
from ..riding import Point, RidingPosition
from ..thing import Detail

FILE = "two_wheelers.yaml"
CELL_M: dict[Detail, float] = {"middle": 0.012, "far": 0.035}


def shares(group: str) -> dict[str, float]:
    """Return the families of a group of the file with their shares."""
    return {name: family["share"] for name, family in read(FILE)[group]["families"].items()}


def fields_of(group: str, family: str, variant: int) -> dict[str, Any]:
    """Return the fields of the shape of one member, including its `colour`.

    Parameters
    ----------
    group : bicycle, motorcycle or scooter.
    family : family of the group.
    variant : number of the member; it seeds the draw.
    """
    rng = generator(family, variant)
    given = drawn(read(FILE)[group]["families"][family], rng)
    given.pop("share")
    fields = {
        key: rng.random() < 0.5 if v == "half" and key != "fairing" else v
        for key, v in given.items()
    }
    return fields | {"colour": one_of(read(FILE)[group]["paints"], rng)}


def at_detail(model: Assembly, detail: Detail) -> Assembly:
    """Return the mesh at a level of detail, without faces that have no area."""
    model = clean(model)
    return coarser(model, CELL_M[detail]) if detail in CELL_M else model


def position(saddle: np.ndarray, grip: np.ndarray, feet: tuple[np.ndarray, ...]) -> RidingPosition:
    """Return the riding position from the left grip and both feet.

    Parameters
    ----------
    saddle : (3,) place where the rider sits, m.
    grip : (3,) the left grip, m; the right grip is its mirror image.
    feet : (3,) the left and the right foot, m.
    """
    point = lambda v: tuple(float(c) for c in v)
    left: Point = point(grip)
    right: Point = point(grip * np.array([1, -1, 1]))
    return RidingPosition(point(saddle), (left, right), (point(feet[0]), point(feet[1])))
