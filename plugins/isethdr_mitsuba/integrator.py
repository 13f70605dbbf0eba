"""One path, all bands, all light groups: the integrator.

A path carries packets of four wavelengths, one per band, jittered inside the band by one shared number: a value
is an unbiased mean over its band. Directions are drawn once for all bands and all groups, and every group has
random numbers of its own for its shadow rays, so that a group's light is bit for bit the same whether the other
groups are rendered or not. Lamps seen directly are left to `visible_lamps.py`.
"""

from __future__ import annotations

from zlib import crc32

import drjit as dr
import mitsuba as mi

from .geometry import World
from .hits import HitTables
from .lamp_tables import CANDIDATES, LampTables
from .materials import RAMP_NM
from .surface_tables import SurfaceTables
from .view import View


def paths(world: World, view: View, lamps: LampTables, surfaces: SurfaceTables, wavelength_nm, step_nm: float, max_depth: int):
    """Return the function of one pass: (seed, samples) -> radiance of the tiles, summed over `samples` paths each.

    Parameters
    ----------
    world : scene of ramp surfaces (`materials.ramp_surfaces`).
    view : tiles.
    lamps : light groups and lamps.
    surfaces : materials of the world.
    wavelength_nm, step_nm : band centres and their common width, nm.
    max_depth : longest path, in segments; 2 is direct light only.

    Returns
    -------
    function : of `seed` of the pass, `samples`, paths per tile, summed in float32, so at most about 1024, and `wanted`, numbers of the
        light groups to follow (None: all). It returns a list (group) of lists (packet) of Spectrum of 4 bands, width = number of tiles,
        W m-2 sr-1 nm-1; 0 for groups that are not wanted.
    """
    packets = (len(wavelength_nm) + 3) // 4
    bands = [tuple(float(wavelength_nm[min(4 * k + i, len(wavelength_nm) - 1)]) for i in range(4)) for k in range(packets)]
    hits, camera, tiles = HitTables(world), _Camera(view), view.shape[0] * view.shape[1]

    def one_pass(seed, samples, wanted=None):
        # data, not literals: one kernel for all passes, light groups wanted, and scenes of the same kinds of surfaces
        given = dr.opaque(mi.UInt32, seed & 0xFFFFFFFF), dr.opaque(mi.UInt32, samples)
        on = [dr.opaque(mi.Bool, wanted is None or g in wanted) for g in range(len(lamps.groups))]
        return _trace(world.scene, hits, camera, tiles, lamps, surfaces, bands, float(step_nm), *given, on, max_depth)

    return one_pass


class _Camera:
    """A view on the device."""

    def __init__(self, view):
        number, length = (lambda v: dr.opaque(mi.UInt32, v)), (lambda v: dr.opaque(mi.Float, float(v)))
        self.angles = view.projection == "equidistant"
        self.columns, self.cut, self.whole_columns = number(view.shape[1]), tuple(map(number, view.cut)), number(view.whole[1])
        self.pitch_x, self.pitch_y = length(view.pitch_x), length(view.pitch_y)
        self.left = length(view.x[0] - (view.cut[1] + 0.5) * view.pitch_x)
        self.top = length(view.y[0] - (view.cut[0] + 0.5) * view.pitch_y)
        self.origin, self.right, self.down, self.forward = (mi.Vector3f(*map(length, v)) for v in (view.origin_m, view.right, view.down, view.forward))


def _stream(seed, tiles, purpose: str):
    """Return random numbers for `purpose`, independent per tile."""
    a, b = mi.sample_tea_32(tiles, seed ^ crc32(purpose.encode()))
    moved = mi.UInt64(tiles) - dr.arange(mi.UInt64, dr.width(tiles))    # PCG32 adds the place in the array: the tile's number counts instead
    return mi.PCG32(dr.width(tiles), mi.UInt64(a) + moved, mi.UInt64(b) + moved)


