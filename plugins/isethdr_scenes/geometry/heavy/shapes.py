"""Parameters of trucks and buses, all lengths in metres, and their sizes without a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Load = Literal["box", "curtain", "tank", "tipper", "flatbed"]
LampShape = Literal["round", "square", "strip"]
PLATE_M = 0.035  # length by which the front plate extends ahead of the cab
REAR_M = 0.035  # length by which doors, lamps and plate extend behind the load
MIRROR_M = 0.31  # width by which a mirror extends beyond either side
FLOOR_M = 1.02  # height of the floor of a truck's load


@dataclass(frozen=True)
class Truck:
    """A truck, with a trailer where `trailer` is not `none`."""

    cab_length: float
    width: float
    belt: float  # height of the lower edge of the side windows
    screen_top: float  # height of the upper edge of the windscreen
    cab_top: float
    load: Load
    load_length: float  # length of the truck's own load; a tractor has none
    load_height: float  # height of the load above its floor
    trailer: Literal["none", "semi", "drawbar"] = "none"
    trailer_length: float = 0.0
    floor: float = FLOOR_M
    tyre: float = 0.50
    rear_axles: int = 1
    grille_bars: int = 5
    grille_width: float = 0.72  # half the width of the grille
    lamp_shape: LampShape = "round"
    paint: str = "blue"
    load_paint: str = "box_white"
    gap: float = 0.22  # distance between cab and load

    @property
    def length(self) -> float:
        """Return the length from the front of the cab to the rear end of the last load."""
        if self.trailer == "semi":
            return self.cab_length + self.gap + 0.35 + self.trailer_length
        rigid = self.cab_length + self.gap + self.load_length
        return rigid + (1.3 + self.trailer_length if self.trailer == "drawbar" else 0.0)

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Length, width and height of the mesh."""
        height = max(self.cab_top, self.floor + self.load_height)
        return (self.length + PLATE_M + REAR_M, self.width + 2 * MIRROR_M, height)


@dataclass(frozen=True)
class Bus:
    """A bus. An articulated bus has a joint; a double decker has a second row of windows."""

    length: float
    width: float
    height: float
    belt: float  # height of the lower edge of the side windows
    window_top: float
    rake: float  # distance along the bus from the foot to the top of the windscreen
    panes: float  # approximate length of a side window
    doors: tuple[float, ...]  # distance of the start of each door from the front end
    front_axle: float  # distance from the front end
    rear_axle: float  # distance from the rear end
    joint: float = 0.0  # distance of the joint from the front end; 0: no joint
    decks: int = 1
    sign: bool = True  # whether it has a lit sign over the windscreen
    coach: bool = False  # a coach: higher windscreen, wider dark frames between the side windows
    roof_unit: bool = True
    tyre: float = 0.48
    lamp_shape: LampShape = "round"
    paint: str = "yellow"
    lower: str = "red"

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Length, width and height of the mesh."""
        unit = ROOF_UNIT_M if self.roof_unit else 0.0
        return (self.length + 2 * BUS_PLATE_M, self.width + 2 * BUS_MIRROR_M, self.height + unit)


ROOF_UNIT_M = 0.22
BUS_PLATE_M = 0.038
BUS_MIRROR_M = 0.17
