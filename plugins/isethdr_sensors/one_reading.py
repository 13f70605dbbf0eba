"""One reading: the fields of a sensor that reads one photodiode per pixel once."""

from __future__ import annotations

from dataclasses import dataclass

from .imaging_sensor import ImagingSensor
from .limits import (
    ConversionGain,
    DarkCurrent,
    DarkSpread,
    FillFactor,
    Gain,
    Noise,
    ResponseSpread,
    Swing,
)
from .readout.converter import converter
from .sensor_model import Reading


@dataclass(frozen=True)
class OneReadingSensor(ImagingSensor):
    """A sensor with one photodiode and one reading per pixel (AR0132AT figures)."""

    fill_factor: FillFactor = 1.0  # assumption: microlenses collect over the whole pixel
    conversion_gain_uv_per_e: ConversionGain = 110.0
    analog_gain: Gain = 1.0  # multiplier
    swing_v: Swing = 2.8  # full scale of the converter
    read_noise_e: Noise = 9.1  # rms; 1 mV
    dark_e_per_s: DarkCurrent = 9.1  # at 60 C (assumption); 1 mV/s
    dark_spread: DarkSpread = 0.2  # rms over pixels / mean (assumption)
    prnu: ResponseSpread = 0.005  # rms over pixels / mean (assumption)
    dsnu_e: Noise = 0.0  # rms over pixels of the offset
    column_e: Noise = 0.1  # rms over columns of the offset (assumption)

    def diode_terms(self) -> dict:
        """Return the fields of the `Photodiode` but for its name and full well."""
        own = {
            name: getattr(self, name)
            for name in ("fill_factor", "dark_e_per_s", "dark_spread", "prnu")
        }
        return {**super().diode_terms(), **own}

    def reading(self) -> Reading:
        """Return the reading."""
        return Reading(
            "single",
            0,
            self.read_noise_e,
            self.dsnu_e,
            self.column_e,
            **self.reading_terms(),
            **converter(
                self.conversion_gain_uv_per_e,
                self.analog_gain,
                self.swing_v,
                self.bits,
                self.black_dn,
            ),
        )