@dr.syntax
def _trace(scene, hits, camera, tiles, lamps, surfaces, bands, step_nm, seed, samples, on, max_depth):
    tile = dr.arange(mi.UInt32, tiles)
    row, column = tile // camera.columns + camera.cut[0], tile % camera.columns + camera.cut[1]     # of the whole grid, as are their numbers
    numbers = row * camera.whole_columns + column
    left, top = mi.Float(column) * camera.pitch_x + camera.left, mi.Float(row) * camera.pitch_y + camera.top
    path_rng = _stream(seed, numbers, "path")
    group_rng = [_stream(seed, numbers, name) for name in lamps.groups]
    groups, packets = len(lamps.groups), len(bands)
    lit = [g for g in range(groups) if lamps.has_lamps(g)]
    sky = lamps.groups.index("sky") if "sky" in lamps.groups else -1
    total = [[mi.Spectrum(0) for _ in range(packets)] for _ in range(groups)]
    ramp = mi.Spectrum(*RAMP_NM, *RAMP_NM)      # surfaces are evaluated with reflectance 0 and 1, side by side
    done = mi.UInt32(0)
    while done < samples:
        x = left + path_rng.next_float32() * camera.pitch_x
        y = top + path_rng.next_float32() * camera.pitch_y
        if dr.hint(camera.angles, mode="scalar"):
            theta = dr.sqrt(x * x + y * y)
            across = dr.select(theta > 1e-4, dr.sin(theta) / theta, 1)      # 1e-4: the series' next term is below float32
            way = camera.right * (across * x) + camera.down * (across * y) + camera.forward * dr.cos(theta)
        else:
            way = dr.normalize(camera.right * x + camera.down * y + camera.forward)
        ray = mi.Ray3f(mi.Point3f(camera.origin), way, 0.0, ramp)
        shift = (path_rng.next_float32() - 0.5) * step_nm
        waves = [mi.Spectrum(*b) + shift for b in bands]
        beta = [mi.Spectrum(1) for _ in range(packets)]
        depth = mi.UInt32(0)
        bsdf_density, specular = mi.Float(1), mi.Bool(True)
        active = mi.Bool(True)
        while active:
            si, shape = hits.meet(scene, ray, active)

            # light found by chance: the sky always, a lamp only past the first surface
            if dr.hint(sky >= 0, mode="scalar"):
                missed = active & ~si.is_valid() & on[sky]
                light = lamps.spectra.at(lamps.sky_row, waves, missed)
                for k in range(packets):
                    total[sky][k] += dr.select(missed, beta[k] * light[k], 0)
            if dr.hint(len(lit) > 0, mode="scalar"):
                lamp = lamps.lamp_at(shape, active & si.is_valid() & (depth > 0))
                cos_lamp = -dr.dot(ray.d, si.n)
                found = (lamp != lamps.none) & (cos_lamp > 0)
                if found:
                    level = lamps.luminance(lamp, -ray.d, found)
                    rival = CANDIDATES * lamps.density(lamp, dr.square(si.t), cos_lamp, found)
                    level *= dr.select(specular, 1, bsdf_density / (bsdf_density + rival))
                    mine = dr.gather(mi.UInt32, lamps.group, lamp, found)
                    light = lamps.spectra.at(dr.gather(mi.UInt32, lamps.row, lamp, found), waves, found)
                    for g in lit:
                        for k in range(packets):
                            total[g][k] += dr.select((mine == g) & on[g], beta[k] * light[k] * level, 0)

            # light looked for: one shadow ray for each group
            active &= si.is_valid() & (depth + 1 < max_depth)
            material = surfaces.material_at(shape, active)
            smooth = active & surfaces.is_smooth(material, active)
            colour = surfaces.colours.at(material, waves, active)
            for g in lit:
                if smooth & on[g]:
                    lamp, point, towards, inverse, density = lamps.choose(g, group_rng[g], si, smooth)
                    open_way = inverse > 0
                    open_way &= ~scene.ray_test(si.spawn_ray_to(point), open_way)
                    value, rival = surfaces.towards(material, si, si.to_local(towards), open_way)
                    level = lamps.luminance(lamp, -towards, open_way) * inverse
                    level *= dr.select(open_way, CANDIDATES * density / (CANDIDATES * density + rival), 0)
                    light = lamps.spectra.at(dr.gather(mi.UInt32, lamps.row, lamp, open_way), waves, open_way)
                    for k in range(packets):
                        total[g][k] += dr.select(open_way, beta[k] * dr.lerp(value[0], value[1], colour[k]) * light[k] * level, 0)

            # onwards
            pick, spot = path_rng.next_float32(), mi.Point2f(path_rng.next_float32(), path_rng.next_float32())
            sampled, factor = surfaces.onwards(material, si, pick, spot, active)
            strongest = mi.Float(0)
            for k in range(packets):
                beta[k] *= dr.lerp(factor[0], factor[1], colour[k])
                strongest = dr.maximum(strongest, dr.max(beta[k]))
            ray = si.spawn_ray(si.to_world(sampled.wo))
            ray.wavelengths = ramp
            bsdf_density = sampled.pdf
            specular = mi.has_flag(sampled.sampled_type, mi.BSDFFlags.Delta)
            depth += 1
            active &= strongest > 0
        done += 1
    dr.eval(total)
    return total
