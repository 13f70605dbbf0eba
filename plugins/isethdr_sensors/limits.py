"""Ranges of the fields of sensors: generous, beyond any image sensor made."""

from __future__ import annotations

from math import inf
from typing import Annotated

from isethdr_core.plugins.ranges import Range

LONGEST_S = 3600.0  # dark charge alone fills a longer exposure

ImageHeight = Annotated[float, Range(0, 1000)]  # millimetres from the axis: the widest scanner
DesignAngle = Annotated[float, Range(-90, 90)]  # degrees; below 0: light that leads to the axis
Mismatch = Annotated[float, Range(0, 180)]  # degrees between two such rays
Exposure = Annotated[float, Range(1e-9, LONGEST_S)]  # seconds; a nanosecond: fast gated sensors
LineTime = Annotated[float, Range(0, 1)]  # seconds
Pitch = Annotated[float, Range(0.05, 1e5)]  # micrometres: below a wavelength; 10 cm: light meters
Pixels = Annotated[int, Range(0, 65_536)]  # along one side
FillFactor = Annotated[float, Range(1e-4, 1)]  # a pinhole of 1 % of the pixel's side
QuantumEfficiency = Annotated[float, Range(1e-6, 10)]  # a scale; the scaled curves stay below 1
Speed = Annotated[float, Range(0, 200)]  # m/s: faster than any road car
Flicker = Annotated[float, Range(0, 1e5)]  # Hz
LampRatio = Annotated[float, Range(1, inf)]  # inf: nothing is a lamp
GainFactor = Annotated[float, Range(1, 1000)]
Temperature = Annotated[float, Range(-100, 200)]  # degrees Celsius
Bits = Annotated[int, Range(0, 24)]  # codes that float32 holds exactly
Code = Annotated[float, Range(0, 2**24)]  # DN, of 24 bits
Target = Annotated[float, Range(1e-4, 0.999)]  # share of the full scale
Crosstalk = Annotated[float, Range(0, 80)]  # percent: all of 8 neighbours alike is 89
Power = Annotated[float, Range(-10, 10)]  # of the wavelength; diffraction has 1 or 2
DarkCurrent = Annotated[float, Range(0, 1e9)]  # e/s; fills any well within a millisecond
DefectCurrent = Annotated[float, Range(0, inf)]  # e/s; inf: no pixel has that
Noise = Annotated[float, Range(0, 1e6)]  # electrons rms
NoiseVoltage = Annotated[float, Range(0, 1e6)]  # microvolts rms
# A normal spread around 1 is cut at 0. Its mean stays 1 only while few pixels are cut.
ResponseSpread = Annotated[float, Range(0, 0.5)]  # PRNU; 2 % of the pixels are cut at 0.5
DarkSpread = Annotated[float, Range(0, 1)]  # 16 % of the pixels are cut at 1
Charge = Annotated[float, Range(1, 1e9)]  # electrons
Capacity = Annotated[float, Range(1, inf)]  # electrons; inf: never full
ChargeRate = Annotated[float, Range(1e-3, 1e15)]  # e/s
ConversionGain = Annotated[float, Range(0.01, 1e5)]  # uV/e: 16 pF to 1.6 aF
Gain = Annotated[float, Range(0.01, 1000)]
Swing = Annotated[float, Range(1e-8, 1e20)]  # V; one electron at 0.01 uV/e, to no end at all
LowerCase = Annotated[float, Range(0.01, 100)]  # percent
Ratio = Annotated[float, Range(1e-7, 1)]
