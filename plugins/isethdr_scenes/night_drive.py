"""A country road at night, seen through the windscreen of a car with its dipped beams on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from isethdr_core.pipeline.field_check import camera_field
from isethdr_core.plugins.ranges import Range, Seed, check_ranges

from .builders import describe
from .lamps import groups_of
from .limits import Aspect, CameraHeight, RoadField, SkyLuminance, Visibility
from .placement import OWN_LANE_M, plan
from .road_surfaces import DEFAULT, RoadSurfaceName
from .sky.choice import SkyName, check_sky
from .validation import check_order

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import SceneDescription

    from .geometry.surroundings.ground import Ground
    from .placement import Spot

# ranges in which the objects of the scene still fit next to each other
Oncoming = Annotated[float, Range(12, 80)]  # metres
Ahead = Annotated[float, Range(8, 80)]  # metres
Cyclist = Annotated[float, Range(6, 60)]  # metres
Deer = Annotated[float, Range(15, 120)]  # metres
Truck = Annotated[float, Range(30, 150)]  # metres
Beside = Annotated[float, Range(0.5, 8)]  # degrees from the headlamp
Curvature = Annotated[float, Range(-0.003, 0.003)]  # 1 / m; the limits are a radius of 333 m
Vehicles = Annotated[int, Range(1, 6)]
People = Annotated[int, Range(1, 4)]
Animals = Annotated[int, Range(0, 3)]
Trees = Annotated[int, Range(0, 400)]
StreetLamps = Annotated[int, Range(0, 8)]


@dataclass(frozen=True)
class NightDrive:
    """Two-lane road with an oncoming car, a car ahead, a parked truck, people, deer, trees and
    street lamps.

    All objects are meshes with spectral materials and lamps in candela; the weights of the lighting
    set the time of day. With `sky=uniform`, the sky at weight 1 is a uniform daylight sky of
    `sky_luminance_cd_m2`; a moonless night is a weight of about 1e-7, the night of a city 1e-6 to
    1e-5. Ranges are (least, most); the seed selects values between them.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # seed of all random choices: values within ranges, places of plants, looks of people, paints
    # and textures
    seed: Seed = 0
    # full horizontal field angle of the camera; at most 100 with projection=tangent
    horizontal_field_deg: RoadField = 45.0
    aspect: Aspect = 16 / 9  # width / height of the field
    # projection of the grid of tiles; equidistant serves wide lenses
    projection: Literal["tangent", "equidistant"] = "tangent"
    # height of the camera above the road, behind the windscreen
    camera_height_m: CameraHeight = 1.3
    oncoming_m: tuple[Oncoming, Oncoming] = (23.0, 31.0)  # distance of the oncoming car
    ahead_m: tuple[Ahead, Ahead] = (19.0, 26.0)  # distance of the car ahead
    cyclist_m: tuple[Cyclist, Cyclist] = (12.5, 16.0)  # distance of the cyclist
    deer_m: tuple[Deer, Deer] = (24.0, 34.0)  # distance of the nearest deer
    truck_m: tuple[Truck, Truck] = (50.0, 60.0)  # distance of the parked truck
    # angle between the pedestrian and the oncoming headlamp, seen from the camera
    pedestrian_beside_deg: tuple[Beside, Beside] = (1.3, 2.0)
    # number of vehicles, 1 to 6: oncoming, ahead, parked, then further ones
    vehicles: tuple[Vehicles, Vehicles] = (5, 6)
    # number of people, 1 to 4: pedestrian, rider, then further ones
    people: tuple[People, People] = (3, 4)
    animals: tuple[Animals, Animals] = (1, 2)  # number of deer, 0 to 3
    # number of trees and bushes, 0 to 400; up to 40 low shrubs beside the road are added, at most
    # as many as the smaller number
    trees: tuple[Trees, Trees] = (90, 120)
    # number of street lamps, 0 to 8, every 30 m on the left
    street_lamps: tuple[StreetLamps, StreetLamps] = (4, 5)
    # curvature of the road; positive curves to the left
    curvature_per_m: tuple[Curvature, Curvature] = (0.0008, 0.0018)
    # spectrum of all vehicle headlamps
    headlamp_light: Literal["led_white", "halogen"] = "led_white"
    # beam of all vehicle headlamps (docs/explanation/lamps.md)
    headlamp_beam: Literal["dipped_r112_b", "dipped_r149_c", "driving"] = "dipped_r112_b"
    # spectrum of the street lamps
    street_light: Literal["sodium", "led_white", "metal_halide"] = "sodium"
    braking: bool = False  # brake lights of the car ahead are on
    # asphalt: dry r1 to r4, c1, c2; damp; wet w1, w2, c2w3, c2w4 (docs/explanation/scenes.md)
    road_surface: RoadSurfaceName = DEFAULT
    # uniform: a daylight sky; the lighting sets its level. Others: the sky at one hour with sun or
    # moon; weight 1 gives its real level (docs/explanation/sky.md)
    sky: SkyName = "uniform"
    # changes to the hour of the sky: sun_elevation_deg, sun_azimuth_deg, moon_elevation_deg,
    # moon_azimuth_deg, moon_phase_deg, bortle, turbidity; or latitude_deg, longitude_deg, time_utc
    # and heading_deg
    hour: dict[str, Any] = field(default_factory=dict)
    sky_luminance_cd_m2: SkyLuminance = 4000.0  # luminance of a uniform sky at weight 1
    # meteorological optical range of fog that fills the scene; null: clear air
    # (docs/explanation/fog.md)
    visibility_m: Visibility | None = None

    def __post_init__(self) -> None:
        check_ranges(self)
        check_order(self)
        check_sky(self.sky, self.hour)

    def __call__(self) -> SceneDescription:
        """Build the scene.

        Returns
        -------
        SceneDescription
            Light groups `sky`, `headlights`, `streetlights` and `other`.
        """
        ground, spots = self.plan()
        target = ground.on(40.0, OWN_LANE_M + 0.55, self.camera_height_m - 0.15)
        light = {"headlights": self.headlamp_light, "streetlights": self.street_light}
        return describe("night_drive", self, ground, spots, target, light)

    def light_groups(self) -> tuple[str, ...]:
        """Return the light groups, from the plan alone: no mesh is built."""
        _, spots = self.plan()
        return groups_of(kind for spot in spots for kind in spot.lamps)

    def camera_field(self) -> tuple[float, float, str]:
        """Return (width, height, projection) of the camera's field."""
        return camera_field(self.horizontal_field_deg, self.aspect, self.projection)

    def plan(self) -> tuple[Ground, list[Spot]]:
        """Return (ground, spots): the places of all objects, without building a mesh."""
        return plan(self)
