"""Frame: bands and tiles of kernels, and the size of their exact core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.optics import half_plane_pattern as patterns

from ...pupil import pupil_energy, pupil_shapes, pupil_size
from ..kernel_request import KernelRequest

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ...abilities import PupilOptics

# width in wavelengths x f-number above which tiles count as wide: they average over many speckles,
# and samples may be coarser
WIDE_TILE = 8.0


@dataclass(frozen=True, eq=False)
class Frame:
    """Kernels that are asked for, and the reach of their exact core; pairs are (y, x) tiles."""

    request: KernelRequest
    core: tuple[int, int]  # from the axis to the border of the exact core

    @property
    def lens(self) -> PupilOptics:
        """Lens of the kernels."""
        return self.request.lens

    @property
    def flares(self) -> Sequence[Flare]:
        """Flares in the lens."""
        return self.request.flares

    @property
    def edges_nm(self) -> np.ndarray:
        """(band, 2) ends of the bands, nm."""
        return self.request.edges_nm

    @property
    def pitch_um(self) -> tuple[float, float]:
        """(y, x) pitch of the tiles, um."""
        return self.request.pitch_um

    @property
    def reach(self) -> tuple[int, int]:
        """(y, x) tiles from the axis to the border of the kernels."""
        return self.request.reach

    @property
    def shortest_nm(self) -> float:
        """Shortest wavelength of all bands, nm."""
        return self.request.shortest_nm

    @property
    def blur_um(self) -> float:
        """Shortest wavelength times the working f-number, um."""
        return pupil_size.blur_um(self.lens, self.shortest_nm)

    @property
    def scaled_nm(self) -> float:
        """Shortest wavelength, scaled as the pattern is (`pupil_size.scaled_nm`), nm."""
        return pupil_size.scaled_nm(self.lens, self.shortest_nm)

    @property
    def scaled_edges_nm(self) -> np.ndarray:
        """(band, 2) ends of the bands, scaled as the pattern is, nm."""
        return np.vectorize(lambda w: pupil_size.scaled_nm(self.lens, w))(self.edges_nm)

    @property
    def narrowest(self) -> float:
        """Least ratio of a band's width to its longest wavelength. A band moves light by at least
        this share of its distance from the axis.
        """
        return float((np.diff(self.edges_nm)[:, 0] / self.edges_nm[:, 1]).min())

    @property
    def tile_width(self) -> float:
        """Width of tiles, wavelengths x f-number."""
        return min(self.pitch_um) / self.blur_um

    @property
    def has_wide_tiles(self) -> bool:
        """Whether tiles average over enough speckles for coarser samples."""
        return self.tile_width > WIDE_TILE

    def resized(self, reach: tuple[int, int], core: tuple[int, int]) -> Frame:
        """Return the frame with another reach, and another reach of the exact core."""
        return Frame(replace(self.request, reach=reach), core)

    def pupil(self, wavelength_nm: float) -> patterns.RealPupil:
        """Return the pupil of the lens without its phase, at a wavelength in nm."""
        return patterns.RealPupil(
            pupil_shapes.terms(self.lens, self.flares),
            pupil_size.reach_mm(self.lens),
            pupil_size.distance_mm(self.lens),
            pupil_energy.open_energy_mm2(self.lens, self.flares, wavelength_nm),
        )
