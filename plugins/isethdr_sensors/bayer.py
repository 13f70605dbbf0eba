"""Bayer sensor: one photodiode and one reading per pixel under red, green or blue filters."""

from __future__ import annotations

from dataclasses import dataclass

from .single import SingleSensor


@dataclass(frozen=True)
class BayerSensor(SingleSensor):
    """Take one capture with an automotive Bayer sensor (AR0132AT figures)."""

    cfa: str = "RGGB"
