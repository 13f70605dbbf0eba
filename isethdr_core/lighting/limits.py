"""Ranges of the fields of lightings."""

from __future__ import annotations

from typing import Annotated

from ..plugins.ranges import Range

Weight = Annotated[float, Range(0, 1e38)]  # light is stored as float32, which ends there
Luminance = Annotated[float, Range(0, 1e12)]  # cd/m2; the sun has 1.6e9
Reached = Annotated[float, Range(1e-9, 1e12)]  # cd/m2; not 0, which no scale can reach
Ratio = Annotated[float, Range(1.0001, 1e20)]  # ratio of two luminances; 1 is a uniform field
