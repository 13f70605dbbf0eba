"""Dual gain: two readings of one charge, at high and at low conversion gain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from .imaging_sensor import ImagingSensor
from .limits import (
    Capacity,
    ConversionGain,
    DarkCurrent,
    DarkSpread,
    FillFactor,
    Gain,
    Noise,
    Pitch,
    ResponseSpread,
    Swing,
)
from .readout.converter import converter
from .sensor_model import Photodiode, Reading, SensorModel

CAPTURES = ("LCG", "HCG")


@dataclass(frozen=True)
class DualGainSensor(ImagingSensor):
    """Take two captures of one charge, LCG and HCG, at low and at high conversion gain (figures of
    the large photodiode of the OVT sensor).
    """

    pitch_um: Pitch = 2.8
    cfa: str = "GRBG"
    fill_factor: FillFactor = 1.0  # photodiode area / pixel area
    full_well_e: Capacity = 22000.0  # full well capacity
    dark_e_per_s: DarkCurrent = 25.6  # dark current at 60 C (assumption)
    dark_spread: DarkSpread = 0.2  # dark signal nonuniformity: rms over pixels / mean (assumption)
    # photo response nonuniformity: rms over pixels / mean (assumption)
    prnu: ResponseSpread = 0.005

    # --- readings: LCG, HCG ---
    # conversion gains
    conversion_gain_uv_per_e: tuple[ConversionGain, ConversionGain] = (49.0, 200.0)
    analog_gain: tuple[Gain, Gain] = (1.0, 1.0)  # analog gains before the converter
    swing_v: tuple[Swing, Swing] = (1.078, 1.078)  # full scale of the converter
    read_noise_e: tuple[Noise, Noise] = (3.05, 0.83)  # rms read noise
    dsnu_e: tuple[Noise, Noise] = (0.0, 0.0)  # rms over pixels of the offset; persistent
    # rms over columns of the offset; persistent (assumption)
    column_e: tuple[Noise, Noise] = (0.1, 0.1)

    def gained_reading(self) -> int:
        """Return the number of the reading that automatic gain amplifies: HCG."""
        return CAPTURES.index("HCG")

    def with_gain(self, factor: float) -> Self:
        """Return this sensor with the analog gain of HCG multiplied by `factor`, and automatic gain
        switched off.
        """
        k = self.gained_reading()
        gains = self.analog_gain
        raised = (*gains[:k], gains[k] * factor, *gains[k + 1 :])
        return replace(self, analog_gain=raised, auto_gain_max=1.0)

    def model(self) -> SensorModel:
        """Return the photodiodes and readings of the sensor."""
        diode = Photodiode(
            "pixel",
            self.fill_factor,
            self.full_well_e,
            self.dark_e_per_s,
            self.dark_spread,
            self.prnu,
            **self.diode_terms(),
        )
        return self.assemble(
            [diode],
            (
                Reading(
                    capture,
                    0,
                    self.read_noise(read, conversion, gain),
                    dsnu,
                    column,
                    **self.reading_terms(),
                    **converter(conversion, gain, swing, self.bits, self.black_dn),
                )
                for capture, read, dsnu, column, conversion, gain, swing in zip(
                    CAPTURES,
                    self.read_noise_e,
                    self.dsnu_e,
                    self.column_e,
                    self.conversion_gain_uv_per_e,
                    self.analog_gain,
                    self.swing_v,
                    strict=True,
                )
            ),
        )
