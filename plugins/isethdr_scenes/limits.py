"""Ranges of the fields of scenes: within what the models can be placed, and wide for charts."""

from __future__ import annotations

from typing import Annotated

from isethdr_core.plugins.ranges import Range

# --- charts ---
Tiles = Annotated[int, Range(1, 10_000)]  # along one side: beyond an 8K camera
Field = Annotated[float, Range(0.01, 360)]  # degrees
FileField = Annotated[float, Range(0.01, 150)]  # degrees, on a plane
Luminance = Annotated[float, Range(0, 1e12)]  # cd/m2; the sun has 1.6e9
BandStep = Annotated[float, Range(0.1, 3000)]  # nm
Decades = Annotated[float, Range(1e-3, 30)]  # float32 ends there
Diameter = Annotated[float, Range(1e-6, 180)]  # degrees
Discs = Annotated[int, Range(1, 1000)]
Step = Annotated[float, Range(1e-6, 1e6)]  # ratio of luminances
Angle = Annotated[float, Range(-360, 360)]  # degrees
Gap = Annotated[float, Range(0, 0.99)]  # a share; 1 would leave no patch
Contrast = Annotated[float, Range(1, 1e9)]

# --- roads: where the things of a scene still stand beside each other ---
RoadField = Annotated[float, Range(10, 200)]  # degrees; `validation` says more
Aspect = Annotated[float, Range(0.5, 4)]
CameraHeight = Annotated[float, Range(0.5, 4)]  # metres: a sports car's to a lorry's windscreen
Spacing = Annotated[float, Range(4, 60)]  # metres
SkyLuminance = Annotated[float, Range(1e-6, 1e6)]  # cd/m2; a bright overcast sky has 1e4
Visibility = Annotated[float, Range(10, 100_000)]  # metres; the densest fog of roads has 10
