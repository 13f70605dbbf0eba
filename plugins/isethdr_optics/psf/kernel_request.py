"""Kernel request: the bands, the lens and the grid of kernels that are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.radiometry import band_widths_nm

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics


@dataclass(frozen=True, eq=False)
class KernelRequest:
    """The kernels of some bands of a lens with flares, on one grid of tiles; pairs are (y, x)."""

    lens: PupilOptics
    flares: Sequence[Flare]
    wavelength_nm: np.ndarray  # (band,) centres of the bands
    pitch_um: tuple[float, float]  # pitch of the tiles
    reach: tuple[int, int]  # tiles from the axis to the border; (ny - 1, nx - 1): the full frame
    width_nm: np.ndarray | None = None  # (band,) widths of the bands; None: no gaps between them

    def __post_init__(self) -> None:
        # callers may pass lists of numbers
        object.__setattr__(self, "wavelength_nm", np.asarray(self.wavelength_nm, float))
        object.__setattr__(self, "pitch_um", tuple(self.pitch_um))
        object.__setattr__(self, "reach", tuple(self.reach))

    @cached_property
    def band_width_nm(self) -> np.ndarray:
        """Width of every band, nm."""
        return band_widths_nm(self.wavelength_nm) if self.width_nm is None else self.width_nm

    @cached_property
    def edges_nm(self) -> np.ndarray:
        """(band, 2) ends of every band, nm."""
        half = self.band_width_nm / 2
        return np.stack([self.wavelength_nm - half, self.wavelength_nm + half], axis=1)

    @property
    def shortest_nm(self) -> float:
        """Shortest wavelength of all bands, nm."""
        return float(self.edges_nm.min())

    def of_bands(self, some: np.ndarray) -> KernelRequest:
        """Return the request for the bands of a mask or slice; their widths do not change."""
        return replace(
            self, wavelength_nm=self.wavelength_nm[some], width_nm=self.band_width_nm[some]
        )
