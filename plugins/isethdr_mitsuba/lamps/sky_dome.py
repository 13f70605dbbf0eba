"""The sky with a gradient on the device, and its discs, sun and moon, as lamps far away.

The dome's patterns lie in one table, four numbers for each node: one look into memory gives all
parts. Discs are flat lamps at `FAR_M`: so they are looked for as all lamps are, throw shadows with
penumbrae, and are seen with their exact footprint. At that distance a scene of 400 m sees them
within 0.02 degrees from everywhere.
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

MOST_PARTS = 4


def sky_rows(sky: Spectrum | None, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the radiances (row, wavelength) that make up a sky: one of a uniform sky, 0 of none,
    one for each part of a dome.
    """
    if isinstance(sky, SkyDome):
        return np.stack([part.spectrum.at(wavelength_nm) for part in sky.parts])
    return (np.zeros(len(wavelength_nm)) if sky is None else sky.at(wavelength_nm))[None]


class DomeTable:
    """Device table of the patterns of a dome."""

    def __init__(self, dome: SkyDome) -> None:
        """Raise ConfigError where a dome has more than four parts."""
        if len(dome.parts) > MOST_PARTS:
            raise ConfigError(
                f"the sky has {len(dome.parts)} parts; this renderer takes at most {MOST_PARTS}"
            )
        self.count = len(dome.parts)
        patterns = np.stack([part.pattern for part in dome.parts], -1)
        self.rows, self.columns = patterns.shape[:2]
        four = np.zeros((self.rows, self.columns, MOST_PARTS))
        four[..., : self.count] = patterns
        # From a list: the renderer copies it into aligned memory. It would use a NumPy array where
        # it lies, which is aligned only by chance, and then compiles another kernel.
        self.values = mi.Float(four.astype(np.float32).ravel().tolist())
        dr.eval(self.values)

    def strengths(self, direction: Any, active: Any) -> Any:
        """Return the strength of the parts, a vector of four, towards the unit vector `direction`;
        as `isethdr_core.data.sky.pattern_at`.
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
        """Return the packets of radiance towards `direction`; `row` is that of the first part.

        Parameters
        ----------
        spectra : spectra of the pass.
        place : wavelength sample in each band.
        row : of the first part in the table of spectra.
        direction : unit vector towards the sky.
        active : lanes that take part.
        """
        strength = self.strengths(direction, active)
        out = [mi.Spectrum(0) for _ in range(spectra.packets)]
        for j in range(self.count):
            for k, value in enumerate(spectra.at(place, row + j, active)):
                out[k] += strength[j] * value
        return out
