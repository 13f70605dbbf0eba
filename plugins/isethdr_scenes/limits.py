"""Ranges of the fields of scenes: wide for charts; for roads, where the models can be placed."""

from __future__ import annotations

from typing import Annotated

from isethdr_core.plugins.ranges import Range

# --- charts ---
Tiles = Annotated[int, Range(1, 10_000)]  # number along one side; an 8K camera needs fewer
Field = Annotated[float, Range(0.01, 360)]  # degrees
FileField = Annotated[float, Range(0.01, 150)]  # degrees, of a picture on a plane
Luminance = Annotated[float, Range(0, 1e12)]  # cd/m2; the sun has 1.6e9
BandStep = Annotated[float, Range(0.1, 3000)]  # nm
Decades = Annotated[float, Range(1e-3, 30)]  # limited by the range of float32
Diameter = Annotated[float, Range(1e-6, 180)]  # degrees
Discs = Annotated[int, Range(1, 1000)]
Step = Annotated[float, Range(1e-6, 1e6)]  # ratio of luminances
Angle = Annotated[float, Range(-360, 360)]  # degrees
Gap = Annotated[float, Range(0, 0.99)]  # a share; a gap of 1 would leave no patch
Contrast = Annotated[float, Range(1, 1e9)]

# --- roads: ranges in which the objects of a scene still fit next to each other ---
RoadField = Annotated[float, Range(10, 200)]  # degrees; `validation` limits it by projection
Aspect = Annotated[float, Range(0.5, 4)]
# metres: from the windscreen of a sports car to that of a lorry
CameraHeight = Annotated[float, Range(0.5, 4)]
Spacing = Annotated[float, Range(4, 60)]  # metres
SkyLuminance = Annotated[float, Range(1e-6, 1e6)]  # cd/m2; a bright overcast sky has 1e4
Visibility = Annotated[float, Range(10, 100_000)]  # metres; 10 in the densest fog on roads
