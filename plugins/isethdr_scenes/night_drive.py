"""A country road at night, seen through the windscreen of a car with its dipped beams on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .validation import check_ranges


@dataclass(frozen=True)
class NightDrive:
    """Two-lane road with an oncoming car, a car ahead, a parked truck, people, deer, trees and street lamps.

    Everything is geometry with spectral materials and lamps in candela; the lighting weights make the
    hour of the day. At weight 1 the sky is a uniform daylight sky of `sky_luminance_cd_m2`; a moonless
    night is a weight of 1e-7 to 1e-5. Ranges are (least, most); the seed draws between them.
    """

    seed: int = 0                                                  # draws all that has a range
    horizontal_field_deg: float = 45.0                             # full field of the camera
    aspect: float = 16 / 9                                         # width / height of the field
    projection: Literal["tangent", "equidistant"] = "tangent"      # of the grid of tiles; equidistant: angles, for wide lenses
    camera_height_m: float = 1.3                                   # above the road, behind the windscreen
    oncoming_m: tuple[float, float] = (23.0, 31.0)                 # distance of the oncoming car
    ahead_m: tuple[float, float] = (19.0, 26.0)                    # distance of the car ahead
    cyclist_m: tuple[float, float] = (12.5, 16.0)                  # distance of the cyclist
    deer_m: tuple[float, float] = (24.0, 34.0)                     # distance of the nearest deer
    truck_m: tuple[float, float] = (50.0, 60.0)                    # distance of the parked truck
    pedestrian_beside_deg: tuple[float, float] = (1.3, 2.0)        # pedestrian beside the oncoming headlamp, as seen
    vehicles: tuple[int, int] = (5, 6)                             # oncoming, ahead, parked, then further ones; 1 to 6
    people: tuple[int, int] = (3, 4)                               # pedestrian, rider, then further ones; 1 to 4
    animals: tuple[int, int] = (1, 2)                              # deer; 0 to 3
    trees: tuple[int, int] = (90, 120)                             # trees and bushes; 0 to 400
    street_lamps: tuple[int, int] = (4, 5)                         # every 30 m on the left; 0 to 8
    curvature_per_m: tuple[float, float] = (0.0008, 0.0018)        # of the road, to the left
    headlamp_light: Literal["led_white", "halogen"] = "led_white"  # spectrum of all vehicle headlamps
    street_light: Literal["sodium", "led_white", "metal_halide"] = "sodium"  # spectrum of the street lamps
    braking: bool = False                                          # the car ahead brakes
    sky_luminance_cd_m2: float = 4000.0                            # of the sky at weight 1

    def __call__(self):
        """Build the scene.

        Returns
        -------
        SceneDescription
            Light groups `sky`, `headlights`, `streetlights` and `other`.
        """
        from .builders import describe
        from .placement import OWN_LANE_M

        ground, spots = self.plan()
        target = ground.on(40.0, OWN_LANE_M + 0.55, self.camera_height_m - 0.15)
        light = {"headlights": self.headlamp_light, "streetlights": self.street_light}
        return describe("night_drive", self, ground, spots, target, light)

    def camera_field(self):
        """Return (width, height, projection) of the camera's field."""
        from isethdr_core.field import camera_field

        return camera_field(self.horizontal_field_deg, self.aspect, self.projection)

    def plan(self):
        """Return (ground, spots): where everything stands, without building a mesh."""
        from .placement import plan

        self._check()
        return plan(self)

    def _check(self):
        limits = {"vehicles": (1, 6), "people": (1, 4), "animals": (0, 3), "trees": (0, 400), "street_lamps": (0, 8),
                  "oncoming_m": (12, 80), "ahead_m": (8, 80), "cyclist_m": (6, 60), "deer_m": (15, 120),
                  "truck_m": (30, 150), "pedestrian_beside_deg": (0.5, 8), "curvature_per_m": (-0.003, 0.003)}
        check_ranges(self, limits)
