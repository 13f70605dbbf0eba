"""Exposure of one frame: exposure time and gain, their limits, and the table of a config."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from math import inf
from typing import Any

from ..errors import ConfigError, did_you_mean

NODE = "exposures"
EXAMPLE = "exposures={bayer: {exposure_s: 0.004}}"


@dataclass(frozen=True)
class Exposure:
    """Exposure time and gain of one frame."""

    exposure_s: float  # exposure time of the longest capture
    gain: float = 1.0  # factor on the analog gain that the sensor is configured with
    # exposure times of all captures / exposure_s, where they are solved one by one; empty: as
    # configured
    ratios: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for value in (self.exposure_s, self.gain, *self.ratios):
            if not (_is_number(value) and 0 < value < inf):
                raise ConfigError(
                    f"an exposure holds {value!r}; expected numbers above 0; type for example"
                    f" '{EXAMPLE}'"
                )
        if self.gain < 1:
            raise ConfigError(
                f"an exposure has the gain {self.gain!r}; expected 1 or more, a factor on the"
                f" configured gain; type for example '{EXAMPLE}'"
            )

    @property
    def product_s(self) -> float:
        """Exposure time x gain, s."""
        return self.exposure_s * self.gain


@dataclass(frozen=True)
class ExposureLimits:
    """The exposures that an automatic exposure may choose."""

    shortest_s: float
    longest_s: float
    most_gain: float = 1.0  # largest gain, used in addition when the exposure is at its longest
    period_s: float = 0.0  # the exposure takes whole periods of flickering lamps; 0: any time


@dataclass(frozen=True)
class SettledExposure:
    """The exposure to which a camera settles while the light stays as it is."""

    exposure: Exposure
    limits: ExposureLimits

    def nearest(self, product_s: float) -> Exposure:
        """Return the exposure and gain with a given product, within the limits. The gain is 1 as
        long as the exposure time suffices. Captures keep their ratios.

        Parameters
        ----------
        product_s : exposure time x gain, s.
        """
        limits = self.limits
        exposure_s = min(max(product_s, limits.shortest_s), limits.longest_s)
        if limits.period_s:
            periods = int(exposure_s / limits.period_s * (1 + ROUNDING))
            exposure_s = max(periods, 1) * limits.period_s
        gain = min(max(product_s / exposure_s, 1.0), limits.most_gain)
        return Exposure(exposure_s, gain, self.exposure.ratios)


ROUNDING = 1e-9  # relative: tolerance for whole periods, because products are rounded


def exposures_of(config: Mapping[str, Any], cameras: Iterable[str]) -> dict[str, Exposure] | None:
    """Return the carried exposures of a composed config by camera; None if the run is no frame of a
    sequence.

    Parameters
    ----------
    config : composed config.
    cameras : names of the cameras of the run.

    Raises
    ------
    ConfigError : an unknown camera or key, or a value that is no exposure.
    """
    table = config.get(NODE)
    if table is None:
        return None
    if not isinstance(table, Mapping):
        raise ConfigError(
            f"{NODE} is {table!r}; expected a table of cameras, or null; type for example"
            f" '{EXAMPLE}'"
        )
    names = list(cameras)
    found = {}
    for name, values in table.items():
        if name not in names:
            raise ConfigError(
                f"{NODE} names {name!r}, which is no camera{did_you_mean(str(name), names)};"
                f" expected one of {', '.join(names)}"
            )
        found[str(name)] = _exposure(str(name), values)
    return found


def _exposure(camera: str, values: Any) -> Exposure:
    known = [field.name for field in fields(Exposure)]
    keys = list(values) if isinstance(values, Mapping) else []
    if "exposure_s" not in keys or not set(keys) <= set(known):
        raise ConfigError(
            f"{NODE}.{camera} is {values!r}; expected exposure_s, and where needed gain and ratios;"
            f" type for example '{EXAMPLE}'"
        )
    ratios = values.get("ratios") or ()
    if isinstance(ratios, str) or not isinstance(ratios, Sequence):
        raise ConfigError(
            f"{NODE}.{camera}.ratios is {ratios!r}; expected a list, one number for each capture;"
            f" type for example '{NODE}={{{camera}: {{exposure_s: 0.004, ratios: [1, 0.1]}}}}'"
        )
    return Exposure(values["exposure_s"], values.get("gain", 1.0), tuple(ratios))


def as_config(exposures: Mapping[str, Exposure]) -> dict[str, Any]:
    """Return the table of a config that states these exposures, as plain data."""
    return {name: asdict(one) | {"ratios": list(one.ratios)} for name, one in exposures.items()}


def without_exposures(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a run that name it: without the table if no exposure is carried, so
    that the run has the name of a single shot.
    """
    return {k: v for k, v in settings.items() if k != NODE or v is not None}


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
