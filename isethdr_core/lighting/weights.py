"""Lighting whose weights are known beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from ..plugins.ranges import Seed, check_ranges
from ..uncertainty import ledger
from . import mix
from .limits import Luminance, Weight
from .mix import all_weights
from .modulation import asked_for, check_groups, parse

if TYPE_CHECKING:
    import xarray as xr

    from ..pipeline.demand import Demand


@dataclass(frozen=True)
class WeightsLighting:
    """Fixed weights: multiply each light group by its weight and sum."""

    THREAD_SAFE: ClassVar[bool] = True

    # weights {group: weight}; 1 keeps the light of the scene
    weights: dict[str, Weight] = field(default_factory=dict)
    others: Weight = 0.0  # weight of every group that `weights` does not name
    # mean luminance to which each group is scaled before weighting; 0 keeps absolute radiance
    relative_to_mean_cd_m2: Luminance = 0.0
    # temporal modulation {group: {frequency_hz, duty or depth, phase}}
    modulation: dict[str, Any] = field(default_factory=dict)
    seed: Seed = 0  # seed of phases that are ranges
    WITHIN_FIELD: ClassVar[bool] = True  # tiles beyond the field do not change the weights

    def __post_init__(self) -> None:
        check_ranges(self)
        self._varying()

    def __call__(self, radiance: xr.Dataset) -> xr.DataArray:
        """Return mixed radiance, W m-2 sr-1 nm-1. Its attribute `weights` holds the factors on the
        scene's own radiance.
        """
        weights = mix.all_weights(self.weights, self.others, mix.group_names(radiance))
        if self.relative_to_mean_cd_m2:
            weights = {g: w and w * self._scale(radiance, g) for g, w in weights.items()}
        return mix.mix(radiance, weights, self._varying())

    def check_groups(self, groups: Sequence[str]) -> None:
        """Raise ConfigError if a weight or a modulation names a group that is not in `groups`."""
        all_weights(self.weights, self.others, groups)
        check_groups(asked_for(self.modulation, self.weights), groups)

    def narrow(self, demand: Demand) -> Demand:
        """Return the demand without the groups of weight 0."""
        return without_dark_groups(demand, self.weights, self.others)

    def _varying(self) -> dict[Any, Any]:
        """Return the modulation of the groups that have a weight."""
        return {
            g: m
            for g, m in parse(self.modulation, self.seed).items()
            if self.weights.get(g, self.others) != 0
        }

    def _scale(self, radiance: xr.DataArray, group: str) -> float:
        mean = float(mix.luminance_map(radiance, group).mean())
        if mean == 0:
            ledger.left_out(
                f"group {group}",
                "its mean luminance in the picture is 0, so no weight can be relative to it",
                0.0,
                "cd/m2",
            )
            return 0.0
        return self.relative_to_mean_cd_m2 / mean


@dataclass(frozen=True)
class IdealLighting:
    """Sum all light groups with weight 1."""

    THREAD_SAFE: ClassVar[bool] = True
    WITHIN_FIELD: ClassVar[bool] = True

    def __call__(self, radiance: xr.Dataset) -> xr.DataArray:
        """Return mixed radiance, W m-2 sr-1 nm-1: the plain sum of all groups."""
        return mix.mix(radiance, dict.fromkeys(mix.group_names(radiance), 1.0))


def without_dark_groups(demand: Demand, weights: dict[str, float], others: float) -> Demand:
    """Return the demand without the groups of weight 0, and state each in the ledger.

    If neither the demand nor the weights list all groups, the groups of the scene are unknown, and
    nothing is dropped.

    Parameters
    ----------
    demand : demand for the scene radiance.
    weights : {light group: weight}.
    others : weight of every group that `weights` does not name.
    """
    if demand.groups is None and others != 0:
        return demand
    listed = tuple(weights) if demand.groups is None else demand.groups
    lit = tuple(g for g in listed if weights.get(g, others) != 0)
    if not lit:  # a scene without a light group cannot be made; weights of 0 then make it black
        return demand
    for group in listed:
        if group not in lit:
            ledger.left_out(f"group {group}", "weight 0", 0.0, "cd/m2", needless=True)
    return demand.with_groups(lit)
