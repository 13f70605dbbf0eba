"""Point lights: five discs in a row that step down in luminance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError

from ..limits import Diameter, Discs, Luminance, Step
from .chart import Chart, category_of, chart_object
from .coverage import disc

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class PointLights(Chart):
    """Discs in a row on a dark background, each `step` times dimmer than the last: for flare and
    dynamic range.
    """

    luminance_cd_m2: Luminance = 1e6  # luminance of the first disc, on the left
    background_cd_m2: Luminance = 0.1  # luminance of the background
    disc_diameter_deg: Diameter = 0.5  # diameter of a disc
    discs: Discs = 5  # number of discs
    step: Step = 10.0  # luminance of a disc / luminance of the next disc

    def __post_init__(self) -> None:
        super().__post_init__()
        if (
            self.discs * self._radius() * 2 > self._row_width()
            or 2 * self._radius() > self.tiles()[2] * self.height
        ):
            raise ConfigError(
                f"{self.discs} discs of {self.disc_diameter_deg:g} degrees do not fit side by side"
                " into the field; type scene.disc_diameter_deg=0.5"
            )

    def light_groups(self) -> tuple[str, ...]:
        """Return the light groups: the background and the lights."""
        return ("sky", "headlights")

    def levels_cd_m2(self) -> list[float]:
        """Return the luminance of each disc, left to right."""
        return [self.luminance_cd_m2 * self.step**-k for k in range(self.discs)]

    def __call__(self) -> xr.Dataset:
        """Return scene radiance. Group `headlights` holds the discs; `sky` holds the ground around
        them.
        """
        x, y, pitch = self.tiles()
        radius = self._radius()
        positions = (np.arange(self.discs) - (self.discs - 1) / 2) * (
            self._row_width() / self.discs
        )
        lit = np.zeros((self.height, self.width))
        covered = np.zeros((self.height, self.width))
        instance = np.zeros((self.height, self.width), np.uint32)
        objects = []
        lamps = []
        for number, (centre, level) in enumerate(zip(positions, self.levels_cd_m2()), start=1):
            area = disc(x, y, pitch, centre, 0.0, radius)
            lit += level * area
            covered += area
            # relative to the most covered tile, so that a disc smaller than a tile has a label too
            instance[(area > 0) & (area >= area.max() / 2)] = number
            left = (centre - radius) / pitch + self.width / 2
            top = self.height / 2 - radius / pitch
            objects.append(
                chart_object(
                    number, f"disc {number}", left, top, 2 * radius / pitch, 2 * radius / pitch
                )
            )
            lamps.append(
                {"object": number, "kind": "disc", "group": "headlights", "luminance_cd_m2": level}
            )
        white = self.white()[:, None, None]
        ds = self.dataset(
            {
                "sky": white * self.background_cd_m2 * np.clip(1 - covered, 0, 1),
                "headlights": white * lit,
            },
            instance=instance,
            category=category_of(instance),
        )
        ds.attrs.update(objects=objects, lamps=lamps)
        return ds

    def _radius(self) -> float:
        """Return the radius of a disc, in the projection's unit."""
        return self.distance(self.disc_diameter_deg / 2)

    def _row_width(self) -> float:
        """Return the width of the field, in the projection's unit."""
        return self.tiles()[2] * self.width
