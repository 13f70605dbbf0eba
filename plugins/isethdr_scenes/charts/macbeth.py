"""Colour checker: 24 patches with known spectral reflectance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.extras import needed

from ..limits import Gap
from .chart import Chart, band_means, category_of, chart_object, table

if TYPE_CHECKING:
    import xarray as xr

ROWS = 4
COLUMNS = 6
FRAME_REFLECTANCE = 0.03  # reflectance of the black cardboard between the patches


@dataclass(frozen=True)
class Macbeth(Chart):
    """Colour checker of 24 patches; `luminance_cd_m2` is that of a perfect white."""

    gap: Gap = 0.1  # width of the black frame between two patches / spacing of the patches

    def reflectances(self) -> tuple[list[str], np.ndarray]:
        """Return the names of the patches and the band means of their reflectance (24, wavelength).

        The order is left to right, top to bottom. The reflectances are the measured values of
        colour-science, `SDS_COLOURCHECKERS["ColorChecker N Ohta"]` (Ohta 1997).
        """
        with needed("the chart macbeth", extra="colour"):
            import colour

        patches = colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"]
        bands = self.bands_nm()
        return list(patches), np.stack([band_means(table(sd), bands) for sd in patches.values()])

    def __call__(self) -> xr.Dataset:
        """Return scene radiance with the single group `sky`, and each patch as an object."""
        names, reflectance = self.reflectances()
        # fraction of each tile column that each column of patches covers, (6, width); the same for
        # rows, (4, height)
        across = _bars(self.width, COLUMNS, self.gap)
        down = _bars(self.height, ROWS, self.gap)
        cover = np.einsum("ry,cx->rcyx", down, across).reshape(
            ROWS * COLUMNS, self.height, self.width
        )
        mean = np.einsum("pw,pyx->wyx", reflectance - FRAME_REFLECTANCE, cover) + FRAME_REFLECTANCE
        instance = np.where(cover.max(0) >= 0.5, cover.argmax(0) + 1, 0).astype(np.uint32)
        ds = self.dataset(
            {"sky": self.luminance_cd_m2 * self.white()[:, None, None] * mean},
            instance=instance,
            category=category_of(instance),
        )
        wide = self.width / COLUMNS
        high = self.height / ROWS
        ds.attrs["objects"] = [
            chart_object(
                k + 1,
                name,
                (k % COLUMNS + self.gap / 2) * wide,
                (k // COLUMNS + self.gap / 2) * high,
                (1 - self.gap) * wide,
                (1 - self.gap) * high,
            )
            for k, name in enumerate(names)
        ]
        return ds


def _bars(tiles: int, bars: int, gap: float) -> np.ndarray:
    """Return the exact share (bars, tiles) of each tile that each of `bars` equal bars covers."""
    left = (np.arange(bars) + gap / 2)[:, None] * tiles / bars
    right = (np.arange(bars) + 1 - gap / 2)[:, None] * tiles / bars
    tile = np.arange(tiles)
    return np.clip(np.minimum(right, tile + 1) - np.maximum(left, tile), 0.0, 1.0)
