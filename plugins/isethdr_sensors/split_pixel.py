"""Split-pixel sensor: a large and a small photodiode in every pixel, three or four readings of one
exposure.

LPLG and LPHG read the charge of the large photodiode at low and high gain; SPLG and SPHG read that
of the small one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from isethdr_core.errors import ConfigError

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

CAPTURES = ("LPLG", "LPHG", "SPLG", "SPHG")
DIODES = (0, 0, 1, 1)
# largest sum of the fill factors; ISETHDR gives the large photodiode the whole pixel, the small one
# 0.01
LARGEST_FILL = 1.01


@dataclass(frozen=True)
class SplitPixelSensor(ImagingSensor):
    """Take three captures with a split-pixel sensor, LPLG, LPHG and SPLG, or four with SPHG (OVT
    figures).
    """

    pitch_um: Pitch = 2.8
    cfa: str = "GRBG"

    # --- photodiodes: large, small ---
    fill_factor: tuple[FillFactor, FillFactor] = (1.0, 0.01)  # photodiode area / pixel area
    full_well_e: tuple[Capacity, Capacity] = (22000.0, 7900.0)  # full well capacities
    # dark currents at 60 C (assumption)
    dark_e_per_s: tuple[DarkCurrent, DarkCurrent] = (25.6, 4.2)
    # dark signal nonuniformity: rms over pixels / mean (assumption)
    dark_spread: tuple[DarkSpread, DarkSpread] = (0.2, 0.2)
    # photo response nonuniformity: rms over pixels / mean (assumption)
    prnu: tuple[ResponseSpread, ResponseSpread] = (0.005, 0.005)

    # --- readings: LPLG, LPHG, SPLG (and SPHG) ---
    conversion_gain_uv_per_e: tuple[ConversionGain, ...] = (49.0, 49.0, 49.0)  # conversion gains
    # analog gains before the converter; the full scale of LPHG is 5390 e
    analog_gain: tuple[Gain, ...] = (1.0, 200 / 49, 1.0)
    swing_v: tuple[Swing, ...] = (1.078, 1.078, 0.3871)  # full scale of the converter
    read_noise_e: tuple[Noise, ...] = (3.05, 0.83, 0.83)  # rms read noise
    dsnu_e: tuple[Noise, ...] = (0.0, 0.0, 0.0)  # rms over pixels of the offset; persistent
    # rms over columns of the offset; persistent (assumption)
    column_e: tuple[Noise, ...] = (0.1, 0.1, 0.1)

    def gained_reading(self) -> int:
        """Return the number of the reading that automatic gain amplifies: LPHG."""
        return CAPTURES.index("LPHG")

    def with_gain(self, factor: float) -> Self:
        """Return this sensor with the analog gain of LPHG multiplied by `factor`, and automatic
        gain switched off.
        """
        k = self.gained_reading()
        gains = self.analog_gain
        raised = (*gains[:k], gains[k] * factor, *gains[k + 1 :])
        return replace(self, analog_gain=raised, auto_gain_max=1.0)

    def model(self) -> SensorModel:
        """Return the photodiodes and readings of the sensor."""
        per_reading = (
            "read_noise_e",
            "dsnu_e",
            "column_e",
            "conversion_gain_uv_per_e",
            "analog_gain",
            "swing_v",
        )
        counts = {name: len(getattr(self, name)) for name in per_reading}
        if set(counts.values()) not in ({3}, {4}):
            raise ConfigError(
                "the fields of the sensor have these numbers of values:"
                f" {', '.join(f'{name} {count}' for name, count in counts.items())}; expected 3"
                " each (LPLG, LPHG, SPLG) or 4 each (and SPHG)"
            )
        if sum(self.fill_factor) > LARGEST_FILL:
            raise ConfigError(
                f"sensor.fill_factor is {list(self.fill_factor)}, together"
                f" {sum(self.fill_factor):g}; expected at most {LARGEST_FILL}: both photodiodes"
                " share the pixel; type sensor.fill_factor=[0.9,0.1]"
            )
        diodes = [
            Photodiode(*values, **self.diode_terms())
            for values in zip(
                ("large", "small"),
                self.fill_factor,
                self.full_well_e,
                self.dark_e_per_s,
                self.dark_spread,
                self.prnu,
                strict=True,
            )
        ]
        # the fourth reading is optional
        readings = [
            Reading(
                capture,
                diode,
                self.read_noise(read, conversion, gain),
                dsnu,
                column,
                **self.reading_terms(),
                **converter(conversion, gain, swing, self.bits, self.black_dn),
            )
            for capture, diode, read, dsnu, column, conversion, gain, swing in zip(
                CAPTURES, DIODES, *(getattr(self, name) for name in per_reading)
            )
        ]
        return self.assemble(diodes, readings)
