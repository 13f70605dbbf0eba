"""Allowed ranges of the fields of lenses and flares. They are wide; each comment gives the unit and
the reason.
"""

from __future__ import annotations

from math import inf
from typing import Annotated

from isethdr_core.plugins.ranges import Range

FNumber = Annotated[float, Range(0.5, 256)]  # limit of the sine condition in air, to a pinhole
FocalLength = Annotated[float, Range(0.01, 10_000)]  # millimetres: microlens to telescope
Transmittance = Annotated[float, Range(1e-6, 1)]  # 1e-6 is ND 6, the darkest neutral filter sold
FieldAngle = Annotated[float, Range(0, 120)]  # degrees off the axis: widest fisheye lenses
Falloff = dict[FieldAngle, Annotated[float, Range(0, 10)]]  # above 1: fisheye pupils grow off axis
ObjectDistance = Annotated[float, Range(1e-4, inf)]  # metres; inf: focused at infinity
FocusDistance = Annotated[float, Range(1e-4, inf)]  # metres; inf: focused at infinity
LateralColour = Annotated[float, Range(-5, 5)]  # percent: a tile's image covers at most 3 tiles
FocalShift = Annotated[float, Range(-10_000, 10_000)]  # micrometres: 1 cm blurs all detail
# a share; errors below 1e-9 are near the limit of double precision
ErrorAllowed = Annotated[float, Range(1e-9, 0.999)]
Zernike = Annotated[float, Range(-1000, 1000)]  # micrometres rms: more than a thousand waves
# OSA indices up to radial order 40, to which pupils are accurate
Zernikes = dict[Annotated[int, Range(0, 860)], Zernike]

# --- flares ---
# 64 straight blades differ from a circle by 0.2 % of the area
Blades = Annotated[int, Range(0, 64)]
Direction = Annotated[float, Range(-360, 360)]  # degrees
PerArea = Annotated[float, Range(0, 10_000)]  # per mm2: grains 10 um apart cover the glass
Micrometres = Annotated[float, Range(0, 10_000)]  # size of dirt: 1 cm exceeds usual pupils
PupilRadius = Annotated[float, Range(0, 1000)]  # millimetres: an f/0.5 lens with f = 1 m
LogSpread = Annotated[float, Range(0, 3)]  # std of log radius; 3 is a factor of 20 up or down
Delay = Annotated[float, Range(-1000, 1000)]  # micrometres of optical path: a drop of 2 mm
Together = Annotated[int, Range(1, 1000)]  # number of scratches of one wiper stroke
Scattered = Annotated[float, Range(0, 0.99)]  # a share; at 1 there would be no image
Shoulder = Annotated[float, Range(1e-4, 90)]  # degrees: less than a pixel, to a hemisphere
Slope = Annotated[float, Range(0, 20)]  # slope in a log-log plot; measured values are 1 to 4
Exponent = Annotated[float, Range(-8, 8)]  # exponent of the wavelength; Rayleigh scatter has 4
