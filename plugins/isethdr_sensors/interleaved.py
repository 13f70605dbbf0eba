"""Interleaved: two exposures or two sensitivities side by side in the filter array, in one
reading.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from isethdr_core.errors import ConfigError

from .limits import LowerCase
from .sensor_model import SensorModel
from .single import SingleSensor


@dataclass(frozen=True)
class InterleavedSensor(SingleSensor):
    """Take one capture in which pixels written in lower case in `cfa` collect less light (AR0132AT
    figures).

    The captures have the channels of both cases (R, G, B, r, g, b), each with its own quantum
    efficiency. A shorter exposure is part of that quantum efficiency.
    """

    # repeated pattern of pairs of rows; a lower case filter marks pixels that collect less
    cfa: str = "RGRG/GBGB/rgrg/gbgb"
    # light of a lower case pixel / light of an upper case pixel
    lower_case_percent: LowerCase = 6.25
    # quantity that differs between the pixels; exposure reduces dark charge as well
    varies: Literal["exposure", "sensitivity"] = "exposure"

    def model(self) -> SensorModel:
        """Return the photodiodes and readings of the sensor."""
        letters = self.cfa.replace("/", "")
        if letters.isupper() or letters.islower():
            raise ConfigError(
                f"sensor.cfa={self.cfa!r} has one case only; expected upper and lower case letters,"
                " e.g. RGRG/GBGB/rgrg/gbgb"
            )
        share = self.lower_case_percent / 100
        return replace(
            super().model(),
            lower_case_share=share,
            lower_case_dark=share if self.varies == "exposure" else 1.0,
        )
