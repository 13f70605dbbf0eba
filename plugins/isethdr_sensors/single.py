"""Single: one photodiode and one reading per pixel, under any colour filter array."""

from __future__ import annotations

from dataclasses import dataclass

from .limits import Capacity
from .one_reading import OneReadingSensor
from .sensor_model import Photodiode, SensorModel


@dataclass(frozen=True)
class SingleSensor(OneReadingSensor):
    """Take one capture under any filter array, by default monochrome (AR0132AT figures)."""

    cfa: str = "W"
    full_well_e: Capacity = 25455.0  # full well capacity: 2.8 V at 110 uV/e

    def model(self) -> SensorModel:
        """Return the photodiodes and readings of the sensor."""
        return self.assemble(
            [Photodiode("pixel", full_well_e=self.full_well_e, **self.diode_terms())],
            [self.reading()],
        )
