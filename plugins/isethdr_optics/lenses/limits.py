"""Ranges of the fields of lenses and flares, generous, each with its reason."""

from __future__ import annotations

from math import inf
from typing import Annotated

from isethdr_core.plugins.ranges import Range

FNumber = Annotated[float, Range(0.5, 256)]  # sine condition in air; a pinhole's f-number
FocalLength = Annotated[float, Range(0.01, 10_000)]  # millimetres: microlens to telescope
Transmittance = Annotated[float, Range(1e-6, 1)]  # 1e-6: the darkest neutral filter sold, ND 6
FieldAngle = Annotated[float, Range(0, 120)]  # degrees off the axis: widest fisheye lenses
Falloff = dict[FieldAngle, Annotated[float, Range(0, 10)]]  # pupils of fisheyes grow off the axis
ObjectDistance = Annotated[float, Range(1e-4, inf)]  # metres; inf: focused at infinity
FocusDistance = Annotated[float, Range(1e-4, inf)]  # metres; inf: focused at infinity
LateralColour = Annotated[float, Range(-5, 5)]  # percent: a tile then lands on three at most
FocalShift = Annotated[float, Range(-10_000, 10_000)]  # micrometres: 1 cm is beyond any blur kept
ErrorAllowed = Annotated[float, Range(1e-9, 0.999)]  # a share; what double precision can tell
Zernike = Annotated[float, Range(-1000, 1000)]  # micrometres rms: more than a thousand waves
# OSA index up to radial order 40: as far as pupils are exact
Zernikes = dict[Annotated[int, Range(0, 860)], Zernike]

# --- flares ---
# 64 straight blades differ from a circle by 0.2 % of the area
Blades = Annotated[int, Range(0, 64)]
Direction = Annotated[float, Range(-360, 360)]  # degrees
PerArea = Annotated[float, Range(0, 10_000)]  # per mm2: grains 10 um apart cover the glass
Micrometres = Annotated[float, Range(0, 10_000)]  # of dirt: 1 cm is larger than any pupil here
PupilRadius = Annotated[float, Range(0, 1000)]  # millimetres: an f/0.5 lens of 1 m
LogSpread = Annotated[float, Range(0, 3)]  # of radii; 3: a factor of 20 either way
Delay = Annotated[float, Range(-1000, 1000)]  # micrometres of optical path: a drop of 2 mm
Together = Annotated[int, Range(1, 1000)]  # scratches of one wiper stroke
Scattered = Annotated[float, Range(0, 0.99)]  # a share; all of it scattered leaves no image
Shoulder = Annotated[float, Range(1e-4, 90)]  # degrees: below a pixel, to a hemisphere
Slope = Annotated[float, Range(0, 20)]  # log to log; measured ones are 1 to 4
Exponent = Annotated[float, Range(-8, 8)]  # of the wavelength: Rayleigh scatter has 4
