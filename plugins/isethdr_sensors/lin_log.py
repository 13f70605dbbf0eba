"""Lin-log: a pixel with a response that is linear up to a knee and logarithmic beyond, in one
capture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from isethdr_core import ledger
from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.charge_dynamics import linear_limit_e

from .charge import soft_knee
from .charge.soft_knee_shot import SoftKneePixel, check_linear, take_shot
from .limits import Charge, ChargeRate
from .one_reading import OneReadingSensor
from .readout.captures import with_response
from .readout.lin_log_response import STRAIGHT_E, companding_error, response
from .sensor_model import Photodiode, SensorModel

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.physics.detector.charge_dynamics import Well
    from isethdr_core.runs.seeds import Generator

    from .sensor_model import Reading

# Largest relative bias of the electrons, of 13 levels of light with default fields
# (docs/explanation/charge_dynamics.md). Away from the knee it is below 1e-4.
BIAS = 4e-4
# Largest relative error of the stated variance at the same levels. Away from the knee it is below
# 0.01.
VARIANCE = 0.05


@dataclass(frozen=True)
class LinLogSensor(OneReadingSensor):
    """Take one capture that is linear up to a knee and logarithmic beyond (AR0132AT figures below
    the knee).

    `saturated` marks readings from the code `top_dn` on, at which 1e-4 of the knee has spilled, so
    that an isp for linear sensors stops there. The captures also have `response_dn`, `response_e`
    and `response_variance_e2`: the mean electrons and their variance for every code. They convert
    nonlinear codes to electrons.

    The fields `combine_bits`, `black_rows`, `telegraph_percent`, `defect_e_per_s` and
    `blooming_percent` must keep their defaults: the model does not include these effects.
    """

    knee_e: Charge = 20000.0  # charge at which the overflow current is `knee_e_per_s` (assumption)
    knee_e_per_s: ChargeRate = 1.25e6  # overflow current at the knee: knee_e in 16 ms (assumption)
    # additional charge that raises the overflow current by the factor e, at 60 C: 1.5 kT / e at
    # 110 uV/e, 99 mV a decade (assumption)
    thermal_e: Charge = 391.0

    def model(self) -> SensorModel:
        """Return the photodiodes and readings of the sensor."""
        soft_knee.check(self)
        reading = self.reading()
        self.check_bend(reading)
        model = self.assemble([Photodiode("pixel", **self.diode_terms())], [reading])
        longest_s = self.longest_exposure_s or self.exposure_s
        check_linear(SoftKneePixel(model, self.well(), (False,)), longest_s)
        return model

    def check_bend(self, reading: Reading) -> None:
        """Refuse a sensor without a converter if its range ends at or below the knee. Without
        codes, nothing sets the resolution of the table there.
        """
        if reading.bits:
            return

        soft = self.well()
        straight_e = linear_limit_e(STRAIGHT_E, self.exposure_s, soft)
        if beyond_e := max(straight_e + soft.thermal_e - reading.swing_e, 0.0):
            lower = self.knee_e - beyond_e
            raise ConfigError(
                f"sensor.knee_e is {self.knee_e!r}: without a converter (sensor.bits=0) the range"
                f" ends at {reading.swing_e:.6g} e (sensor.swing_v), and the response is a straight"
                f" line up to {straight_e:.6g} e; expected a range of a further"
                f" {soft.thermal_e:.3g} e (sensor.thermal_e) at least; type "
                + (
                    f"sensor.knee_e={int(lower)}, or sensor=bayer for a straight line"
                    if lower >= 1
                    else "a larger sensor.swing_v"
                )
            )

    def well(self) -> Well:
        """Return the pixel's soft knee."""
        return soft_knee.well(self.knee_e, self.thermal_e, self.knee_e_per_s, self.temperature_c)

    def full_scale_e(self) -> list[float]:
        """Return the knee, because exposures are metered for the linear part."""
        return [min(self.knee_e, *super().full_scale_e())]

    def take(self, light: xr.DataArray, generator: Generator | None) -> xr.Dataset:
        """Return captures of one shot at `exposure_s`, with the table that converts codes to
        electrons. The table assumes light that is constant over the exposure.
        """
        out = take_shot(SoftKneePixel(self.model(), self.well(), (False,)), light, generator)
        if self.noise:
            ledger.error(
                BIAS,
                "relative",
                "measured",
                "bias of linearised electrons where the response curves within the width of the"
                " noise",
            )
            ledger.error(
                VARIANCE,
                "relative",
                "measured",
                "variance stated for a reading there, mean over readings",
            )
        [reading] = self.model().readings
        if rounding := companding_error(reading, self.well()):
            ledger.error(
                rounding, "relative", "bound", "rounding to companded codes beyond the knee"
            )
        tables = response(reading, self.exposure_s, self.well(), self.noise)
        return with_response(out, tables)
