"""Single: one photodiode and one reading per pixel, under any colour filter array."""

from __future__ import annotations

from dataclasses import dataclass

from .converter import converter
from .imaging_sensor import ImagingSensor
from .sensor_model import Photodiode, Reading, SensorModel


@dataclass(frozen=True)
class SingleSensor(ImagingSensor):
    """Take one capture under any filter array, monochrome unless told (AR0132AT figures)."""

    cfa: str = "W"                  # repeated pattern of filters, rows parted by / where it is no square
    fill_factor: float = 1.0        # assumption: microlenses collect over the whole pixel
    full_well_e: float = 25455.0    # 2.8 V at 110 uV/e
    conversion_gain_uv_per_e: float = 110.0
    analog_gain: float = 1.0        # multiplier
    swing_v: float = 2.8            # full scale of the converter
    read_noise_e: float = 9.1       # rms; 1 mV
    dark_e_per_s: float = 9.1       # at 60 C (assumption); 1 mV/s
    dark_spread: float = 0.2        # rms over pixels / mean (assumption)
    prnu: float = 0.005             # rms over pixels / mean (assumption)
    dsnu_e: float = 0.0             # rms over pixels of the offset
    column_e: float = 0.1           # rms over columns of the offset (assumption)

    def model(self) -> SensorModel:
        """Return what the sensor is made of."""
        diode = Photodiode("pixel", self.fill_factor, self.full_well_e, self.dark_e_per_s, self.dark_spread, self.prnu,
                           **self.diode_terms())
        reading = Reading("single", 0, self.read_noise_e, self.dsnu_e, self.column_e, **self.reading_terms(),
                          **converter(self.conversion_gain_uv_per_e, self.analog_gain, self.swing_v, self.bits, self.black_dn))
        return self.assemble([diode], [reading])
