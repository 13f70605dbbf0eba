"""The sky with a gradient, on the device.

The patterns of the dome lie in one table with four numbers for each node, so that one memory access
gives all parts. Sun and moon are not part of the table: they are flat lamps at the distance
`sky_discs.FAR_M`. They are therefore sampled like all lamps, cast shadows with penumbrae, and are
seen with their exact footprint. At that distance, their direction varies by at most 0.02 degrees
within a scene of 400 m.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.scene import SkyDome

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Spectrum

MOST_PARTS = 4  # largest number of parts of a dome


def sky_rows(sky: Spectrum | None, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the radiances (row, wavelength) of a sky, W m-2 sr-1 nm-1: one row for a uniform sky,
    one row of zeros for no sky, and one row for each part of a dome.
    """
    if isinstance(sky, SkyDome):
        return np.stack([part.spectrum.at(wavelength_nm) for part in sky.parts])
    return (np.zeros(len(wavelength_nm)) if sky is None else sky.at(wavelength_nm))[None]


class DomeTable:
    """Device table of the patterns of a dome."""

    def __init__(self, dome: SkyDome) -> None:
        """Make the table.

        Raises
        ------
        ConfigError : the dome has more than four parts.
        """
        if len(dome.parts) > MOST_PARTS:
            raise ConfigError(
                f"the sky has {len(dome.parts)} parts; this renderer takes at most {MOST_PARTS}"
            )
        self.count = len(dome.parts)
        patterns = np.stack([part.pattern for part in dome.parts], -1)
        self.rows, self.columns = patterns.shape[:2]
        four = np.zeros((self.rows, self.columns, MOST_PARTS))
        four[..., : self.count] = patterns
        # Passed as a list, which Dr.Jit copies into aligned memory. A NumPy array would be used in
        # place; it is aligned only by chance, and an unaligned one needs another kernel.
        self.values = mi.Float(four.astype(np.float32).ravel().tolist())
        dr.eval(self.values)

    def strengths(self, direction: Any, active: Any) -> Any:
        """Return the strengths of the parts, a vector of four, towards the unit vector `direction`.
        The interpolation is that of `isethdr_core.data.sky.pattern_at`.
        """
        up = dr.asin(dr.clip(direction.z, -1, 1)) * (2 / dr.pi)
        row = (dr.copysign(dr.sqrt(dr.abs(up)), up) + 1) * ((self.rows - 1) / 2)
        turn = dr.atan2(-direction.y, direction.x) / (2 * dr.pi)
        column = (turn - dr.floor(turn)) * self.columns
        low = dr.minimum(mi.UInt32(row), self.rows - 2)
        left = dr.minimum(mi.UInt32(column), self.columns - 1)
        right = dr.select(left + 1 == self.columns, 0, left + 1)
        above = row - mi.Float(low)
        aside = column - mi.Float(left)
        at = lambda r, c: dr.gather(mi.Vector4f, self.values, r * self.columns + c, active)
        lower = dr.lerp(at(low, left), at(low, right), aside)
        upper = dr.lerp(at(low + 1, left), at(low + 1, right), aside)
        return dr.lerp(lower, upper, above)

    def light(self, spectra: Any, place: Any, row: Any, direction: Any, active: Any) -> list[Any]:
        """Return the packets of radiance of the sky seen in `direction`.

        Parameters
        ----------
        spectra : spectra of the pass.
        place : wavelength sample in each band.
        row : row of the first part in the table of spectra.
        direction : unit vector towards the sky.
        active : lanes that take part.
        """
        strength = self.strengths(direction, active)
        out = [mi.Spectrum(0) for _ in range(spectra.packets)]
        for j in range(self.count):
            for k, value in enumerate(spectra.at(place, row + j, active)):
                out[k] += strength[j] * value
        return out
