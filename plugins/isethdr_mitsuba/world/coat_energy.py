"""Energy of coated and metallic surfaces in scalar variants: the light that is lost between
facets, and a partial compensation. Other variants lose none (`compensated_surface`).

Mitsuba's rough surfaces follow light to one facet only. Light that would hit another facet is lost,
and the base under a coat receives less. In a white furnace a coat of roughness 0.55 loses 30 %.
Here the reflectance of the base is multiplied by a factor, so that nothing is lost at the best
angle and no angle gains energy. The remaining loss, most of it at grazing angles, is stated in the
ledger. Metals have no base to brighten.

`scripts/coat_energy.py` computes `coat_energy.csv` with white furnaces from 0 to 85 degrees.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from isethdr_core.scene import Material

BELOW = 0.99  # a value below all factors of the table


class CoatEnergy(NamedTuple):
    """Compensation and remaining energy of a coated or metallic surface."""

    base: float  # factor on the reflectance of the base
    least: float  # share of light that a white surface then reflects at its worst angle, 0..85 deg


@cache
def coat_energy(kind: str, roughness: float, index: float = 1.5) -> CoatEnergy:
    """Return the numbers of a `plastic` or `conductor`, interpolated in the table. Values outside
    the table are replaced by the nearest value in it.

    Parameters
    ----------
    kind : `plastic` or `conductor`.
    roughness : Beckmann alpha, 0 to 1.
    index : index of refraction of a plastic, 1.2 to 2.
    """
    alphas, indices, base, least = _table(kind)
    # The square root of base - BELOW is nearly linear in the roughness. Linear interpolation of
    # base itself would return 0.3 % too much light.
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
    """Return roughnesses, indices, and tables (roughness, index) of base and least."""
    with files(__package__).joinpath("coat_energy.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] == kind]
    column = {k: np.array([float(r[k]) for r in rows]) for k in rows[0] if k != "kind"}
    alphas = np.unique(column["roughness"])
    indices = np.unique(column["index"])
    shape = len(alphas), len(indices)
    return alphas, indices, column["base"].reshape(shape), column["least"].reshape(shape)
