"""Film: fine ridges that a wiper leaves on a windscreen along its stroke. They spread lamps into
streaks.

The film deflects a share of the light across the stroke, and transmits the rest unchanged. The
deflection t is assumed to have the Lorentz density w / (pi (w^2 + t^2)): half of the deflected
light lies within the half width w. No light is deflected along the stroke. The film scatters only
forwards and absorbs nothing, so that all light reaches the plane of the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
import numpy.typing as npt

from isethdr_core import ledger, quantities
from isethdr_core.physics.convolution import convolve, prepare
from isethdr_core.plugins.ranges import Range, check_ranges

from ..lenses.limits import Direction, Scattered
from .in_front import check_projection, checked_values

if TYPE_CHECKING:
    import xarray as xr

    from ..abilities import FieldAngles, LensOptics
    from ..lenses.thin_lens import IdealLens

HalfWidth = Annotated[float, Range(1e-3, 30)]  # degrees
FINE = 8  # number of steps of a streak per tile; each is shared among the four tiles around it


@dataclass(frozen=True)
class FilmFlare:
    """The film that a wiper leaves on the windscreen; default values are assumptions."""

    THREAD_SAFE: ClassVar[bool] = True

    scattered: Scattered = 0.1  # share of the light that is deflected, at all wavelengths
    half_width_deg: HalfWidth = 0.5  # half of the deflected light is within this angle
    # direction of the wiper's stroke in the picture, from x (right) towards y (down); the streaks
    # are across it
    stroke_deg: Direction = 60.0

    def __post_init__(self) -> None:
        """Raise ConfigError for values out of range."""
        check_ranges(self)

    def kernel(self, pitch: tuple[float, float], reach: tuple[int, int]) -> npt.NDArray[np.float64]:
        """Return the share of a tile's deflected light on the tiles around it, (2 y + 1, 2 x + 1)
        for the reach (y, x).

        Parameters
        ----------
        pitch : (y, x) pitch of the tiles, tangents.
        reach : (y, x) tiles from the middle to the border of the kernel.
        """
        across = np.radians(self.stroke_deg + 90.0)
        way = np.sin(across), np.cos(across)
        step = min(pitch) / FINE
        count = int(np.ceil(np.hypot(*(r * p for r, p in zip(reach, pitch, strict=True))) / step))
        edges = (np.arange(-count, count + 2) - 0.5) * step
        width = np.tan(np.radians(self.half_width_deg))
        share = np.diff(np.arctan(edges / width)) / np.pi
        middle = (edges[1:] + edges[:-1]) / 2
        out = np.zeros([2 * r + 3 for r in reach])
        place = [middle * w / p + r + 1 for w, p, r in zip(way, pitch, reach, strict=True)]
        within = np.all([(a > 0) & (a < n - 1) for a, n in zip(place, out.shape, strict=True)], 0)
        rows, columns = (a[within] for a in place)
        row = rows.astype(int)
        column = columns.astype(int)
        down = rows - row
        right = columns - column
        for r, c, part in (
            (row, column, (1 - down) * (1 - right)),
            (row + 1, column, down * (1 - right)),
            (row, column + 1, (1 - down) * right),
            (row + 1, column + 1, down * right),
        ):
            np.add.at(out, (r, c), share[within] * part)
        return out[1:-1, 1:-1]

    def check_lens(self, lens: LensOptics, field: FieldAngles) -> None:
        """Raise ConfigError unless the field is in tangents."""
        check_projection(field.projection, "film")

    def redirected(self, lens: IdealLens, mixed: xr.DataArray) -> xr.DataArray:
        """Return the mixed radiance behind the film; beyond the tiles of `mixed` there is no light.

        Parameters
        ----------
        lens : not used.
        mixed : mixed radiance ([component,] wavelength, y, x).

        Raises
        ------
        ConfigError : the field is given in angles, not in tangents.
        UnitError : `mixed` is not mixed radiance.
        """
        values = checked_values(mixed)
        check_projection(mixed.attrs.get("projection", "tangent"), "film")
        if not self.scattered:
            return mixed
        shape = values.shape[-2:]
        pitch = quantities.tile_pitch(mixed, "y"), quantities.tile_pitch(mixed, "x")
        shares = self.kernel(pitch, (shape[0] - 1, shape[1] - 1))
        # the kernel's middle is at index n - 1; the middle tile of the field has the index n // 2
        from_middle = tuple(slice(n - 1 - n // 2, 2 * n - 1 - n // 2) for n in shape)
        ledger.left_out(
            "light that the film scatters from the middle of the field to beyond its border",
            "no light is known beyond the tiles",
            self.scattered * (1 - float(shares[from_middle].sum())),
            "relative",
        )
        made = prepare(shares, shape)
        bands = values.reshape(-1, *shape)
        out = np.empty_like(bands)
        for band, light in zip(out, bands, strict=True):
            spread = convolve(np.asarray(light, float), made)
            band[...] = (1 - self.scattered) * light + self.scattered * spread
        return mixed.copy(data=out.reshape(values.shape))
