"""A street of any kind of road, with traffic, people, animals, plants and buildings."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, Literal

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.pipeline.field_check import camera_field
from isethdr_core.plugins.ranges import Range, Seed, Share, check_ranges
from isethdr_core.scene import Camera, SceneDescription

from .lamps import groups_of
from .limits import Aspect, CameraHeight, RoadField, SkyLuminance
from .materials import used
from .placing.camera import Eye, Mounting, check_eye, eye
from .placing.plan import Densities, Layout, plan
from .road_surfaces import DEFAULT, RoadSurfaceName
from .roads.kinds import BaseRoad, kind, names
from .sky.choice import SkyName, check_sky, sky_of_scene
from .street_models import ground_of, lamp_kinds, own_headlamps, things_of, visible
from .validation import check_order
from .variation import varied

Vehicles = Annotated[float, Range(0, 150)]  # per km of a lane; a queue of cars has 150
People = Annotated[float, Range(0, 1000)]  # per km of road
Riders = Annotated[float, Range(0, 200)]
Animals = Annotated[float, Range(0, 200)]
Plants = Annotated[float, Range(0, 2000)]
Heading = Annotated[float, Range(-180, 180)]  # degrees
Pitch = Annotated[float, Range(-60, 60)]  # degrees
Shift = Annotated[float, Range(-20, 20)]  # metres
TARGET_M = 40.0


@dataclass(frozen=True)
class Street:
    """A road of one of 25 kinds with its traffic, seen by a camera on a car.

    Everything is drawn from the seed and placed before a mesh is built: no two things overlap, all
    stand on the ground, and the first 6 m before the camera are free. Lamps and sky are as in
    `night_drive`. A density that cannot be placed is an error that says how many were placed.
    """

    seed: Seed = 0  # seed of the road and of all that stands on it
    # kind of road: country_curve, village, city_4_lanes, motorway, ... (`isethdr roads`)
    road: str = "city_2_lanes"
    horizontal_field_deg: RoadField = 60.0  # full horizontal field angle of the camera
    aspect: Aspect = 16 / 9  # width / height of the field
    # projection of the grid of tiles; equidistant serves wide lenses
    projection: Literal["tangent", "equidistant"] = "tangent"
    # place of the camera on its car
    camera_mount: Literal["front", "rear", "left", "right"] = "front"
    camera_height_m: CameraHeight = 1.3  # height of the camera above the road
    camera_heading_deg: Heading = 0.0  # angle of the camera to the left of its mount's direction
    camera_pitch_deg: Pitch = -1.0  # tilt of the camera upwards
    camera_ahead_m: Shift = 0.0  # shift of the camera ahead of its mount
    camera_left_m: Shift = 0.0  # shift of the camera to the left of its mount
    vehicles_per_km: Vehicles = 15.0  # moving vehicles per km of each lane
    parked_share: Share = 0.5  # share of the parking bays that hold a vehicle
    people_per_km: People = 60.0  # people on foot per km of road, both sides together
    riders_per_km: Riders = 6.0  # riders of bicycles per km of road
    animals_per_km: Animals = 2.0  # animals per km of road
    plants_per_km: Plants = 150.0  # trees, bushes and rocks per km of road
    # spectrum of all vehicle headlamps
    headlamp_light: Literal["led_white", "halogen"] = "led_white"
    # beam of all vehicle headlamps (docs/explanation/lamps.md)
    headlamp_beam: Literal["dipped_r112_b", "dipped_r149_c", "driving"] = "dipped_r112_b"
    # spectrum of street lamps and of a tunnel's luminaires
    street_light: Literal["sodium", "led_white", "metal_halide"] = "led_white"
    # asphalt: dry r1 to r4, c1, c2; damp; wet w1, w2, c2w3, c2w4 (docs/explanation/scenes.md)
    road_surface: RoadSurfaceName = DEFAULT
    # uniform: a daylight sky, whose level the lighting sets. Others are the sky of an hour, with
    # sun or moon, as built at weight 1 (docs/explanation/sky.md)
    sky: SkyName = "uniform"
    # what the hour has otherwise: sun_elevation_deg, sun_azimuth_deg, moon_elevation_deg,
    # moon_azimuth_deg, moon_phase_deg, bortle, turbidity; or latitude_deg, longitude_deg, time_utc
    # and heading_deg
    hour: dict[str, Any] = field(default_factory=dict)
    sky_luminance_cd_m2: SkyLuminance = 4000.0  # luminance of a uniform sky at weight 1

    def __post_init__(self):
        check_ranges(self)
        check_order(self)
        check_sky(self.sky, self.hour)
        if self.road not in names():
            raise ConfigError(
                f"scene.road is {self.road!r}{did_you_mean(self.road, names())}; expected one of"
                f" {', '.join(names())}; type for example scene.road=village"
            )

    def __call__(self) -> SceneDescription:
        """Build the scene.

        Returns
        -------
        SceneDescription
            Light groups `sky`, `headlights`, `other`, and `streetlights` where the road is lit.

        Raises
        ------
        ConfigError : a density that cannot be placed; a camera inside a thing or the ground.
        """
        layout = self.plan()
        place = self.eye()
        light = {"headlights": self.headlamp_light, "streetlights": self.street_light}
        seen = visible(layout, place, self.horizontal_field_deg)
        models, objects = ground_of(layout.base, light)
        for more_models, more in (
            own_headlamps(layout.base, light, self.headlamp_beam),
            things_of(seen, place, light, self.headlamp_beam),
        ):
            models |= more_models
            objects += more
        models, materials = varied(models, used(models, self.road_surface, self.seed), self.seed)
        sky = sky_of_scene(self)
        camera = self._camera(place)
        return SceneDescription("street", models, tuple(objects), materials, camera, sky)

    def light_groups(self) -> tuple[str, ...]:
        """Return the light groups, from where things stand: no mesh is built."""
        layout = self.plan()
        seen = visible(layout, self.eye(), self.horizontal_field_deg)
        return groups_of(lamp_kinds(layout.base, seen))

    def camera_field(self):
        """Return (width, height, projection) of the camera's field."""
        return camera_field(self.horizontal_field_deg, self.aspect, self.projection)

    def base(self) -> BaseRoad:
        """Return the road without what stands on it."""
        return kind(self.road, self.seed)

    def mounting(self) -> Mounting:
        """Return how the camera is mounted on its car."""
        return Mounting(
            self.camera_mount,
            self.camera_height_m,
            self.camera_ahead_m,
            self.camera_left_m,
            self.camera_heading_deg,
            self.camera_pitch_deg,
        )

    def eye(self) -> Eye:
        """Return the place of the camera and its line of sight in the world."""
        return eye(self.base(), self.mounting())

    def plan(self) -> Layout:
        """Return where everything stands, without building a mesh.

        Raises
        ------
        ConfigError : a density that cannot be placed; a camera inside a thing or the ground.
        """
        return self._layout

    @cached_property
    def _layout(self) -> Layout:
        base = self.base()
        place = self.eye()
        densities = Densities(
            self.vehicles_per_km,
            self.parked_share,
            self.people_per_km,
            self.riders_per_km,
            self.animals_per_km,
            self.plants_per_km,
        )
        layout = plan(base, self.seed, densities, place.viewpoint())
        check_eye(layout, place)
        return layout

    def _camera(self, place: Eye) -> Camera:
        target = place.position_m + TARGET_M * place.direction
        return Camera(
            tuple(place.position_m.tolist()),
            tuple(target.tolist()),
            self.horizontal_field_deg,
            self.aspect,
            self.projection,
        )
