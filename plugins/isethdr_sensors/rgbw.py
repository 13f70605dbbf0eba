"""RGBW sensor: a Bayer sensor with one green of each cell replaced by a clear filter."""

from __future__ import annotations

from dataclasses import dataclass

from .single import SingleSensor


@dataclass(frozen=True)
class RgbwSensor(SingleSensor):
    """Take one capture with red, green, blue and clear filters (AR0132AT figures)."""

    # repeated pattern of colour filters; rows separated by / where the pattern is not square
    cfa: str = "RG/WB"
