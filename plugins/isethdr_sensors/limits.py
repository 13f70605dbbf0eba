"""Ranges of the fields of sensors. They are wide, beyond any existing image sensor."""

from __future__ import annotations

from math import inf
from typing import Annotated

from isethdr_core.plugins.ranges import Range

# longest exposure; dark charge alone fills the well in a longer one
LONGEST_S = 3600.0

ImageHeight = Annotated[float, Range(0, 1000)]  # millimetres from the axis; the widest scanner
DesignAngle = Annotated[float, Range(-90, 90)]  # degrees; below 0: light inclined towards the axis
Mismatch = Annotated[float, Range(0, 180)]  # degrees between a ray and the design angle
Exposure = Annotated[float, Range(1e-9, LONGEST_S)]  # seconds; a nanosecond for fast gated sensors
LineTime = Annotated[float, Range(0, 1)]  # seconds
Pitch = Annotated[float, Range(0.05, 1e5)]  # micrometres; below a wavelength to 10 cm, light meters
Pixels = Annotated[int, Range(0, 65_536)]  # along one side
FillFactor = Annotated[float, Range(1e-4, 1)]  # smallest: a hole of 1 % of the pixel's side
QuantumEfficiency = Annotated[float, Range(1e-6, 10)]  # scale; the scaled curves stay below 1
Speed = Annotated[float, Range(0, 200)]  # m/s; the limit is faster than any road car
Flicker = Annotated[float, Range(0, 1e5)]  # Hz
LampRatio = Annotated[float, Range(1, inf)]  # inf: nothing is a lamp
GainFactor = Annotated[float, Range(1, 1000)]
Temperature = Annotated[float, Range(-100, 200)]  # degrees Celsius
Bits = Annotated[int, Range(0, 24)]  # float32 holds codes of up to 24 bits exactly
Code = Annotated[float, Range(0, 2**24)]  # DN, of 24 bits
Target = Annotated[float, Range(1e-4, 0.999)]  # share of the full scale
Crosstalk = Annotated[float, Range(0, 80)]  # percent; equal shares of 9 pixels would be 89
Power = Annotated[float, Range(-10, 10)]  # exponent of the wavelength; diffraction has 1 or 2
DarkCurrent = Annotated[float, Range(0, 1e9)]  # e/s; the limit fills any well in a millisecond
DefectCurrent = Annotated[float, Range(0, inf)]  # e/s; no pixel reaches inf
Noise = Annotated[float, Range(0, 1e6)]  # electrons rms
NoiseVoltage = Annotated[float, Range(0, 1e6)]  # microvolts rms
# A normal distribution around 1 is cut at 0. Its mean stays 1 only if few pixels are cut.
ResponseSpread = Annotated[float, Range(0, 0.5)]  # PRNU; with 0.5, 2 % of the pixels are cut
DarkSpread = Annotated[float, Range(0, 1)]  # with 1, 16 % of the pixels are cut
Charge = Annotated[float, Range(1, 1e9)]  # electrons
Capacity = Annotated[float, Range(1, inf)]  # electrons; inf: never full
ChargeRate = Annotated[float, Range(1e-3, 1e15)]  # e/s
ConversionGain = Annotated[float, Range(0.01, 1e5)]  # uV/e: 16 pF to 1.6 aF
Gain = Annotated[float, Range(0.01, 1000)]
# volts; the lower limit is one electron at 0.01 uV/e, the upper one is no limit in practice
Swing = Annotated[float, Range(1e-8, 1e20)]
LowerCase = Annotated[float, Range(0.01, 100)]  # percent
SMALLEST_RATIO = 1e-7  # shortest exposure of a shot / longest exposure
Ratio = Annotated[float, Range(SMALLEST_RATIO, 1)]
