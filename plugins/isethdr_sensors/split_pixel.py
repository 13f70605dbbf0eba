"""Split-pixel sensor: a large and a small photodiode in every pixel, three readings of one exposure.

LPLG and LPHG read the same charge of the large photodiode at low and high gain; SPLG reads the small one.
"""

from __future__ import annotations

from dataclasses import dataclass

from .converter import converter
from .sensor_model import Photodiode, Reading, SensorModel

CAPTURES = ("LPLG", "LPHG", "SPLG")


@dataclass(frozen=True)
class SplitPixelSensor:
    """Take three captures with a split-pixel sensor (OVT figures): LPLG, LPHG, SPLG."""

    exposure_s: float = 0.016
    pitch_um: float = 2.8
    rows: int = 0                   # 0: fill the camera's field; else a centred crop
    columns: int = 0
    cfa: str = "GRBG"               # repeated pattern of filters, rows parted by / where it is no square
    peak_qe: float = 0.65           # scale of the spectral curves, electrons per photon (assumption, as bayer)
    infrared_cut: bool = True       # blocking filter of the camera module
    qe_csv: str = ""                # own curves: wavelength_nm and one column per filter

    # --- photodiodes: large, small ---
    fill_factor: tuple[float, float] = (1.0, 0.01)          # photodiode area / pixel area
    full_well_e: tuple[float, float] = (22000.0, 7900.0)
    dark_e_per_s: tuple[float, float] = (25.6, 4.2)         # at 60 C (assumption)
    dark_spread: tuple[float, float] = (0.2, 0.2)           # rms over pixels / mean (assumption)
    prnu: tuple[float, float] = (0.005, 0.005)              # rms over pixels / mean (assumption)
    temperature_c: float = 60.0

    # --- readings: LPLG, LPHG, SPLG ---
    conversion_gain_uv_per_e: tuple[float, float, float] = (49.0, 49.0, 49.0)
    analog_gain: tuple[float, float, float] = (1.0, 200 / 49, 1.0)      # multipliers; LPHG ends at 5390 e
    swing_v: tuple[float, float, float] = (1.078, 1.078, 0.3871)        # full scale of the converter
    read_noise_e: tuple[float, float, float] = (3.05, 0.83, 0.83)       # rms
    dsnu_e: tuple[float, float, float] = (0.0, 0.0, 0.0)                # rms over pixels of the offset
    column_e: tuple[float, float, float] = (0.1, 0.1, 0.1)              # rms over columns of the offset (assumption)
    bits: int = 12                  # 0: converter off, raw is electrons
    black_dn: float = 64.0          # assumption
    noise: bool = True              # False: means only, no random or fixed pattern

    def __post_init__(self):
        self.model()

    def model(self) -> SensorModel:
        """Return what the sensor is made of."""
        diodes = tuple(Photodiode(*values) for values in zip(
            ("large", "small"), self.fill_factor, self.full_well_e, self.dark_e_per_s, self.dark_spread, self.prnu, strict=True))
        readings = tuple(
            Reading(capture, diode, read, dsnu, column, **converter(conversion, gain, swing, self.bits, self.black_dn))
            for capture, diode, read, dsnu, column, conversion, gain, swing in zip(
                CAPTURES, (0, 0, 1), self.read_noise_e, self.dsnu_e, self.column_e, self.conversion_gain_uv_per_e,
                self.analog_gain, self.swing_v, strict=True))
        return SensorModel(self.exposure_s, self.pitch_um, self.rows, self.columns, self.cfa, diodes, readings,
                           peak_qe=self.peak_qe, infrared_cut=self.infrared_cut, qe_csv=self.qe_csv,
                           temperature_c=self.temperature_c, noise=self.noise)

    def __call__(self, light, generator):
        """Return captures of one shot."""
        from .shot import take_shot

        return take_shot(self.model(), light, generator)

    def expected(self, light):
        """Return mean electrons (capture, y, x), dark charge included."""
        from .shot import expected_electrons

        return expected_electrons(self.model(), light)

    def narrow(self, demand):
        """Return the demand without outer bands in which the sensor is blind."""
        from .quantum_efficiency import narrow

        return narrow(self.model(), demand)
