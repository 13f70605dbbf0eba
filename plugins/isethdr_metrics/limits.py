"""Ranges of the fields of metrics."""

from __future__ import annotations

from typing import Annotated

from isethdr_core.plugins.ranges import Range

White = Annotated[float, Range(0, 1e12)]  # cd/m2; the sun has 1.6e9
Luminance = Annotated[float, Range(1e-12, 1e12)]  # cd/m2; above 0, because its logarithm is used
Percent = Annotated[float, Range(0.001, 99.999)]
Reach = Annotated[int, Range(1, 1000)]  # pixels
Guard = Annotated[int, Range(0, 10_000)]  # pixels
Darkest = Annotated[float, Range(1e-6, 1)]  # share of the pixels
Row = Annotated[int, Range(-1, 65_535)]
Ring = Annotated[float, Range(0.001, 10)]  # share of the object's size
Fewest = Annotated[int, Range(1, 1_000_000)]  # pixels
HalfWidth = Annotated[int, Range(4, 1000)]  # pixels; fewer do not contain an edge
Bins = Annotated[int, Range(1, 1000)]  # per decade
Compression = Annotated[float, Range(0, 1e9)]
