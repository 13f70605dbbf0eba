"""Words of OpenDRIVE and their counterparts here: types of lanes and roads, colours, units."""

from __future__ import annotations

from ..road import LaneType, MarkColour, MarkKind, RoadType

# counterparts of the lane types of OpenDRIVE 1.4 to 1.8 that have no type of the same name here
LANE_TYPES: dict[str, LaneType] = {
    "stop": "shoulder",
    "restricted": "none",
    "bidirectional": "driving",
    "special1": "none",
    "special2": "none",
    "special3": "none",
    "roadWorks": "none",
    "tram": "rail",
    "entry": "driving",
    "exit": "driving",
    "offRamp": "driving",
    "onRamp": "driving",
    "mwyEntry": "driving",
    "mwyExit": "driving",
    "connectingRamp": "driving",
    "slipLane": "driving",
    "walking": "sidewalk",
    "HOV": "driving",
    "bus": "driving",
    "taxi": "driving",
    "shared": "driving",
}
ROAD_TYPES: dict[str, RoadType] = {
    "rural": "rural",
    "motorway": "motorway",
    "town": "town",
    "lowSpeed": "lowSpeed",
    "pedestrian": "lowSpeed",
    "bicycle": "lowSpeed",
    "townExpressway": "town",
    "townCollector": "town",
    "townArterial": "town",
    "townPrivate": "town",
    "townLocal": "town",
    "townPlayStreet": "lowSpeed",
}
URBAN: tuple[RoadType, ...] = ("town", "lowSpeed")
# speed limits of roads for which a file states none
SPEED_LIMITS_KMH: dict[RoadType, float] = {
    "rural": 80.0,
    "motorway": 130.0,
    "town": 50.0,
    "lowSpeed": 30.0,
}
KMH: dict[str, float] = {"m/s": 3.6, "km/h": 1.0, "mph": 1.609344}
MARKS: dict[str, MarkKind] = {"botts dots": "broken", "edge": "solid", "custom": "solid"}
UNPAINTED = ("grass", "curb")  # marks that are not painted
COLOURS: dict[str, MarkColour] = {
    "standard": "white",
    "white": "white",
    "yellow": "yellow",
    "orange": "yellow",
}
WEIGHTS_M: dict[str, float] = {"standard": 0.12, "bold": 0.25}
SURFACES = ("asphalt", "concrete", "gravel")
