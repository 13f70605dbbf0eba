"""Weights by the rule of the ISETHDR paper: lamps by their maximum, the sky by its 30th percentile,
then all of them by the median of the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from ..errors import ConfigError, did_you_mean
from ..plugins.ranges import Seed, Share, check_ranges
from . import mix, solver
from .limits import Ratio, Reached
from .target import uniform

if TYPE_CHECKING:
    import xarray as xr

GROUPS = ("headlights", "streetlights", "other", "sky")


@dataclass(frozen=True)
class IsetLighting:
    """Weights by the rule of ISETHDR's lightGroupDynamicRangeSet, for comparison with its
    pictures.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # dynamic range: the 30th percentile of the sky's light is set to 200000 cd/m2 / dynamic_range,
    # before all groups are scaled to low_light_cd_m2
    dynamic_range: Ratio = 1e4
    # median luminance of the whole picture; null keeps the luminance of the lamps
    low_light_cd_m2: Reached | None = 10.0
    # uniform random numbers for headlights, streetlights and other; null draws them from seed
    draws: tuple[Share, Share, Share] | None = None
    seed: Seed = 0  # seed of the random luminances

    def __post_init__(self) -> None:
        check_ranges(self)

    def __call__(self, radiance: xr.Dataset) -> xr.DataArray:
        """Return mixed radiance, W m-2 sr-1 nm-1. Its attribute `iset_weights` holds the weights
        before they are scaled to the median.
        """
        names = mix.group_names(radiance)
        self.check_groups(names)
        maps = {g: mix.luminance_map(radiance, g) for g in GROUPS}
        draws = (
            self.draws
            if self.draws is not None
            else tuple(uniform(self.seed, g) for g in GROUPS[:3])
        )
        levels = iset_levels(self.dynamic_range, draws)
        statistics = [solver.statistic(maps[g], "max") for g in GROUPS[:3]] + [
            solver.percentile_of(maps["sky"], 30.0)
        ]
        for name, value in zip(GROUPS, statistics):
            if value <= 0:
                raise ConfigError(
                    f"light group {name!r} is dark in this picture, so lighting iset cannot scale"
                    " it to a luminance; type lighting=targets and name the groups that are lit"
                )
        weights = {g: level / value for g, level, value in zip(GROUPS, levels, statistics)}
        scale = 1.0
        if self.low_light_cd_m2 is not None:
            scale = self.low_light_cd_m2 / solver.percentile_of(
                sum(weights[g] * maps[g] for g in GROUPS), 50.0
            )
        scaled = {g: scale * weights.get(g, 0.0) for g in names}
        return mix.mix(radiance, scaled, iset_weights=weights)

    def check_groups(self, groups: Sequence[str]) -> None:
        """Raise ConfigError unless `groups` contains all four groups of ISET."""
        for name in GROUPS:
            if name not in groups:
                raise ConfigError(
                    f"lighting iset needs the groups {', '.join(GROUPS)}; "
                    f"the scene has no {name!r}{did_you_mean(name, groups)}; type lighting=targets"
                )


def iset_levels(
    dynamic_range: float, draws: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Return the luminances, cd/m2, for headlights, streetlights, other (maxima) and sky (30th
    percentile).

    `draws` are three numbers in [0, 1]. Constants: lightGroupDynamicRangeSet (Liu et al., ISETHDR,
    2025).
    """
    head = 1e4 * max(20 * draws[0], 2)
    return (
        head,
        1e4 * max(5 * draws[1], 1),
        1e-4 * head * max(100 * draws[2], 4),
        2e5 / dynamic_range,
    )
