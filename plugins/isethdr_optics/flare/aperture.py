"""The flares `ideal` and `aperture`, and the methods that any flare may have.

A flare is a frozen dataclass with any of these methods; a lens uses all of them.

`pupil(x_mm, y_mm, wavelength_nm)`
    complex or real amplitude transmission at points of the pupil plane (broadcast; mm from the
    axis, x right, y down as in the image). The lens multiplies its own round stop by the mean over
    3 x 3 points per pupil cell.
`pupil_shapes(radius_mm)`
    instead of `pupil`: (opening, [(shape, loss of amplitude), ...]) of
    `isethdr_core.physics.optics.pupil`, convex shapes in mm, the same at all wavelengths, for a
    lens with a stop of `radius_mm`. The lens rasterises them exactly, and much faster. An element
    for dirt may have a third entry, the optical path difference in um of the light through it.
`scatter(wavelength_nm, angle_rad)`
    light scattered per steradian at `angle_rad` (array) from the unscattered ray, as a fraction of
    all light. Its integral over the forward hemisphere is taken from the sharp image and spread:
    energy is conserved.
`irradiance(lens, mixed)`
    light added on the sensor plane (ghosts), W m-2 nm-1, (wavelength, y, x) on the tiles of
    `mixed`.
`redirected(lens, mixed)`
    radiance behind an obstacle in front of the lens (drops on a windscreen): mixed radiance on the
    tiles of `mixed`, which may have components.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.pupil import Dust, Scratches, blades, dirt, transmission
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.plugins.ranges import Seed, Share, check_ranges

from ..lenses.limits import (
    Blades,
    Delay,
    Direction,
    LogSpread,
    Micrometres,
    PerArea,
    PupilRadius,
    Together,
)
from ..psf.wings import check_delay

if TYPE_CHECKING:
    from isethdr_core.physics.optics.pupil import Convex
    from isethdr_core.pipeline.demand import Demand


@dataclass(frozen=True)
class IdealFlare:
    """No flare: the lens is unchanged."""

    THREAD_SAFE: ClassVar[bool] = True

    def scatter(self, wavelength_nm: float, angle_rad: np.ndarray) -> np.ndarray:
        """Return 0 per steradian at every angle."""
        return 0.0 * angle_rad


@dataclass(frozen=True)
class ApertureFlare:
    """Diffraction at the iris blades, and at dust and scratches on the glass near it."""

    THREAD_SAFE: ClassVar[bool] = True

    blades: Blades = 6  # number of blades of the iris; below 3 the iris is round
    rotation_deg: Direction = 17.0  # rotation of the iris about the optical axis
    rounding: Share = 0.0  # roundness of the blades: 0 straight edges, 1 a circle
    dust_per_mm2: PerArea = 40.0  # grains of dust per area of the pupil
    dust_radius_um: Micrometres = 9.0  # median radius of the grains (log-normal distribution)
    scratches_per_mm2: PerArea = 5.0  # scratches per area of the pupil
    scratch_width_um: Micrometres = 3.5  # mean width of the scratches
    scratch_length_um: Micrometres = 500.0  # mean length of the scratches
    seed: Seed = 1  # seed of the positions and sizes of grains and scratches
    # radius of the circle through the corners of the iris; 0 takes the stop of the lens (0.5 mm
    # if no lens is known)
    radius_mm: PupilRadius = 0.0
    dust_spread: LogSpread = 0.5  # standard deviation of the logarithm of the grains' radius
    # least and greatest share of the amplitude that a grain blocks
    dust_opacity: tuple[Share, Share] = (
        0.5,
        1.0,
    )
    # optical path difference, (index - 1) x thickness, of light through a grain
    dust_delay_um: Delay = 0.0
    # least and greatest share of the amplitude that a scratch blocks
    scratch_opacity: tuple[Share, Share] = (0.3, 1.0)
    # parallel scratches in a group, as a wiper leaves them; 1 places each scratch alone
    scratches_together: Together = 1
    scratch_spacing_um: Micrometres = 30.0  # mean spacing of neighbouring scratches in a group
    # start of the range of directions of the scratches, from x towards y
    scratch_direction_deg: Direction = 0.0
    # width of the range of directions; 180 allows every direction
    scratch_range_deg: Direction = 180.0

    def __post_init__(self) -> None:
        """Raise ConfigError for values out of range, or for reversed limits of an opacity."""
        check_ranges(self)
        for name in ("dust_opacity", "scratch_opacity"):
            ends = getattr(self, name)
            if ends[0] > ends[1]:
                raise ConfigError(
                    f"aperture {name} is {ends!r}; expected the lesser number first; "
                    f"type flare.NAME.{name}=[0.5,1]"
                )

    def narrow(self, demand: Demand) -> Demand:
        """Return the demand unchanged.

        Raises
        ------
        ConfigError : bands of the demand are too wide for `dust_delay_um`.
        """
        if self.dust_delay_um and self.dust_per_mm2 and len(demand.wavelength_nm or ()):
            check_delay(
                self.dust_delay_um, demand.wavelength_nm, band_widths_nm(demand.wavelength_nm)
            )
        return demand

    def pupil(self, x_mm: np.ndarray, y_mm: np.ndarray, wavelength_nm: float) -> np.ndarray:
        """Return the amplitude transmission at points of the pupil plane, complex where dust delays
        light.

        Parameters
        ----------
        x_mm, y_mm : positions in the pupil, mm, 0 on the axis; any shapes that broadcast.
        wavelength_nm : wavelength, nm.
        """
        opening, dirt = self.pupil_shapes(0.5)
        losses = [
            (
                d[0],
                1 - (1 - d[1]) * np.exp(2j * np.pi * d[2] / (1e-3 * wavelength_nm))
                if len(d) > 2
                else d[1],
            )
            for d in dirt
        ]
        return transmission(opening, losses, x_mm, y_mm)

    def pupil_shapes(self, radius_mm: float) -> tuple[Convex, list[Any]]:
        """Return the iris and its dirt as convex shapes in mm, for a lens with a stop of
        `radius_mm`.
        """
        radius = self.radius_mm or radius_mm
        dust = Dust(
            self.dust_per_mm2, self.dust_radius_um, self.dust_spread, tuple(self.dust_opacity)
        )
        scratches = Scratches(
            self.scratches_per_mm2,
            self.scratch_width_um,
            self.scratch_length_um,
            tuple(self.scratch_opacity),
            self.scratches_together,
            self.scratch_spacing_um,
            self.scratch_direction_deg,
            self.scratch_range_deg,
        )
        drawn = dirt(radius, dust, scratches, self.seed)
        if self.dust_delay_um:
            drawn = [
                (shape, loss, self.dust_delay_um) if shape.discs else (shape, loss)
                for shape, loss in drawn
            ]
        return blades(radius, self.blades, self.rotation_deg, self.rounding), drawn
