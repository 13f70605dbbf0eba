"""Bayer sensor: one photodiode and one reading per pixel under red, green or blue filters."""

from __future__ import annotations

from dataclasses import dataclass

from .converter import converter
from .sensor_model import Photodiode, Reading, SensorModel


@dataclass(frozen=True)
class BayerSensor:
    """Take one capture with an automotive Bayer sensor (AR0132AT figures)."""

    exposure_s: float = 0.016
    pitch_um: float = 3.75          # data sheet
    rows: int = 0                   # 0: fill the camera's field; else a centred crop
    columns: int = 0
    fill_factor: float = 1.0        # assumption: microlenses collect over the whole pixel
    cfa: str = "RGGB"               # repeated pattern of filters, rows parted by / where it is no square
    peak_qe: float = 0.65           # scale of the spectral curves, electrons per photon; from 5.48 V/lux-s
    infrared_cut: bool = True       # blocking filter of the camera module
    qe_csv: str = ""                # own curves: wavelength_nm and one column per filter
    full_well_e: float = 25455.0    # 2.8 V at 110 uV/e
    conversion_gain_uv_per_e: float = 110.0
    analog_gain: float = 1.0        # multiplier
    swing_v: float = 2.8            # full scale of the converter
    bits: int = 12                  # 0: converter off, raw is electrons
    black_dn: float = 64.0          # assumption
    read_noise_e: float = 9.1       # rms; 1 mV
    dark_e_per_s: float = 9.1       # at 60 C (assumption); 1 mV/s
    temperature_c: float = 60.0
    dark_spread: float = 0.2        # rms over pixels / mean (assumption)
    prnu: float = 0.005             # rms over pixels / mean (assumption)
    dsnu_e: float = 0.0             # rms over pixels of the offset
    column_e: float = 0.1           # rms over columns of the offset (assumption)
    noise: bool = True              # False: means only, no random or fixed pattern

    def __post_init__(self):
        self.model()

    def model(self) -> SensorModel:
        """Return what the sensor is made of."""
        diode = Photodiode("pixel", self.fill_factor, self.full_well_e, self.dark_e_per_s, self.dark_spread, self.prnu)
        reading = Reading("single", 0, self.read_noise_e, self.dsnu_e, self.column_e,
                          **converter(self.conversion_gain_uv_per_e, self.analog_gain, self.swing_v, self.bits, self.black_dn))
        return SensorModel(self.exposure_s, self.pitch_um, self.rows, self.columns, self.cfa, (diode,), (reading,),
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
