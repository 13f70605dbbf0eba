"""The inside of a road tunnel, looking at its bright exit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from isethdr_core.pipeline.field_check import camera_field
from isethdr_core.plugins.ranges import Range, Seed, check_ranges

from .builders import describe
from .geometry.surroundings.tube import mouth
from .lamps import groups_of
from .limits import Aspect, CameraHeight, RoadField, SkyLuminance, Spacing, Visibility
from .placement import OWN_LANE_M
from .placement_tunnel import plan
from .road_surfaces import DEFAULT, RoadSurfaceName
from .sky.choice import SkyName, check_sky
from .validation import check_order

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import SceneDescription

    from .geometry.surroundings.ground import Ground
    from .placement import Spot

# ranges in which the objects of the scene still fit next to each other
Exit = Annotated[float, Range(40, 400)]  # metres
Ahead = Annotated[float, Range(8, 200)]  # metres
Oncoming = Annotated[float, Range(12, 200)]  # metres
Pedestrian = Annotated[float, Range(10, 150)]  # metres
Trees = Annotated[int, Range(0, 200)]


@dataclass(frozen=True)
class Tunnel:
    """A lit tunnel with a car ahead, an oncoming car and a pedestrian, and daylight at its end.

    With `sky=uniform`, the sky outside has `sky_luminance_cd_m2` at weight 1, so it is day when all
    weights are 1. The pedestrian stands on the right walkway in front of the dim wall; the exit
    fills a few degrees of the picture.
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
    exit_m: tuple[Exit, Exit] = (75.0, 110.0)  # distance of the exit
    ahead_m: tuple[Ahead, Ahead] = (24.0, 36.0)  # distance of the car ahead
    oncoming_m: tuple[Oncoming, Oncoming] = (32.0, 50.0)  # distance of the oncoming car
    pedestrian_m: tuple[Pedestrian, Pedestrian] = (18.0, 26.0)  # distance of the pedestrian
    luminaire_spacing_m: Spacing = 12.0  # spacing of the luminaires in both rows
    trees: tuple[Trees, Trees] = (30, 50)  # number of trees beyond the exit
    tunnel_light: Literal["led_white", "sodium"] = "sodium"  # spectrum of the luminaires
    # spectrum of all vehicle headlamps
    headlamp_light: Literal["led_white", "halogen"] = "led_white"
    # beam of all vehicle headlamps (docs/explanation/lamps.md)
    headlamp_beam: Literal["dipped_r112_b", "dipped_r149_c", "driving"] = "dipped_r112_b"
    braking: bool = True  # brake lights of the car ahead are on
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
            Light groups `sky`, `headlights`, `streetlights` (the luminaires) and `other`.
        """
        ground, spots = self.plan()
        target = ground.points(40.0, OWN_LANE_M + 0.6, self.camera_height_m + 0.25)
        description = describe(
            "tunnel",
            self,
            ground,
            spots,
            target,
            {"headlights": self.headlamp_light, "streetlights": self.tunnel_light},
        )
        (exit_m,) = (spot.recipe[3] for spot in spots if spot.name == "tunnel")
        return replace(description, openings=(mouth(ground, exit_m),))

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
