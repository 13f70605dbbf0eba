"""Energy of coated and metallic surfaces in scalar variants: the light that is lost between
facets, and a partial compensation. Other variants lose none (`compensated_surface`).

Mitsuba's rough surfaces follow light to one facet only. Light that would meet another facet is
lost, and the base under a coat receives less. In a white furnace a coat of roughness 0.55 loses 30
%. Here the base is made brighter by a factor, such that nothing is lost at the best angle and no
angle gains energy. The remaining loss, most of it at grazing angles, is stated. Metals have no base
to brighten.

`coat_energy.csv` is made by `scripts/coat_energy.py`: white furnaces from 0 to 85 degrees.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from isethdr_core.scene import Material

BELOW = 0.99  # less than any factor of the table


class CoatEnergy(NamedTuple):
    """`base`: factor on the reflectance of the base. `least`: share of its light that a white
    surface then reflects at its worst angle, 0 to 85 degrees.
    """

    base: float
    least: float


@cache
def coat_energy(kind: str, roughness: float, index: float = 1.5) -> CoatEnergy:
    """Return the numbers of a `plastic` or `conductor`; beyond the table those of its border.

    The roughness is 0 to 1, the index of a plastic 1.2 to 2; between, the table is linear.

    Parameters
    ----------
    kind : `plastic` or `conductor`.
    roughness : Beckmann alpha, 0 to 1.
    index : of refraction of a plastic, 1.2 to 2.
    """
    alphas, indices, base, least = _table(kind)
    # the root of what is added is nearly straight: a line would give back 0.3 % too much
    root = np.sqrt(base - BELOW)
    bases = [float(np.interp(roughness, alphas, column)) ** 2 + BELOW for column in root.T]
    leasts = [float(np.interp(roughness, alphas, column)) for column in least.T]
    return CoatEnergy(*(float(np.interp(index, indices, row)) for row in (bases, leasts)))


def lost_light(materials: Iterable[Material]) -> tuple[float, str]:
    """Return the largest share of light that one of `materials` loses at any angle, and its name.

    The share is that of a white material, an upper bound for a darker one.
    """
    rough = [m for m in materials if m.kind in ("plastic", "conductor")]
    if not rough:
        return 0.0, ""
    losses = [1 - coat_energy(m.kind, m.roughness, m.index).least for m in rough]
    worst = int(np.argmax(losses))
    return losses[worst], rough[worst].name


@cache
def _table(kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return roughnesses, indices, and (roughness, index) of base and least."""
    with files(__package__).joinpath("coat_energy.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] == kind]
    column = {k: np.array([float(r[k]) for r in rows]) for k in rows[0] if k != "kind"}
    alphas = np.unique(column["roughness"])
    indices = np.unique(column["index"])
    shape = len(alphas), len(indices)
    return alphas, indices, column["base"].reshape(shape), column["least"].reshape(shape)
