"""The choice of traffic: drawn by the placer, or driven by SUMO."""

from __future__ import annotations

from dataclasses import replace

from isethdr_core.errors import ConfigError, did_you_mean

from ...placing.plan import Densities
from ...roads.kinds import BaseRoad
from ...things.stock import Stock
from .demand import Wanted
from .traffic import SumoTraffic, drawn_traffic

PLACER = "placer"
SUMO = "sumo"
CHOICES = (PLACER, SUMO)


def check_traffic(traffic: str, scenario: str) -> None:
    """Raise ConfigError for a choice that is not there, and for SUMO beside a scenario."""
    if traffic not in CHOICES:
        raise ConfigError(
            f"scene.traffic is {traffic!r}{did_you_mean(traffic, CHOICES)}; expected"
            f" {' or '.join(CHOICES)}; type for example scene.traffic=sumo"
        )
    if traffic != PLACER and scenario:
        raise ConfigError(
            f"scene.traffic is {traffic!r} beside scene.scenario, which places its own vehicles;"
            " expected one of both; type for example scene.traffic=placer"
        )


def sumo_traffic(
    base: BaseRoad, stock: Stock, seed: int, densities: Densities, second_s: float
) -> SumoTraffic:
    """Return SUMO's traffic of densities on a road.

    Parameters
    ----------
    second_s : of its simulation, at which the scene begins.

    Raises
    ------
    ConfigError : SUMO is not installed; a density that cannot be placed.
    CatalogError : SUMO fails.
    """
    wanted = Wanted(densities.vehicles_per_km, densities.riders_per_km, second_s)
    return drawn_traffic(base, stock, seed, wanted)


def rest_of(densities: Densities) -> Densities:
    """Return what the placer adds to SUMO's traffic: nobody whom SUMO's drivers would not see."""
    return replace(densities, vehicles_per_km=0.0, riders_per_km=0.0, crossing_share=0.0)
