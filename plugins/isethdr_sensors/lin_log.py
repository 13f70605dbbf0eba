"""Lin-log: a pixel that follows light linearly to a knee and logarithmically beyond, in one capture."""

from __future__ import annotations

from dataclasses import dataclass

from . import soft_knee
from .converter import converter
from .imaging_sensor import ImagingSensor
from .sensor_model import Photodiode, Reading, SensorModel


@dataclass(frozen=True)
class LinLogSensor(ImagingSensor):
    """Take one capture that is linear to a knee and logarithmic beyond (AR0132AT figures below the knee).

    Read as any linear sensor it ends at the knee: `top_dn` and `saturated` say so. The captures also hold `response_dn`,
    `response_e` and `response_variance_e2`, the electrons that have to arrive for every code, to read it beyond.
    """

    fill_factor: float = 1.0        # assumption: microlenses collect over the whole pixel
    knee_e: float = 20000.0         # charge at which the overflow is `knee_e_per_s` (assumption)
    knee_e_per_s: float = 1.25e6    # knee_e in 16 ms (assumption)
    thermal_e: float = 391.0        # for a factor e of the light, at 60 C: 1.5 kT / e at 110 uV/e (assumption): 99 mV a decade
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
        soft_knee.check(self)
        diode = Photodiode("pixel", self.fill_factor, dark_e_per_s=self.dark_e_per_s, dark_spread=self.dark_spread, prnu=self.prnu,
                           **self.diode_terms())
        reading = Reading("single", 0, self.read_noise_e, self.dsnu_e, self.column_e, **self.reading_terms(),
                          **converter(self.conversion_gain_uv_per_e, self.analog_gain, self.swing_v, self.bits, self.black_dn))
        return self.assemble([diode], [reading])

    def well(self):
        """Return the pixel's soft knee."""
        return soft_knee.well(self.knee_e, self.thermal_e, self.knee_e_per_s, self.temperature_c)

    def full_scale_e(self) -> list[float]:
        """Return the knee: the linear part is what an exposure is metered for."""
        return [min(self.knee_e, *super().full_scale_e())]

    def take(self, light, generator):
        """Return captures of one shot at `exposure_s`, with the table that reads it back; light is constant over the exposure."""
        from .lin_log_response import response
        from .soft_knee_shot import take_shot

        out = take_shot(self.model(), self.well(), (False,), light, generator)
        tables = response(self.model().readings[0], self.exposure_s, self.well())
        for name, values, units in zip(("response_dn", "response_e", "response_variance_e2"), tables, ("DN", "e", "e2"), strict=True):
            out[name] = ("capture", "response_entry"), values[None], {"units": units}
        return out
