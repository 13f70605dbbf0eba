"""Band plan: the kernel of one band, an exact core and rings from lattices around it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.errors import ConfigError

from ...pupil import pupil_energy, pupil_grid, pupil_shapes, pupil_size
from .. import interpolation_wavelengths, kernel_sampling_error, wings
from ..exact_core import exact_core, gauss_wavelengths
from .core_size import core_half

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ...abilities import PupilOptics
    from ..exact_core import Wavelengths
    from ..interpolation_wavelengths import Knots


class BandKernel(NamedTuple):
    """The kernel of one band, without scatter."""

    values: np.ndarray  # (y, x)
    wrong: np.ndarray | None  # (y, x) half the difference of two estimates; None: exact
    energy_mm2: float  # energy of the light through the pupil


class BandPlan:
    """Sampling of one band: cells and energy of the core's pupil, and the grid of the rings."""

    def __init__(
        self,
        lens: PupilOptics,
        flares: Sequence[Flare],
        band_nm: tuple[float, float],
        grid: wings.Grid,
        lattices: Sequence[Any] = (),
        shared: Knots | None = None,
    ) -> None:
        """Compute the sampling of one band.

        Parameters
        ----------
        lens : a lens of this package.
        flares : its flare components.
        band_nm : (centre, width) of the band, nm.
        grid : tiles of the kernel.
        lattices : lattices of the pattern, if one pattern serves all wavelengths.
        shared : `interpolation_wavelengths.Knots` that other bands use too.

        Raises
        ------
        ConfigError : the band reaches the wavelength 0.
        """
        centre_nm, width_nm = band_nm
        split, pitch_um, reach = grid
        self.lens = lens
        self.flares = flares
        self.pitch = tuple(pitch_um)
        self.reach = tuple(reach)
        self.distance = pupil_size.distance_mm(lens)
        self.split = split
        self.lattices = lattices
        self.knots = shared or interpolation_wavelengths.Knots()
        self.shortest = centre_nm - width_nm / 2
        self.longest = centre_nm + width_nm / 2
        if self.shortest <= 0:
            raise ConfigError(
                f"the band at {centre_nm:g} nm is {width_nm:g} nm wide: it reaches 0; expected"
                " closer wavelengths"
            )
        self.half = core_half(lens, self.shortest, pitch_um, reach)
        extent = max(2 * (h + 4) * p for h, p in zip(self.half, pitch_um))
        pitch = pupil_grid.core_pitch_mm(lens, extent, self.shortest, pupil_grid.FEWEST_SAMPLES)
        self.axis = pupil_grid.axis_mm(lens, pitch)
        self.fixed = pupil_shapes.all_shapes(flares) and not pupil_shapes.delays_um(lens, flares)
        self.energy = (
            pupil_energy.open_energy_mm2(lens, flares, self.shortest) if self.fixed else None
        )

    def band(self, centre: float, width: float) -> BandKernel:
        """Return the kernel of the band, `centre` and `width` in nm."""
        lens = self.lens
        flares = self.flares
        energy = self.energy or pupil_energy.open_energy_mm2(lens, flares, centre)
        core = exact_core(self, centre, width, self.wavelengths(centre, width), energy)
        kernel = core
        wrong = None
        if self.half != self.reach:
            kernel, wrong = wings.rings(self, centre, width, energy)
            # both estimates share the error of interpolation, so that their difference omits it
            if straight := (
                0.0 if self.lattices else interpolation_wavelengths.error(self, centre, width)
            ):
                wrong *= np.float32(
                    np.hypot(
                        1,
                        straight
                        / max(kernel_sampling_error.by_octave(wrong, kernel).max(), straight / 10),
                    )
                )
            kernel[tuple(slice(r - h, r + h + 1) for r, h in zip(self.reach, self.half))] = core
        return BandKernel(kernel, wrong, energy)

    def wavelengths(self, centre: float, width: float) -> Wavelengths:
        """Return the wavelengths of the core of the band, `centre` and `width` in nm.

        The reach is counted in whole tiles: a tile of several parts averages over speckles that
        move by less than the tile, so that fewer wavelengths are needed.
        """
        band_nm = centre - width / 2, centre + width / 2
        reach = tuple(h / self.split for h in self.half)
        return gauss_wavelengths(self.lens, self.flares, band_nm, self.pitch, reach)
