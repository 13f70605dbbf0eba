"""LOFIC: a photodiode that spills softly into a lateral overflow capacitor, read without and with
the spilled charge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

from .charge import soft_knee
from .charge.soft_knee_shot import SoftKneePixel, check_linear, take_shot, tops
from .imaging_sensor import ImagingSensor
from .limits import (
    Capacity,
    Charge,
    ChargeRate,
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

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.physics.detector.charge_dynamics import Well
    from isethdr_core.runs.seeds import Generator

CAPTURES = ("LCG", "HCG")
COLLECTS = (True, False)  # whether a capture also reads the spilled charge


@dataclass(frozen=True)
class LoficSensor(ImagingSensor):
    """Take two captures of one exposure: LCG, the photodiode with its overflow capacitor, and HCG,
    the photodiode alone at high gain.

    200 uV/e and a full well of 100 000 e are from the title of Adachi et al. 2008, the pitch is
    that of Akahane et al. 2009, both for pixels with a lateral overflow capacitor
    (docs/explanation/sensors.md). All other figures are assumptions, of the order of magnitude in
    such papers.

    The fields `combine_bits`, `black_rows`, `telegraph_percent`, `defect_e_per_s` and
    `blooming_percent` must keep their defaults: the model does not include these effects.
    """

    pitch_um: Pitch = 5.6
    # photodiode area / pixel area (assumption: microlenses collect over the whole pixel)
    fill_factor: FillFactor = 1.0
    # full well capacity of photodiode and overflow capacitor together (published)
    full_well_e: Capacity = 100000.0
    # charge of the photodiode at which the overflow current is `knee_e_per_s` (assumption)
    knee_e: Charge = 7000.0
    # overflow current at the knee: knee_e in 16 ms (assumption)
    knee_e_per_s: ChargeRate = 440000.0
    # additional charge that raises the overflow current by the factor e, at 60 C: 1.2 kT / e at
    # 143 uV/e of the photodiode (assumption)
    thermal_e: Charge = 240.0
    dark_e_per_s: DarkCurrent = 25.6  # dark current at 60 C (assumption)
    dark_spread: DarkSpread = 0.2  # dark signal nonuniformity: rms over pixels / mean (assumption)
    # photo response nonuniformity: rms over pixels / mean (assumption)
    prnu: ResponseSpread = 0.005

    # --- readings: LCG, HCG ---
    # conversion gains; LCG: 1 V at the full well
    conversion_gain_uv_per_e: tuple[ConversionGain, ConversionGain] = (10.0, 200.0)
    analog_gain: tuple[Gain, Gain] = (1.0, 1.0)  # analog gains before the converter
    swing_v: tuple[Swing, Swing] = (1.0, 1.0)  # full scale of the converter (assumption)
    # rms read noise; LCG: kTC noise of 16 fF at 60 C; HCG: assumption
    read_noise_e: tuple[Noise, Noise] = (54.0, 2.0)
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
        soft_knee.check(self)
        diode = Photodiode(
            "pixel",
            self.fill_factor,
            self.full_well_e,
            self.dark_e_per_s,
            self.dark_spread,
            self.prnu,
            **self.diode_terms(),
        )
        model = self.assemble(
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
        longest_s = self.longest_exposure_s or self.exposure_s
        check_linear(SoftKneePixel(model, self.well(), COLLECTS), longest_s)
        return model

    def well(self) -> Well:
        """Return the photodiode's soft knee."""
        return soft_knee.well(self.knee_e, self.thermal_e, self.knee_e_per_s, self.temperature_c)

    def full_scale_e(self) -> list[float]:
        """Return the electrons of both captures at which they stop measuring light. HCG stops where
        its charge begins to spill.
        """
        model = self.model()
        pixel = SoftKneePixel(model, self.well(), COLLECTS)
        return [
            (top_dn - reading.black_dn) / reading.gain_dn_per_e
            for top_dn, reading in zip(tops(pixel), model.readings, strict=True)
        ]

    def take(self, light: xr.DataArray, generator: Generator | None) -> xr.Dataset:
        """Return captures of one shot at `exposure_s`."""
        return take_shot(SoftKneePixel(self.model(), self.well(), COLLECTS), light, generator)
