"""Lanes: what each lane of compiled code knows, at the start of a segment of its path.

A lane follows one path at a time. As soon as it ends, the lane starts the next, so that no lane is
idle. Loops of Dr.Jit take these dataclasses apart, and see which of their arrays change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...lamps.airlight_sampling import CANDIDATES as AIR_CANDIDATES
from ...lamps.airlight_sampling import OF_PLACE
from ...lamps.lamp_tables import CANDIDATES
from ...world.materials import RAMP_NM
from ..camera_rays import ACROSS, ALONG, ASIDE, CHOICE, DOWN, TURN, UP, offsets, stream
from ..work_items import MOST_LANES
from .launch_tables import Items, Tables

# of 2^32: how far the candidates of one path move on along a ray in fog
OF_AIR = AIR_CANDIDATES * OF_PLACE & 0xFFFFFFFF


class Fixed:
    """What the loop does not change. No dataclass, which loops of Dr.Jit would take apart.

    Attributes
    ----------
    tables : scene on the device.
    items : work items.
    max_depth : largest number of segments of a path.
    groups, packets : numbers of light groups, and of packets of four bands.
    wanted : of each light group, whether a lane computes it.
    with_lamps : numbers of the light groups that have lamps.
    sky : number of the light group of the sky; -1: none.
    sky_row : row of its spectrum; the mean over its bands lies `lamps.sky_rows` further.
    openings : where surfaces look for the sky; None without. Fog takes its share of the light on
        the way, and sends on light of its own: it does without openings.
    block : block of the picture that a tile lies in.
    centre : direction of the centre of a tile.
    ramp : wavelengths of rays: surfaces are evaluated with reflectance 0 and 1, side by side.
    """

    def __init__(self, tables: Tables, items: Items, max_depth: int) -> None:
        """Prepare the loop.

        Parameters
        ----------
        tables : scene on the device.
        items : work items.
        max_depth : largest number of segments of a path.
        """
        lamps = tables.lamps
        self.tables = tables
        self.items = items
        self.max_depth = max_depth
        self.groups = len(lamps.groups)
        self.packets = tables.spectra.packets
        self.wanted = [(items.groups & (1 << g)) != 0 for g in range(self.groups)]
        self.with_lamps = [g for g in range(self.groups) if lamps.has_lamps(g)]
        self.sky = lamps.groups.index("sky") if "sky" in lamps.groups else -1
        self.sky_row = tables.spectra.rows - 2 * lamps.sky_rows
        self.openings = lamps.openings if self.sky >= 0 and tables.fog is None else None
        self.block = lamps.chances.block(items.row, items.column)
        self.ramp = mi.Spectrum(*RAMP_NM, *RAMP_NM)
        middle = mi.Point2u(1 << 31, 1 << 31)
        self.centre = tables.camera.ray(items.row, items.column, middle, self.ramp).d

    def row_of_sky(self, path: Path) -> Any:
        """Return the row of the sky's spectrum. All paths of one camera ray use its mean."""
        lamps = self.tables.lamps
        return dr.select(path.depth == 0, self.sky_row + lamps.sky_rows, self.sky_row)


@dataclass
class Numbers:
    """Random numbers of a lane, and its places in the sequences of its tile.

    Lanes take turns in the tile's one sequence of points, wavelengths, lamps, and directions from
    the first surface.
    """

    of_path: mi.PCG32
    of_groups: list[mi.PCG32]
    of_fog: list[mi.PCG32]  # of each light group, and of the sky; none without fog
    point: mi.Point2u
    along: mi.UInt32  # the bands
    way: mi.Point2u
    lamps: mi.Point2u
    air: mi.UInt32 | int  # 0 without fog


def numbers_of(fixed: Fixed, seed: Any) -> Numbers:
    """Return the numbers before the first path.

    Parameters
    ----------
    fixed : of the loop.
    seed : of the random numbers, on the device.
    """
    items = fixed.items
    groups = fixed.tables.lamps.groups
    numbers = items.tile * MOST_LANES + items.lane
    of_path = stream(seed, numbers, "path")
    of_groups = [stream(seed, numbers, name) for name in groups]
    of_fog = []
    air = 0
    if fixed.tables.fog is not None:
        of_fog = [stream(seed, numbers, f"fog {name}") for name in (*groups, "sky")]
        air = of_fog[-1].next_uint32() + items.lane * OF_AIR
    point, along, way, lamps = offsets(seed, items.tile)
    return Numbers(
        of_path=of_path,
        of_groups=of_groups,
        of_fog=of_fog,
        point=point + mi.Point2u(items.lane * ACROSS, items.lane * DOWN),
        along=along + items.lane * ALONG,
        way=way + mi.Point2u(items.lane * ASIDE, items.lane * UP),
        lamps=lamps + mi.Point2u(items.lane * TURN, items.lane * CHOICE),
        air=air,
    )


@dataclass
class Path:
    """The path that a lane follows."""

    ray: mi.Ray3f
    going: mi.Bool  # whether there is a ray to follow
    depth: mi.UInt32  # segments before this one
    place: mi.UInt32  # wavelength sample in each band
    beta: list[mi.Spectrum]  # packets: weight of the path up to here
    bsdf_density: mi.Float  # per solid angle, of the ray's direction
    specular: mi.Bool  # whether the ray comes from a mirror, a clear pane or the camera
    # whether all surfaces up to here were mirrors or clear panes: what the camera itself sees. None
    # without fog.
    straight: mi.Bool | None
    cell: mi.UInt32  # place from which lamps were chosen at the last surface
    candidates: mi.UInt32  # lamps that were tried there

    def restart(self, packets: int) -> None:
        """Begin at the camera, or at the surface that the camera sees."""
        self.depth = mi.UInt32(0)
        self.beta = [mi.Spectrum(1) for _ in range(packets)]


def path_before_the_first(fixed: Fixed) -> Path:
    """Return a path that goes nowhere."""
    camera = fixed.tables.camera
    return Path(
        ray=mi.Ray3f(mi.Point3f(camera.origin), mi.Vector3f(camera.forward), 0.0, fixed.ramp),
        going=mi.Bool(False),
        depth=mi.UInt32(0),
        place=mi.UInt32(0),
        beta=[mi.Spectrum(1) for _ in range(fixed.packets)],
        bsdf_density=mi.Float(1),
        specular=mi.Bool(True),
        straight=None if fixed.tables.fog is None else mi.Bool(True),
        cell=mi.UInt32(0),
        candidates=mi.UInt32(CANDIDATES),
    )


@dataclass
class Queue:
    """The paths that a lane has still to follow. Several share a camera ray, and so a first
    surface.
    """

    left: mi.UInt32  # all of them
    shares: mi.UInt32  # those that begin at the first surface of the last camera ray
    si: mi.SurfaceInteraction3f  # there
    material: mi.UInt32


def queue_of(items: Items) -> Queue:
    """Return the queue before the first path."""
    return Queue(
        left=items.paths,
        shares=mi.UInt32(0),
        si=dr.zeros(mi.SurfaceInteraction3f),
        material=mi.UInt32(0),
    )


@dataclass
class Met:
    """What the ray of a path meets."""

    si: mi.SurfaceInteraction3f
    shape: mi.UInt32
    hit: mi.Bool  # whether it is a surface
    escapes: mi.Bool  # whether it is the sky
    material: mi.UInt32
    colour: list[mi.Spectrum]  # packets: reflectance, or radiance of the sky
    active: mi.Bool  # whether the path goes on from here
