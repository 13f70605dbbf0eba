"""Moving target: a bar and a lamp that move sideways at constant speed before a still ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from isethdr_core.plugins.ranges import Range

from ..limits import Diameter, Luminance
from .chart import Chart, category_of, chart_object
from .coverage import disc, half_plane

if TYPE_CHECKING:
    import xarray as xr

Time = Annotated[float, Range(0, 1000)]  # seconds
FrameRate = Annotated[float, Range(1e-3, 1e6)]  # 1/s
Speed = Annotated[float, Range(-1e4, 1e4)]  # tiles per second
Place = Annotated[float, Range(-74, 74)]  # degrees


@dataclass(frozen=True)
class MovingTarget(Chart):
    """An upright bar across the whole height and a lamp next to it, both moving to the right.

    This chart serves to measure motion blur, the skew of a rolling shutter, and ghosts of combined
    captures. Positions are exact at any time, and so is the coverage of tiles. The unit of the
    speed is tiles per second. A tile is as large as a pixel where the sensor has as many pixels as
    the chart has tiles.
    """

    luminance_cd_m2: Luminance = 100.0  # luminance of the bar
    speed_tiles_per_s: Speed = 600.0  # speed of bar and lamp to the right
    lamp_luminance_cd_m2: Luminance = 1e5  # luminance of the lamp
    lamp_diameter_deg: Diameter = 0.5  # diameter of the lamp
    bar_width_deg: Diameter = 1.7  # width of the bar
    bar_start_deg: Place = -6.0  # angle of the bar to the right of the axis at time 0
    lamp_start_deg: Place = 2.0  # angle of the lamp to the right of the axis at time 0
    background_cd_m2: Luminance = 5.0  # luminance of the ground
    time_s: Time = 0.0  # time at which the scene is seen
    # frames per second of a sequence; adds the label `motion`
    frames_per_s: FrameRate | None = None

    def light_groups(self) -> tuple[str, ...]:
        """Return the light groups: bar and ground, and the lamp."""
        return ("sky", "headlights")

    def __call__(self) -> xr.Dataset:
        """Return scene radiance. Group `headlights` holds the lamp; `sky` holds the bar and the
        ground.
        """
        x, y, pitch = self.tiles()
        way = self.speed_tiles_per_s * self.time_s * pitch
        bar_x = self.distance(self.bar_start_deg) + way
        width = 2 * self.distance(self.bar_width_deg / 2)
        bar = _bar(x, y, pitch, bar_x, width)
        radius = self.distance(self.lamp_diameter_deg / 2)
        lamp_x = self.distance(self.lamp_start_deg) + way
        lamp = disc(x, y, pitch, lamp_x, 0.0, radius)
        instance = np.zeros((self.height, self.width), np.uint32)
        instance[bar >= 0.5] = 1
        instance[(lamp > 0) & (lamp >= lamp.max() / 2)] = 2
        white = self.white()[:, None, None]
        level = self.background_cd_m2 + (self.luminance_cd_m2 - self.background_cd_m2) * bar
        labels = {}
        if self.frames_per_s is not None:
            motion = np.zeros((self.height, self.width, 2))
            step = self.speed_tiles_per_s * pitch / self.frames_per_s
            motion[..., 0] = np.where(instance > 0, step, 0.0)
            labels["motion"] = motion
        ds = self.dataset(
            {
                "sky": white * level * np.clip(1 - lamp, 0, 1),
                "headlights": white * self.lamp_luminance_cd_m2 * lamp,
            },
            instance=instance,
            category=category_of(instance),
            **labels,
        )
        left = (bar_x - width / 2) / pitch + self.width / 2
        lamp_left = (lamp_x - radius) / pitch + self.width / 2
        across = 2 * radius / pitch
        objects = (
            chart_object(1, "bar", left, 0, width / pitch, self.height),
            chart_object(2, "lamp", lamp_left, (self.height - across) / 2, across, across),
        )
        ds.attrs["objects"] = [
            _in_frame(one, self.width) for one in objects if (instance == one["instance"]).any()
        ]
        ds.attrs["lamps"] = [
            {
                "object": 2,
                "kind": "disc",
                "group": "headlights",
                "luminance_cd_m2": self.lamp_luminance_cd_m2,
            }
        ]
        return ds


def _in_frame(row: dict, columns: int) -> dict:
    """Return a row of the objects table with the part of its box that lies in the frame."""
    left, top, width, height = row["box"]
    first = max(left, 0.0)
    last = min(left + width, float(columns))
    if (first, last) == (left, left + width):
        return row
    share = (last - first) / width
    return row | {"box": [first, top, last - first, height], "visible_fraction": share}


def _bar(x: np.ndarray, y: np.ndarray, pitch: float, centre: float, width: float) -> np.ndarray:
    """Return the share (y, x) of each tile that an upright bar covers."""
    left = half_plane(x - (centre - width / 2), y, pitch, 0.0)
    return left - half_plane(x - (centre + width / 2), y, pitch, 0.0)
