"""A street of any kind of road, with traffic, people, animals, plants and buildings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.pipeline.field_check import camera_field
from isethdr_core.plugins.ranges import Range, Seed, Share, check_ranges
from isethdr_core.scene import Camera, NextFrame, Placed, SceneDescription, fog_of

from .lamps import groups_of
from .limits import Aspect, CameraHeight, RoadField, SkyLuminance, Visibility
from .materials import used
from .placing.camera import Eye, Mounting, check_eye, eye
from .placing.daytime import by_day
from .placing.plan import Densities, Layout, plan
from .road_surfaces import DEFAULT, RoadSurfaceName
from .roads.kinds import BaseRoad, kind, names
from .roads.opendrive.file_road import Choices, FileRoad, Start, file_road
from .scenario.start import ScenarioStart, scenario_start
from .sky.choice import SkyName, check_sky, sky_of_scene
from .street_models import (
    ground_of,
    lamp_kinds,
    later_poses,
    model_names,
    own_headlamps,
    things_of,
    visible,
)
from .things.packs.pack import pack_files, stock_of
from .things.stock import Stock
from .traffic.later_layout import Moment, moment
from .traffic.simulation import Simulation
from .traffic.sumo.choice import (
    PLACER,
    RoadOfTraffic,
    check_traffic,
    file_traffic,
    from_files,
    rest_of,
    sumo_traffic,
)
from .traffic.sumo.own_files import files_of
from .traffic.sumo.program import version
from .traffic.sumo.traffic import SumoTraffic
from .validation import check_order
from .variation import varied

Vehicles = Annotated[float, Range(0, 150)]  # per km of a lane; a queue of cars has 150
People = Annotated[float, Range(0, 1000)]  # per km of road
Riders = Annotated[float, Range(0, 200)]
Animals = Annotated[float, Range(0, 200)]
Plants = Annotated[float, Range(0, 2000)]
Tufts = Annotated[float, Range(0, 2000)]
TuftHeight = Annotated[float, Range(0.05, 1.0)]  # metres
Heading = Annotated[float, Range(-180, 180)]  # degrees
Pitch = Annotated[float, Range(-60, 60)]  # degrees
Shift = Annotated[float, Range(-20, 20)]  # metres
Along = Annotated[float, Range(0, 1e6)]  # metres along a road
LaneNumber = Annotated[int, Range(-100, 100)]
SpeedLimit = Annotated[float, Range(5, 200)]  # km/h
Time = Annotated[float, Range(0, 60)]  # seconds
TrafficSecond = Annotated[float, Range(0, 86_400)]  # seconds; a day has 86 400
FrameRate = Annotated[float, Range(0.1, 10_000)]  # 1/s
TARGET_M = 40.0  # distance of the point at which the camera looks
ROAD_FILE = ".xodr"
KIND_WITHOUT_CHOICE = "city_2_lanes"
NAN = float("nan")  # bound of an error of unknown size


@dataclass(frozen=True)
class Street:
    """A road of one of 25 kinds, or of an OpenDRIVE file, with its traffic, seen from a car.

    Everything is drawn from the seed and placed before a mesh is built: no two things overlap, all
    stand on the ground, and at time 0 a strip in front of the camera, 6 m long and 1.2 m wide, is
    free of things, except vehicles that SUMO moves. Lamps and sky are as in `night_drive`. If the
    number of vehicles, people, riders, animals or plants of a density cannot be placed, the error
    says how many were placed. Two densities have no effect on some roads, without an error:
    motorways have no riders, and towns without pavements have no animals.

    A file made by `isethdr roads write` states the place of the camera, and whether the road is lit
    and in a town. Where `road_id`, `lane_id` and `s_m` are all empty, the place of the file is
    taken; where `lit` or `urban` is null, that of the file.
    """

    THREAD_SAFE: ClassVar[bool] = True

    seed: Seed = 0  # seed of the road and of everything on it
    # kind of road: country_curve, village, city_4_lanes, motorway, ... (`isethdr roads list`), or
    # an OpenDRIVE file: path/to/town.xodr
    road: str = KIND_WITHOUT_CHOICE
    # in an OpenDRIVE file: id of the camera's road; empty takes the road of the longest lane
    # outside junctions
    road_id: str = ""
    # in an OpenDRIVE file: id of the camera's lane; null takes the longest lane of the road
    lane_id: LaneNumber | None = None
    # in an OpenDRIVE file: place of the camera along the road; needs road_id. null takes 20 m from
    # the start of the lane, or its middle if it is shorter than 40 m
    s_m: Along | None = None
    # an OpenSCENARIO file, path/to/cut_in.xosc: its road file and the start of its entities
    scenario: str = ""
    # entity that carries the camera; empty takes `Ego`, `Hero` or `EgoVehicle`, in upper or lower
    # case, else the first vehicle
    scenario_ego: str = ""
    # for an OpenDRIVE file: whether street lamps stand along the roads; null: in towns only
    lit: bool | None = None
    # for an OpenDRIVE file: whether the road is in a town; null takes the type of the camera's road
    urban: bool | None = None
    # for an OpenDRIVE file: speed limit; null takes that of the file
    speed_limit_kmh: SpeedLimit | None = None
    # full horizontal field angle of the camera; at most 100 with projection=tangent
    horizontal_field_deg: RoadField = 60.0
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
    # source of the traffic: `placer` draws it from the seed; `sumo` simulates the same density with
    # SUMO (extra `traffic`); or a file of SUMO: path/to/rush.sumocfg, path/to/cars.rou.xml
    # (docs/how-to/sumo_traffic.md)
    traffic: str = PLACER
    # with a file of SUMO: id of the vehicle that carries the camera; empty takes the car nearest to
    # the start
    traffic_ego: str = ""
    traffic_start_s: TrafficSecond = 60.0  # second of SUMO's simulation at which `time_s` is 0
    vehicles_per_km: Vehicles = 15.0  # moving vehicles per km of each lane
    parked_share: Share = 0.5  # share of the parking bays that hold a vehicle
    people_per_km: People = 60.0  # people on foot per km of road, both sides together
    riders_per_km: Riders = 6.0  # riders of bicycles per km of road
    animals_per_km: Animals = 2.0  # animals per km of road
    plants_per_km: Plants = 150.0  # trees, bushes and rocks per km of road
    # tufts of grass beside the shoulders, per km of each verge, within 60 m of the camera
    tufts_per_km: Tufts = 0.0
    tuft_height_m: tuple[TuftHeight, TuftHeight] = (0.2, 0.4)  # range of the heights of the tufts
    # spectrum of all vehicle headlamps
    headlamp_light: Literal["led_white", "halogen"] = "led_white"
    # beam of all vehicle headlamps (docs/explanation/lamps.md)
    headlamp_beam: Literal["dipped_r112_b", "dipped_r149_c", "driving"] = "dipped_r112_b"
    # lamps of moving vehicles: dipped beams, or daytime running lamps instead; with daytime,
    # motorcycles keep dipped beams and bicycles have no light
    vehicle_lamps: Literal["dipped", "daytime"] = "dipped"
    # spectrum of street lamps and of a tunnel's luminaires
    street_light: Literal["sodium", "led_white", "metal_halide"] = "led_white"
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
    # seconds for which traffic and people have moved on (docs/how-to/streets.md)
    time_s: Time = 0.0
    # frames per second of the sequence to which this picture belongs; adds the label `motion`
    frames_per_s: FrameRate | None = None

    # asset packs: folders with vehicles, people or plants of your own
    # (docs/how-to/asset_packs.md)
    assets: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_ranges(self)
        check_order(self)
        check_sky(self.sky, self.hour)
        check_traffic(self.traffic, self.scenario)
        self._check_road()

    def _check_road(self) -> None:
        """Raise ConfigError for an unknown kind of road, and for fields of a road or scenario file
        without such a file.
        """
        if self.scenario:
            self._check_scenario()
            return
        if self.scenario_ego:
            raise ConfigError(
                f"scene.scenario_ego is {self.scenario_ego!r}, but no scenario is set; expected"
                " both; type for example scene.scenario=cut_in.xosc"
            )
        if self.from_file:
            return
        if self.road not in names():
            raise ConfigError(
                f"scene.road is {self.road!r}{did_you_mean(self.road, names())}; expected a kind of"
                " road (isethdr roads list) or an OpenDRIVE file; type for example"
                " scene.road=village or scene.road=town.xodr"
            )
        for name, value in asdict(self._choices()).items():
            if value not in ("", None):
                raise ConfigError(
                    f"scene.{name} is set, but scene.road is the kind {self.road!r}; expected an"
                    " OpenDRIVE file for it; type for example scene.road=town.xodr"
                )

    def _check_scenario(self) -> None:
        """Raise ConfigError if fields place camera or road together with a scenario."""
        for name in ("road_id", "lane_id", "s_m"):
            if asdict(self._choices())[name] not in ("", None):
                raise ConfigError(
                    f"scene.{name} is set beside scene.scenario, which places the camera; expected"
                    " one of both; type for example scene.scenario_ego=Ego"
                )
        if self.road != KIND_WITHOUT_CHOICE:
            raise ConfigError(
                f"scene.road is {self.road!r} beside scene.scenario, which names its own road file;"
                " expected one of both; type for example scene.scenario=''"
            )

    def __call__(self) -> SceneDescription:
        """Build the scene.

        Returns
        -------
        SceneDescription
            Light groups `sky`, `headlights`, `other`, and `streetlights` where the road is lit.

        Raises
        ------
        ConfigError : a density that cannot be placed; a camera inside a thing or the ground; an
            asset pack with mistakes.
        """
        if self.from_file:
            self._state_notes()
        if self._sumo is not None:
            self._sumo.state_notes(self.vehicles_per_km)
        now = self.moment(self.time_s)
        place = eye(now.own_pose, self.mounting())
        light = {"headlights": self.headlamp_light, "streetlights": self.street_light}
        own_beam = "daytime" if self.vehicle_lamps == "daytime" else self.headlamp_beam
        shown = visible(now.layout, place, self.horizontal_field_deg)
        models, objects = ground_of(now.layout.base, light)
        for more_models, more in (
            own_headlamps(now.own_pose, light, own_beam, now.layout.base.right_hand),
            things_of(now.layout, shown, place, light, self.headlamp_beam, self._model_names()),
        ):
            models |= more_models
            objects += more
        models, materials = varied(models, used(models, self.road_surface, self.seed), self.seed)
        return SceneDescription(
            "street",
            models,
            tuple(objects),
            materials,
            self._camera(place),
            sky_of_scene(self),
            self._next_frame(objects),
            fog_of(self.visibility_m),
        )

    def _model_names(self) -> dict[str, str]:
        """Return the names of the models of all things, those of the first moment."""
        place = eye(self.base().pose(), self.mounting())
        return model_names(self._placed, visible(self._placed, place, self.horizontal_field_deg))

    def _next_frame(self, objects: list[Placed]) -> NextFrame | None:
        """Return camera and objects one frame later; None for a single picture."""
        if self.frames_per_s is None:
            return None
        after_s = 1 / self.frames_per_s
        then = self.moment(self.time_s + after_s)
        camera = self._camera(eye(then.own_pose, self.mounting()))
        return NextFrame(after_s, camera, later_poses(objects, then.layout, then.own_pose))

    @property
    def from_file(self) -> bool:
        """Return whether the road comes from a file."""
        return self.road.endswith(ROAD_FILE) or bool(self.scenario)

    def input_files(self) -> Iterable[Path]:
        """Return the files of road, scenario, traffic and asset packs. Their content is part of a
        run's name.
        """
        road: tuple[Path, ...] = (Path(self.road),) if self.from_file else ()
        if self.scenario:
            road = self._start.files
        if from_files(self.traffic):
            road = (*road, *files_of(Path(self.traffic)))
        return (*road, *(path for folder in self.assets for path in pack_files(folder)))

    def programs(self) -> dict[str, str]:
        """Return the version of SUMO by its name; empty if SUMO does not make the traffic."""
        return {} if self.traffic == PLACER else {"SUMO": version()}

    def check_files(self) -> None:
        """Read the road file and the asset packs.

        Raises
        ------
        CatalogError : the road file is missing, malformed, or has gaps.
        ConfigError : the file has no such road or lane; an asset pack has mistakes, all of which
            are listed.
        """
        if self.from_file:
            self._file_road()
        self.stock()

    def stock(self) -> Stock:
        """Return the families that may be drawn: the bundled ones, and those of the asset packs.

        Raises
        ------
        ConfigError : an asset pack has mistakes, all of which are listed.
        """
        return stock_of(self.assets)

    def _choices(self) -> Choices:
        return Choices(
            self.road_id, self.lane_id, self.s_m, self.lit, self.urban, self.speed_limit_kmh
        )

    @cached_property
    def _start(self) -> ScenarioStart:
        path = Path(self.scenario)
        return scenario_start(path, self.scenario_ego, self.seed, self._choices())

    def _file_road(self) -> FileRoad:
        if self.scenario:
            return self._start.road
        return file_road(Path(self.road), self.seed, self._choices())

    def light_groups(self) -> tuple[str, ...]:
        """Return the light groups, from the plan alone: no mesh is built."""
        layout = self.plan()
        shown = visible(layout, self.eye(), self.horizontal_field_deg)
        return groups_of(lamp_kinds(layout.base, shown))

    def _state_notes(self) -> None:
        """Record in the ledger which contents of the files the scene leaves out or changes."""
        found = self._file_road()
        notes = found.file.notes + (self._start.notes if self.scenario else ())
        for note in notes:
            ledger.left_out(note, "the file says otherwise", NAN, "")
        for name in found.bridges:
            ledger.left_out(
                f"road {name} runs high over another one: a bridge is built",
                "the file states none",
                NAN,
                "",
            )

    def camera_field(self) -> tuple[float, float, str]:
        """Return (width, height, projection) of the camera's field."""
        return camera_field(self.horizontal_field_deg, self.aspect, self.projection)

    def base(self) -> BaseRoad:
        """Return the road without the things on it."""
        return self._road if self._sumo is None else self._sumo.base

    @cached_property
    def _sumo(self) -> SumoTraffic | None:
        if self.traffic == PLACER:
            return None
        second_s = self.traffic_start_s
        if from_files(self.traffic):
            path = Path(self.traffic)
            return file_traffic(
                path, self.traffic_ego, second_s, self._below_traffic(), self.stock()
            )
        return sumo_traffic(self._road, self.stock(), self.seed, self._densities(), second_s)

    def _below_traffic(self) -> RoadOfTraffic:
        """Return the road on which the traffic of a file drives."""
        if not self.from_file:
            about = lambda start: (self._road, np.zeros(2))
            return RoadOfTraffic(self._road.network, self._road, np.zeros(2), about)
        found = self._file_road()

        def about(start: Start) -> tuple[BaseRoad, np.ndarray]:
            near = file_road(Path(self.road), self.seed, self._choices(), start)
            return near.base, near.shift_m

        return RoadOfTraffic(found.file.network, found.base, found.shift_m, about)

    @cached_property
    def _road(self) -> BaseRoad:
        return self._file_road().base if self.from_file else kind(self.road, self.seed)

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
        return eye(self.moment(self.time_s).own_pose, self.mounting())

    def plan(self) -> Layout:
        """Return the places of all things at `time_s`, without building a mesh.

        Raises
        ------
        ConfigError : a density that cannot be placed; a camera inside a thing or the ground; a time
            at which the camera's car has come to the end of its road.
        """
        return self.moment(self.time_s).layout

    def moment(self, time_s: float) -> Moment:
        """Return the layout and the pose of the camera's car at a time, s.

        Raises
        ------
        ConfigError : as `plan`.
        """
        if time_s == 0:
            return Moment(self._placed, self.base().pose(), False)
        if self._sumo is None:
            now = moment(self._placed, self._simulation, time_s)
        else:
            others = moment(self._sumo.without(self._placed), self._simulation, time_s).layout
            now = self._sumo.moment(self._placed, others, time_s)
        if now.own_gone:
            raise ConfigError(
                f"scene.time_s is {self.time_s:g}, but the camera's car has come to the end of its"
                f" road at {time_s:g} s; expected less, or, if that is the next frame, a larger"
                f" scene.frames_per_s; type for example scene.time_s={self.time_s / 2:g}"
            )
        return now

    @cached_property
    def _simulation(self) -> Simulation:
        if self._sumo is None:
            return Simulation(self._placed, self.vehicles_per_km)
        return Simulation(self._sumo.without(self._placed), 0.0)

    def _densities(self) -> Densities:
        return Densities(
            self.vehicles_per_km,
            self.parked_share,
            self.people_per_km,
            self.riders_per_km,
            self.animals_per_km,
            self.plants_per_km,
            self.tufts_per_km,
            self.tuft_height_m,
        )

    @cached_property
    def _placed(self) -> Layout:
        base = self.base()
        place = eye(base.pose(), self.mounting())
        densities = self._densities()
        first = self._start.put if self.scenario else None
        if self._sumo is not None:
            first = self._sumo.put
            densities = rest_of(densities)
        layout = plan(base, self.seed, densities, place.viewpoint(), self.stock(), first)
        if self.vehicle_lamps == "daytime":
            layout = by_day(layout)
        if self._sumo is not None:
            layout = self._sumo.at(layout, 0.0)
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
