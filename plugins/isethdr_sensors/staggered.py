"""Staggered: several exposures of one photodiode, one after the other, read with one gain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Self

from isethdr_core.errors import ConfigError
from isethdr_core.sequence.exposure import Exposure

from .limits import Ratio
from .sensor_model import SensorModel
from .single import SingleSensor
from .timing import auto_exposure

if TYPE_CHECKING:
    import xarray as xr

    from .timing.auto_exposure import Automatic


@dataclass(frozen=True)
class StaggeredSensor(SingleSensor):
    """Take several exposures one after the other: T1, the longest, then T2, ... (AR0132AT figures).

    Each exposure of a row starts when the previous one ends. The scene moves between them only with
    `motion.within_exposure`.
    """

    cfa: str = "RGGB"
    # exposure times / exposure_s; the first is 1
    exposure_ratios: tuple[Ratio, ...] = (1.0, 1 / 16, 1 / 256)
    # with an automatic exposure: the rule sets T1, the brightest pixel sets the last exposure, and
    # the others lie between them at equal ratios
    exposure_each: bool = False

    def automatic(self, light: xr.DataArray) -> Automatic:
        """Return the exposures that the sensor chooses for this light."""
        if self.exposure_each:
            return auto_exposure.one_by_one(self, light)
        return super().automatic(light)

    def at_exposure(self, exposure: Exposure) -> Self:
        """Return this sensor with exposures that were chosen for earlier light.

        Raises
        ------
        ConfigError : the number of ratios differs from the number of exposures.
        """
        ratios = exposure.ratios or self.exposure_ratios
        if len(ratios) != len(self.exposure_ratios):
            raise ConfigError(
                f"an exposure of {type(self).__name__} has the ratios {ratios}; expected"
                f" {len(self.exposure_ratios)} of them, or none; type for example"
                f" ratios: {list(self.exposure_ratios)}"
            )
        single = super().at_exposure(replace(exposure, ratios=()))
        return replace(single, exposure_ratios=ratios)

    def shot_time_s(self, width_m: float, height_m: float) -> float:
        """Return the duration, s, of a shot of an image of this size in metres. With automatic
        exposure it is that of the longest exposure. With `exposure_each`, all exposures may be
        nearly as long as the first.
        """
        time_s = super().shot_time_s(width_m, height_m)
        if self.exposure_rule == "fixed" or not self.exposure_each:
            return time_s
        return time_s + self.exposure_max_s * sum(1 - ratio for ratio in self.exposure_ratios)

    def model(self) -> SensorModel:
        """Return the photodiodes and readings of the sensor."""
        ratios = self.exposure_ratios
        if not ratios or ratios[0] != 1 or any(b >= a for a, b in pairwise(ratios)):
            raise ConfigError(
                f"sensor.exposure_ratios is {ratios!r}; expected shares of exposure_s from 1"
                " downwards, e.g. [1, 0.0625]"
            )
        single = super().model()
        names = [f"T{k}" for k in range(1, len(ratios) + 1)]
        return replace(
            single,
            photodiodes=tuple(
                replace(
                    single.photodiodes[0],
                    name=name,
                    silicon="pixel",
                    exposure_share=share,
                    start_share=sum(ratios[:k]),
                )
                for k, (name, share) in enumerate(zip(names, ratios, strict=True))
            ),
            readings=tuple(
                replace(single.readings[0], capture=name, diode=k) for k, name in enumerate(names)
            ),
        )
