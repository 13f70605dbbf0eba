"""Path integrator: one path computes all bands and all light groups.

A path carries packets of four wavelengths, one wavelength per band (`spectra.py`). Its result is an
unbiased estimate of the mean over each band. All bands and groups share the directions of a path.
The shadow rays of each group have their own random numbers. The light of a group is therefore the
same, bit for bit, whether other groups are rendered or not. Directly visible lamps are left to
`visible_lamps.py`.

Compiled code works on eight or sixteen tiles at a time. Paths differ in length: as soon as one
ends, its lane starts the next, so that no lane is idle. Several paths may share a camera ray: they
continue from the same first surface with their own wavelengths and directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.data.fog import Fog
from isethdr_core.physics.photometry import xyz_weights

from ..lamps.airlight_sampling import CANDIDATES as AIR_CANDIDATES
from ..lamps.airlight_sampling import OF_PLACE, AirlightLamps, Segment
from ..lamps.lamp_tables import CANDIDATES, FIRST_CANDIDATES, LampTables
from ..lamps.sky_openings import SkyOpenings
from ..world.geometry import World
from ..world.materials import RAMP_NM
from ..world.view import View
from .airlight import from_lamps, from_sky
from .camera_rays import (
    ACROSS,
    ALONG,
    ASIDE,
    CHOICE,
    DEEPER,
    DOWN,
    TURN,
    UP,
    Camera,
    offsets,
    share,
    stream,
)
from .device_memory import aligned
from .fog_tables import FogTables
from .hits import HitTables
from .spectra import BandTable
from .surface_tables import SurfaceTables
from .work_items import MOST_LANES, Work, divide_launches, even_work


class Found(NamedTuple):
    """Results of a launch: sums over paths, W m-2 sr-1 nm-1."""

    radiance: np.ndarray  # (group, band, entry) float32; the last band fills up packets of four
    batches: np.ndarray  # (group, 3, item) float32: weighted sums over bands


@dataclass(eq=False)
class Launch:
    """A recorded launch of compiled code, which runs beside Python once it is started.

    Dr.Jit waits for all launches together. The launch before must therefore have ended, by `wait`,
    when the next one is started.

    Attributes
    ----------
    radiance : [group][band] arrays (entry,) on the device.
    batches : [group][channel] arrays (item,) on the device.
    """

    radiance: list[list[Any]]
    batches: list[list[Any]]

    def start(self) -> None:
        """Start the launch, and return at once."""
        dr.eval(self.radiance, self.batches)

    def wait(self) -> None:
        """Wait until the launch has ended. The processor's memory is not copied here, so that the
        next launch can start.
        """
        dr.sync_thread()
        self.radiance, self.batches = (
            [[each.numpy() for each in group] for group in arrays]
            for arrays in (self.radiance, self.batches)
        )

    def found(self) -> Found:
        """Return the results, after `wait`."""
        return Found(np.array(self.radiance), np.array(self.batches))


@dataclass(frozen=True, eq=False)
class Paths:
    """Integrator over one world. Any list of tiles is one launch of the same kernel.

    Attributes
    ----------
    world : scene whose surfaces are ramp surfaces (`materials.ramp_surfaces`).
    view : tiles of the frame.
    lamps : light groups and lamps.
    surfaces : materials of the world.
    wavelength_nm, step_nm : band centres and their common width, nm.
    max_depth : largest number of segments of a path; 2 is direct light only.
    fog : None in clear air. The sky is uniform where there is fog.
    """

    world: World
    view: View
    lamps: LampTables
    surfaces: SurfaceTables
    wavelength_nm: np.ndarray
    step_nm: float
    max_depth: int
    fog: Fog | None = None

    def __post_init__(self) -> None:
        divide_launches()
        self.lamps.fog = self._fog
        self.lamps.aim(self.world.scene, self._hits, self._camera, self.view, self.surfaces)

    @cached_property
    def _fog(self) -> FogTables | None:
        if self.fog is None:
            return None
        return FogTables(self.fog, self.wavelength_nm, float(self.view.origin_m[2]))

    @cached_property
    def _air(self) -> AirlightLamps | None:
        if self._fog is None:
            return None
        air = AirlightLamps(self.lamps, self._fog)
        air.aim(self.world.scene, self._hits, self._camera, self.view)
        return air

    @cached_property
    def _hits(self) -> HitTables:
        return HitTables(self.world)

    @cached_property
    def _camera(self) -> Camera:
        return Camera(self.view)

    @cached_property
    def _table(self) -> BandTable:
        rows = np.vstack([self.surfaces.reflectance, self.lamps.emission])
        return BandTable(rows, self.wavelength_nm, self.step_nm, means=self.lamps.sky_rows)

    @cached_property
    def _weights(self) -> list[list[Any]]:
        """Return the weights of X, Y and Z on the device, in packets."""
        weights = np.zeros((3, 4 * self._table.packets))
        weights[:, : len(self.wavelength_nm)] = xyz_weights(self.wavelength_nm)
        number = lambda v: dr.opaque(mi.Float, float(v))
        return [[mi.Spectrum(*map(number, part)) for part in row.reshape(-1, 4)] for row in weights]

    def all_groups(self) -> int:
        """Return a bit mask with the bits of all light groups set."""
        return (1 << len(self.lamps.groups)) - 1

    def even_pass(
        self, seed: int, samples: int, group_numbers: Sequence[int] | None = None
    ) -> np.ndarray:
        """Return radiance (group, band, tile), summed over `samples` paths of each tile.

        Parameters
        ----------
        seed : of the random numbers.
        samples : at most 1024, because the sum is float32.
        group_numbers : light groups to compute, others are 0; None: all.
        """
        groups = (
            self.all_groups() if group_numbers is None else sum(1 << int(g) for g in group_numbers)
        )
        tiles = self.view.shape[0] * self.view.shape[1]
        return self.launch(seed, even_work(tiles, samples, groups)).radiance

    def launch(self, seed: int, work: Work) -> Found:
        """Follow the paths of `work`. The random numbers of a tile depend on seed and stream only,
        not on the other tiles in the list.
        """
        launch = self.record(seed, work)
        launch.start()
        launch.wait()
        return launch.found()

    def record(self, seed: int, work: Work) -> Launch:
        """Return the launch that follows the paths of `work`, which is not started yet. Python
        takes a quarter of a second for it, in which the launch before can run.
        """
        # data instead of literals: one kernel serves all lists, all sets of light groups, and all
        # scenes with the same kinds of surfaces
        number = lambda v: dr.opaque(mi.UInt32, int(v))
        table = self._table
        spectra = _Spectra(
            table.on_device(np.random.default_rng(seed).random()),
            number(len(table.rows) + table.means),
            number(len(self.surfaces.reflectance)),
            number(table.places),
            table.packets,
        )
        column = work.tiles % self.view.shape[1]
        row = work.tiles // self.view.shape[1]
        row = row + self.view.cut[0]
        column = column + self.view.cut[1]
        # number of a tile in the complete grid; its random numbers depend on it
        rows, columns = self.view.whole
        stream_numbers = (work.streams * rows + row) * columns + column
        device_vector = lambda values: mi.UInt32(aligned(values, np.uint32))
        at_items = lambda values: device_vector(values[work.owner])
        items = _Items(
            at_items(row),
            at_items(column),
            at_items(stream_numbers),
            *map(
                device_vector,
                (work.owner, work.lane, work.lanes, work.paths, work.shares, work.groups),
            ),
        )
        tables = _Tables(
            self.world.scene, self._hits, self._camera, self.lamps, self.surfaces, spectra
        )
        tables.fog = self._fog
        tables.air = self._air
        key = number(seed & 0xFFFFFFFF)
        return Launch(*_trace(tables, key, items, len(work.tiles), self._weights, self.max_depth))


class _Tables:
    """A scene on the device. No tuple and no dataclass, which loops of Dr.Jit would take apart."""

    def __init__(
        self,
        scene: Any,
        hits: HitTables,
        camera: Camera,
        lamps: LampTables,
        surfaces: SurfaceTables,
        spectra: _Spectra,
    ) -> None:
        self.scene: mi.Scene = scene
        self.hits: HitTables = hits
        self.camera: Camera = camera
        self.lamps: LampTables = lamps
        self.surfaces: SurfaceTables = surfaces
        self.spectra: _Spectra = spectra
        self.fog: FogTables | None = None
        self.air: AirlightLamps | None = None


class _Items(NamedTuple):
    """`Work` on the device: one entry per work item."""

    row: mi.UInt32
    column: mi.UInt32
    tile: mi.UInt32  # number that random numbers go by
    owner: mi.UInt32
    lane: mi.UInt32
    lanes: mi.UInt32
    paths: mi.UInt32
    shares: mi.UInt32
    groups: mi.UInt32


class _Spectra:
    """The `BandTable` of a pass on the device."""

    def __init__(self, values: Any, rows: Any, lights: Any, places: Any, packets: int) -> None:
        self.values = values
        self.rows = rows
        self.lights = lights
        self.places = places
        self.packets = packets

    def place(self, along: Any) -> Any:
        """Return the index of the wavelength sample at position `along` (of 2^32) in each band."""
        return mi.UInt32(dr.mul_hi(along, self.places))

    def at(self, place: Any, row: Any, active: Any) -> list[Any]:
        """Return row `row` at the sample `place`, as a list of packets."""
        return [
            dr.gather(
                mi.Spectrum, self.values, (place * self.rows + row) * self.packets + k, active
            )
            for k in range(self.packets)
        ]


class _Vertex(NamedTuple):
    """A point of a path on a surface."""

    si: mi.SurfaceInteraction3f
    material: mi.UInt32
    place: mi.UInt32  # wavelength sample in each band
    colour: list  # packets: reflectance
    beta: list  # packets: weight of the path up to here


def _light_of(tables: _Tables, vertex: _Vertex, aimed: tuple[Any, ...]) -> list[Any]:
    """Return what a shadow ray brings from where it is `aimed` at (`LampTables.choose`), a list of
    packets; weighted against meeting the lamp by chance (balance heuristic: Veach and Guibas
    1995).
    """
    source, target, towards, level, density = aimed
    si = vertex.si
    spectra = tables.spectra
    open_way = level > 0
    open_way &= ~tables.scene.ray_test(si.spawn_ray_to(target), open_way)
    local = si.to_local(towards)
    value, rival = tables.surfaces.towards(vertex.material, si, local, open_way)
    level = level * dr.select(open_way, density / (density + rival), 0)
    light = spectra.at(vertex.place, spectra.lights + source, open_way)
    if tables.fog is not None:
        left = tables.fog.transmission(dr.norm(target - si.p))
        light = [one * share for one, share in zip(light, left)]
    return [
        dr.select(open_way, b * dr.lerp(value[0], value[1], c) * one * level, 0)
        for b, c, one in zip(vertex.beta, vertex.colour, light)
    ]


def _sky_through(
    tables: _Tables, openings: SkyOpenings, vertex: _Vertex, row: Any, rng: Any, active: Any
) -> list[Any]:
    """Return what one shadow ray through an opening brings of the sky, a list of packets; weighted
    against leaving the surface that way by chance. `row` is that of the sky.
    """
    si = vertex.si
    towards, density = openings.aim(rng, si.p, active)
    open_way = active & (density > 0)
    open_way &= ~tables.scene.ray_test(si.spawn_ray(towards), open_way)
    value, rival = tables.surfaces.towards(vertex.material, si, si.to_local(towards), open_way)
    level = dr.select(open_way, 1 / (density + rival), 0)
    dome = tables.lamps.dome
    if dome is None:
        light = tables.spectra.at(vertex.place, row, open_way)
    else:
        light = dome.light(tables.spectra, vertex.place, row, towards, open_way)
    return [
        dr.select(open_way, b * dr.lerp(value[0], value[1], c) * one * level, 0)
        for b, c, one in zip(vertex.beta, vertex.colour, light)
    ]


@dr.syntax
def _trace(tables: Any, seed: int, items: Any, entries: int, weights: Any, max_depth: int) -> Any:
    """Return the light of all work items (`_Items`), as in `Launch`.

    Parameters
    ----------
    tables : the scene.
    seed : of the random numbers, on the device.
    items, entries : work items, and the number of tiles that they belong to.
    weights : of X, Y and Z, in packets.
    max_depth : largest number of segments of a path.
    """
    scene = tables.scene
    hits = tables.hits
    camera = tables.camera
    lamps = tables.lamps
    surfaces = tables.surfaces
    spectra = tables.spectra
    row, column, tile, owner, lane, lanes, left, most_shares, groups_wanted = items
    on = [(groups_wanted & (1 << g)) != 0 for g in range(len(lamps.groups))]
    # place from which lamps are chosen, and the number of candidates
    block = lamps.chances.block(row, column)
    origin = mi.UInt32(0)
    tries = mi.UInt32(CANDIDATES)
    path_rng = stream(seed, tile * MOST_LANES + lane, "path")
    group_rng = [stream(seed, tile * MOST_LANES + lane, name) for name in lamps.groups]
    groups = len(lamps.groups)
    packets = spectra.packets
    fog = tables.fog
    fog_rng = []
    # whether all surfaces up to here were mirrors or clear panes: what the camera itself sees
    straight = True
    turn_of_air = 0
    if fog is not None:
        names = (*lamps.groups, "sky")
        fog_rng = [stream(seed, tile * MOST_LANES + lane, f"fog {name}") for name in names]
        straight = mi.Bool(True)
        turn_of_air = fog_rng[-1].next_uint32() + lane * (AIR_CANDIDATES * OF_PLACE & 0xFFFFFFFF)
    lit = [g for g in range(groups) if lamps.has_lamps(g)]
    # the last are the means of its rows
    sky = lamps.groups.index("sky") if "sky" in lamps.groups else -1
    sky_row = spectra.rows - 2 * lamps.sky_rows
    # fog takes its share of the light on the way, and sends on light of its own
    openings = lamps.openings if sky >= 0 and fog is None else None
    total = [[mi.Spectrum(0) for _ in range(packets)] for _ in range(groups)]
    # surfaces are evaluated with reflectance 0 and 1, side by side
    ramp = mi.Spectrum(*RAMP_NM, *RAMP_NM)
    # lanes take turns in the tile's one sequence of points, wavelengths and directions from the
    # first surface
    point, along, way, turn_of_lamps = offsets(seed, tile)
    point += mi.Point2u(lane * ACROSS, lane * DOWN)
    along += lane * ALONG
    way += mi.Point2u(lane * ASIDE, lane * UP)
    turn_of_lamps += mi.Point2u(lane * TURN, lane * CHOICE)
    # paths left that begin at `first`, where the camera's ray fell
    shares = mi.UInt32(0)
    first = dr.zeros(mi.SurfaceInteraction3f)
    first_material = mi.UInt32(0)
    ray = mi.Ray3f(mi.Point3f(camera.origin), mi.Vector3f(camera.forward), 0.0, ramp)
    centre = camera.ray(row, column, mi.Point2u(1 << 31, 1 << 31), ramp).d
    going = mi.Bool(False)
    place = mi.UInt32(0)
    depth = mi.UInt32(0)
    beta = [mi.Spectrum(1) for _ in range(packets)]
    bsdf_density = mi.Float(1)
    specular = mi.Bool(True)
    while left > 0:
        if ~going & (shares == 0):
            ray = camera.ray(row, column, point, ramp)
            point += mi.Point2u(lanes * ACROSS, lanes * DOWN)
            place = spectra.place(along)
            along += lanes * ALONG
            shares = dr.minimum(most_shares, left)
            depth = mi.UInt32(0)
            beta = [mi.Spectrum(1) for _ in range(packets)]
            bsdf_density = mi.Float(1)
            specular = mi.Bool(True)
            going = mi.Bool(True)
        si, shape = hits.meet(scene, ray, going)
        hit = going & si.is_valid()
        material = surfaces.material_at(shape, hit)
        escapes = going & ~hit

        if dr.hint(fog is not None, mode="scalar"):
            straight |= depth == 0
            # all paths of one camera ray share its airlight
            many = dr.select(depth == 0, mi.Float(shares), 1)
            end = dr.minimum(si.t, fog.to_border(ray.o, ray.d))
            turn = dr.select(depth == 0, turn_of_air, fog_rng[groups].next_uint32())
            turn_of_air += dr.select(
                depth == 0, lanes * (AIR_CANDIDATES * OF_PLACE & 0xFFFFFFFF), 0
            )
            segment = Segment(ray, end, turn)
            for g in lit:
                seen = going & straight & on[g]
                if seen:
                    source, level, packs = from_lamps(
                        tables.air, g, fog_rng[g], segment, block, seen
                    )
                    light = spectra.at(place, spectra.lights + source, level > 0)
                    for k in range(packets):
                        total[g][k] += beta[k] * light[k] * packs[k] * (level * many)
            if dr.hint(sky >= 0, mode="scalar"):
                seen = going & on[sky]
                if seen:
                    packs = from_sky(scene, fog, fog_rng[groups], segment, seen)
                    row_of_sky = dr.select(depth == 0, sky_row + lamps.sky_rows, sky_row)
                    light = spectra.at(place, row_of_sky, seen)
                    for k in range(packets):
                        total[sky][k] += beta[k] * light[k] * packs[k] * many
            left_after = fog.transmission(end)
            for k in range(packets):
                beta[k] *= left_after[k]

        # light that a path hits by itself: the sky always, a lamp only after the first surface
        # all paths of one camera ray use the mean of the sky
        visible = dr.select(depth == 0, sky_row + lamps.sky_rows, sky_row)
        colour = spectra.at(place, dr.select(hit, material, visible), going)
        if dr.hint(sky >= 0, mode="scalar"):
            level = dr.select(escapes & on[sky], dr.select(depth == 0, mi.Float(shares), 1), 0)
            if dr.hint(openings is not None, mode="scalar"):
                # a shadow ray may have found the same sky
                rivals = escapes & ~specular
                rival = openings.density(ray.o, ray.d, rivals)
                level *= dr.select(rivals, bsdf_density / (bsdf_density + rival), 1)
            if dr.hint(lamps.dome is None, mode="scalar"):
                for k in range(packets):
                    total[sky][k] += beta[k] * colour[k] * level
            else:
                if level > 0:
                    # a tile of pure sky takes the value at its centre, and so has no noise
                    way_out = dr.select(depth == 0, centre, ray.d)
                    shine = lamps.dome.light(spectra, place, visible, way_out, level > 0)
                    for k in range(packets):
                        total[sky][k] += beta[k] * shine[k] * level
        if dr.hint(len(lit) > 0, mode="scalar"):
            lamp = lamps.lamp_at(shape, hit & (depth > 0))
            cos_lamp = -dr.dot(ray.d, si.n)
            has_lamp = (lamp != lamps.none) & (cos_lamp > 0)
            if has_lamp:
                level = lamps.luminance(lamp, -ray.d, has_lamp)
                rival = lamps.rival(lamp, origin, tries, dr.square(si.t), cos_lamp, has_lamp)
                level *= dr.select(specular, 1, bsdf_density / (bsdf_density + rival))
                mine = dr.gather(mi.UInt32, lamps.group, lamp, has_lamp)
                light = spectra.at(
                    place,
                    spectra.lights + dr.gather(mi.UInt32, lamps.row, lamp, has_lamp),
                    has_lamp,
                )
                for g in lit:
                    for k in range(packets):
                        total[g][k] += dr.select((mine == g) & on[g], beta[k] * light[k] * level, 0)

        # when a path ends, its lane starts the next path at the same first surface, or follows the
        # next camera ray
        active = hit & (depth + 1 < max_depth)
        begun = going & (depth == 0)
        if begun & active:
            first = si
            first_material = material
        ended = dr.select(active, 0, dr.select(begun, shares, 1))
        shares -= ended
        left -= ended
        again = ~active & (shares > 0)
        if again:
            si = first
            material = first_material
            place = spectra.place(along)
            along += lanes * ALONG
            colour = spectra.at(place, material, again)
            depth = mi.UInt32(0)
            beta = [mi.Spectrum(1) for _ in range(packets)]
        if dr.hint(fog is not None, mode="scalar"):
            left_after = fog.transmission(first.t)
            for k in range(packets):
                beta[k] = dr.select(again, left_after[k], beta[k])
        active |= again

        if dr.hint(surfaces.textures.any, mode="scalar"):
            second, part = surfaces.textures.share(material, si.p, active)
            other = spectra.at(place, second, active & (part > 0))
            for k in range(packets):
                colour[k] = dr.lerp(colour[k], other[k], part)

        # direct light: one shadow ray for each group
        smooth = active & surfaces.is_smooth(material, active)
        origin = dr.select(depth == 0, block, lamps.chances.cell(si.p))
        tries = dr.select(depth == 0, mi.UInt32(FIRST_CANDIDATES), mi.UInt32(CANDIDATES))
        for g in lit:
            if smooth & on[g]:
                # lanes take turns among the lamps too, at each depth from another start
                start = turn_of_lamps + mi.Point2u(depth * DEEPER, depth * DEEPER)
                aimed = lamps.choose(g, group_rng[g], si, origin, tries, start, smooth)
                has_lamp = _light_of(tables, _Vertex(si, material, place, colour, beta), aimed)
                for k in range(packets):
                    total[g][k] += has_lamp[k]
        taken = dr.select(depth == 0, lanes, 0)
        turn_of_lamps += mi.Point2u(taken * TURN, taken * CHOICE)
        # at the first surface, one more shadow ray for each near lamp
        for g in lit:
            turn = mi.UInt32(0)
            near = smooth & on[g] & (depth == 0)
            count = dr.select(near, lamps.near_count(g, block, near), 0)
            while turn < count:
                aimed = lamps.near_point(g, turn, group_rng[g], si, block, near)
                has_lamp = _light_of(tables, _Vertex(si, material, place, colour, beta), aimed)
                for k in range(packets):
                    total[g][k] += has_lamp[k]
                turn += 1

        if dr.hint(openings is not None, mode="scalar"):
            if smooth & on[sky]:
                vertex = _Vertex(si, material, place, colour, beta)
                found = _sky_through(tables, openings, vertex, sky_row, group_rng[sky], smooth)
                for k in range(packets):
                    total[sky][k] += found[k]

        # continue with the next segment
        strongest = mi.Float(0)
        if active:
            pick = path_rng.next_float32()
            spot = mi.Point2f(path_rng.next_float32(), path_rng.next_float32())
            if depth == 0:
                spot = share(way)
                way += mi.Point2u(lanes * ASIDE, lanes * UP)
            sampled, factor = surfaces.onwards(material, si, pick, spot, active)
            for k in range(packets):
                beta[k] *= dr.lerp(factor[0], factor[1], colour[k])
                strongest = dr.maximum(strongest, dr.max(beta[k]))
            ray = si.spawn_ray(si.to_world(sampled.wo))
            ray.wavelengths = ramp
            bsdf_density = sampled.pdf
            specular = mi.has_flag(sampled.sampled_type, mi.BSDFFlags.Delta)
            if dr.hint(fog is not None, mode="scalar"):
                straight = ((depth == 0) | straight) & specular
            depth += 1
        going = strongest > 0
    batches = [
        [sum(dr.dot(total[g][k], one[k]) for k in range(packets)) for one in weights]
        for g in range(groups)
    ]
    out = [[dr.zeros(mi.Float, entries) for _ in range(4 * packets)] for _ in range(groups)]
    for g in range(groups):
        for k in range(packets):
            for i in range(4):
                dr.scatter_reduce(
                    dr.ReduceOp.Add,
                    out[g][4 * k + i],
                    total[g][k][i],
                    owner,
                    mode=dr.ReduceMode.Local,
                )
    return out, batches
