"""A camera on a grid of angles for Mitsuba's own integrators, in scalar variants.

Mitsuba's compiled cameras support tangents only. Here every ray calls Python, which is slow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np

if TYPE_CHECKING:
    from .view import View

PLUGIN = "isethdr_angle_sensor"


def angle_sensor(view: View, film_entry: dict) -> dict:
    """Return the Mitsuba dictionary of the camera of an equidistant `view`, for a scalar variant.
    `film_entry` is a film as `beam_lamp.film` returns it.
    """
    mi.register_sensor(PLUGIN, lambda properties: _sensor_class()(properties))
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = (
        view.right,
        view.down,
        view.forward,
        view.origin_m,
    )
    rows, columns = view.shape
    return {
        "type": PLUGIN,
        "to_world": mi.ScalarTransform4f(matrix),
        "film": film_entry,
        "sampler": {"type": "independent"},
        "left": float(view.x[0] - view.pitch_x / 2),
        "top": float(view.y[0] - view.pitch_y / 2),
        "width": float(columns * view.pitch_x),
        "height": float(rows * view.pitch_y),
    }


def _sensor_class() -> type:
    class AngleSensor(mi.Sensor):
        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.corner = properties["left"], properties["top"]
            self.size = properties["width"], properties["height"]
            axes = np.array(properties["to_world"].matrix)
            self.axes = axes[:3, :3].T.tolist()
            self.origin = mi.Point3f(axes[:3, 3].tolist())

        def sample_ray(
            self,
            time: Any,
            wavelength_sample: Any,
            position_sample: Any,
            aperture_sample: Any,
            active: bool = True,
        ) -> Any:
            x, y = (c + s * float(p) for c, s, p in zip(self.corner, self.size, position_sample))
            theta = (x * x + y * y) ** 0.5
            across = np.sinc(theta / np.pi)  # sin(theta) / theta
            right, down, forward = self.axes
            way = mi.Vector3f(
                [
                    across * (x * r + y * d) + np.cos(theta) * f
                    for r, d, f in zip(right, down, forward)
                ]
            )
            wavelengths, weight = self.sample_wavelengths(
                mi.SurfaceInteraction3f(), wavelength_sample, active
            )
            return mi.Ray3f(self.origin, way, time, wavelengths), weight

        def sample_ray_differential(
            self,
            time: Any,
            wavelength_sample: Any,
            position_sample: Any,
            aperture_sample: Any,
            active: bool = True,
        ) -> Any:
            ray, weight = self.sample_ray(
                time, wavelength_sample, position_sample, aperture_sample, active
            )
            return mi.RayDifferential3f(ray), weight

        def bbox(self) -> Any:
            return mi.BoundingBox3f(self.origin, self.origin)

        def to_string(self) -> str:
            return "AngleSensor[]"

    return AngleSensor
