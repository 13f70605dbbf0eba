"""Ranges of the fields of lightings."""

from __future__ import annotations

from typing import Annotated

from ..plugins.ranges import Range

Weight = Annotated[float, Range(0, 1e38)]  # float32, which holds the light, ends there
Luminance = Annotated[float, Range(0, 1e12)]  # cd/m2; the sun has 1.6e9
Reached = Annotated[float, Range(1e-9, 1e12)]  # cd/m2 that a scale can reach: not 0
Ratio = Annotated[float, Range(1.0001, 1e20)]  # of two luminances; 1 is a uniform field
