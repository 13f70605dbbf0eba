"""Lanes: the state of each lane of compiled code at the start of a segment of its path.

A lane follows one path at a time. When the path ends, the lane starts the next one, so that no lane
is idle. Loops of Dr.Jit take these dataclasses apart to find which of their arrays change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...lamps.airlight_sampling import CANDIDATES as AIR_CANDIDATES
from ...lamps.airlight_sampling import OF_PLACE
from ...world.materials import RAMP_NM
from ..camera_rays import ACROSS, ALONG, ASIDE, CHOICE, DOWN, TURN, UP, offsets, stream
from ..work_items import MOST_LANES
from .launch_tables import Items, Tables

# Step of the places of candidates along a ray in fog, from path to path, as a share of 2^32
OF_AIR = AIR_CANDIDATES * OF_PLACE & 0xFFFFFFFF


class Fixed:
    """Constants of the loop. Not a dataclass, because loops of Dr.Jit would take it apart.

    Attributes
    ----------
    tables : scene on the device.
    items : work items.
    max_depth : largest number of segments of a path.
    groups, packets : numbers of light groups, and of packets of four bands.
    wanted : for each light group, whether a lane computes it.
    with_lamps : numbers of the light groups that have lamps.
    sky : number of the light group of the sky; -1: none.
    sky_row : first row of the spectra of the sky; their means over wavelength samples lie
        `lamps.sky_rows` rows further.
    openings : openings at which shadow rays to the sky aim, or None. Not used with fog, because fog
        attenuates and scatters light between a surface and the sky.
    block : block of the picture that contains the tile.
    centre : direction of the centre of a tile.
    ramp : wavelengths of rays, at which surfaces have reflectance 0 and 1, side by side.
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
        """Return the row of the sky's spectrum. A camera ray, which all its paths share, uses the
        mean over wavelength samples.
        """
        lamps = self.tables.lamps
        return dr.select(path.depth == 0, self.sky_row + lamps.sky_rows, self.sky_row)


@dataclass
class Numbers:
    """Random numbers of a lane, and its positions in the sequences of its tile.

    A tile has one sequence each of points, wavelengths, lamps, and directions from the first
    surface. The lanes of the tile take turns in it.
    """

    of_path: mi.PCG32
    of_groups: list[mi.PCG32]  # one for each light group
    # one for each light group, one for the sky, and one for the places of lamps' airlight beyond
    # the first surface; empty without fog
    of_fog: list[mi.PCG32]
    point: mi.Point2u  # point in the tile
    along: mi.UInt32  # wavelength sample in each band
    way: mi.Point2u  # direction from the first surface
    lamps: mi.Point2u  # lamps of candidates, and choice among candidates
    air: mi.UInt32 | int  # place along a ray in fog; 0 without fog


def purpose_of(group: str) -> str:
    """Return the purpose that names the random numbers of a light group.

    A group of a user's scene may have the name of another purpose, for example `path`. Its numbers
    must not be those of the paths.
    """
    taken = group in ("path", "points", "places in fog") or group.startswith("fog ")
    return f"light group {group}" if taken else group


def numbers_of(fixed: Fixed, seed: Any) -> Numbers:
    """Return the numbers before the first path.

    Parameters
    ----------
    fixed : constants of the loop.
    seed : seed of the random numbers, on the device.
    """
    items = fixed.items
    groups = fixed.tables.lamps.groups
    numbers = items.tile * MOST_LANES + items.lane
    of_path = stream(seed, numbers, "path")
    of_groups = [stream(seed, numbers, purpose_of(name)) for name in groups]
    of_fog = []
    air = 0
    if fixed.tables.fog is not None:
        of_fog = [stream(seed, numbers, f"fog {name}") for name in (*groups, "sky")]
        air = of_fog[-1].next_uint32() + items.lane * OF_AIR
        of_fog.append(stream(seed, numbers, "places in fog"))
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
    depth: mi.UInt32  # number of segments before this one
    place: mi.UInt32  # wavelength sample in each band
    beta: list[mi.Spectrum]  # packets: weight of the path up to here
    bsdf_density: mi.Float  # density of the ray's direction per solid angle
    specular: mi.Bool  # whether the ray comes from a mirror, a clear pane or the camera
    # whether the camera sees the ray directly or through mirrors and clear panes alone; None
    # without fog
    straight: mi.Bool | None
    cell: mi.UInt32  # number of the place from which lamps were chosen at the last surface
    from_first: mi.Bool  # whether the last surface was the first one of the path

    def restart(self, packets: int) -> None:
        """Reset depth and weight for a path that begins at the camera or at its first surface."""
        self.depth = mi.UInt32(0)
        self.beta = [mi.Spectrum(1) for _ in range(packets)]


def path_before_the_first(fixed: Fixed) -> Path:
    """Return an ended path, as the state before the first path."""
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
        from_first=mi.Bool(False),
    )


@dataclass
class Queue:
    """The paths that a lane has still to follow. Several paths share a camera ray, and therefore a
    first surface.
    """

    left: mi.UInt32  # number of all remaining paths
    shares: mi.UInt32  # number of remaining paths that share the last camera ray
    si: mi.SurfaceInteraction3f  # first surface of that camera ray
    material: mi.UInt32  # material of that surface


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
    """The surface or the sky that the ray of a path hits."""

    si: mi.SurfaceInteraction3f
    shape: mi.UInt32
    hit: mi.Bool  # whether the ray hits a surface
    escapes: mi.Bool  # whether the ray leaves the scene to the sky
    material: mi.UInt32
    colour: list[mi.Spectrum]  # packets: reflectance, or radiance of the sky
    active: mi.Bool  # whether the path goes on from here
