"""Dual gain: two readings of one charge, at high and at low conversion gain."""

from __future__ import annotations

from dataclasses import dataclass

from .converter import converter
from .imaging_sensor import ImagingSensor
from .sensor_model import Photodiode, Reading, SensorModel

CAPTURES = ("LCG", "HCG")


@dataclass(frozen=True)
class DualGainSensor(ImagingSensor):
    """Take two captures of one charge, at low and at high conversion gain: LCG, HCG (large photodiode of the OVT figures)."""

    pitch_um: float = 2.8
    cfa: str = "GRBG"               # repeated pattern of filters, rows parted by / where it is no square
    fill_factor: float = 1.0
    full_well_e: float = 22000.0
    dark_e_per_s: float = 25.6      # at 60 C (assumption)
    dark_spread: float = 0.2        # rms over pixels / mean (assumption)
    prnu: float = 0.005             # rms over pixels / mean (assumption)

    # --- readings: LCG, HCG ---
    conversion_gain_uv_per_e: tuple[float, float] = (49.0, 200.0)
    analog_gain: tuple[float, float] = (1.0, 1.0)           # multipliers
    swing_v: tuple[float, float] = (1.078, 1.078)           # full scale of the converter
    read_noise_e: tuple[float, float] = (3.05, 0.83)        # rms
    dsnu_e: tuple[float, float] = (0.0, 0.0)                # rms over pixels of the offset
    column_e: tuple[float, float] = (0.1, 0.1)              # rms over columns of the offset (assumption)

    def model(self) -> SensorModel:
        """Return what the sensor is made of."""
        diode = Photodiode("pixel", self.fill_factor, self.full_well_e, self.dark_e_per_s, self.dark_spread, self.prnu,
                           **self.diode_terms())
        return self.assemble([diode], (
            Reading(capture, 0, read, dsnu, column, **self.reading_terms(), **converter(conversion, gain, swing, self.bits, self.black_dn))
            for capture, read, dsnu, column, conversion, gain, swing in zip(
                CAPTURES, self.read_noise_e, self.dsnu_e, self.column_e, self.conversion_gain_uv_per_e, self.analog_gain, self.swing_v,
                strict=True)))
