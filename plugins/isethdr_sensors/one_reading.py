"""One reading: the fields of a sensor that reads one photodiode per pixel once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

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

    # photodiode area / pixel area (assumption: microlenses collect over the whole pixel)
    fill_factor: FillFactor = 1.0
    conversion_gain_uv_per_e: ConversionGain = 110.0  # conversion gain of the pixel
    analog_gain: Gain = 1.0  # analog gain before the converter
    swing_v: Swing = 2.8  # full scale of the converter
    read_noise_e: Noise = 9.1  # rms read noise; 1 mV at 110 uV/e
    dark_e_per_s: DarkCurrent = 9.1  # dark current at 60 C (assumption); 1 mV/s at 110 uV/e
    dark_spread: DarkSpread = 0.2  # dark signal nonuniformity: rms over pixels / mean (assumption)
    # photo response nonuniformity: rms over pixels / mean (assumption)
    prnu: ResponseSpread = 0.005
    dsnu_e: Noise = 0.0  # rms over pixels of the offset; persistent
    column_e: Noise = 0.1  # rms over columns of the offset; persistent (assumption)

    def diode_terms(self) -> dict:
        """Return all fields of the `Photodiode` except its name and full well."""
        terms = {
            name: getattr(self, name)
            for name in ("fill_factor", "dark_e_per_s", "dark_spread", "prnu")
        }
        return {**super().diode_terms(), **terms}

    def gained_reading(self) -> int:
        """Return the number of the reading that automatic gain meters: the first or only one."""
        return 0

    def with_gain(self, factor: float) -> Self:
        """Return this sensor with the analog gain multiplied by `factor`, and automatic gain
        switched off.
        """
        return replace(self, analog_gain=self.analog_gain * factor, auto_gain_max=1.0)

    def reading(self) -> Reading:
        """Return the only reading of a pixel."""
        return Reading(
            "single",
            0,
            self.read_noise(self.read_noise_e, self.conversion_gain_uv_per_e, self.analog_gain),
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
