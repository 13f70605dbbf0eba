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
from .lamp_tables import CANDIDATES, LampTables
from .materials import RAMP_NM
from .surface_tables import SurfaceTables
from .view import View

# from so many on the loop is recorded once: writing it down for each pass takes seconds then; but a record is compiled for each scene
MANY_SHAPES = 100


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
    function : of `seed` of the pass and `samples`, paths per tile, summed in float32, so at most about 1024. It returns a
        list (group) of lists (packet) of Spectrum of 4 bands, width = number of tiles, W m-2 sr-1 nm-1.
    """
    packets = (len(wavelength_nm) + 3) // 4
    bands = [mi.Spectrum(*[float(wavelength_nm[min(4 * k + i, len(wavelength_nm) - 1)]) for i in range(4)]) for k in range(packets)]
    tables = (world.scene, bands, _arrays(lamps), [_arrays(t) for t in lamps.targets], _arrays(lamps.spectra), _arrays(surfaces),
              _arrays(surfaces.colours), surfaces.kinds)

    def trace(seed, samples):
        return _trace(world.scene, view, lamps, surfaces, bands, float(step_nm), seed, samples, max_depth)

    if recorded := len(world.shapes) > MANY_SHAPES:
        trace = dr.freeze(trace, state_fn=lambda seed, samples: tables)

    def one_pass(seed, samples):
        # seed and sample count are data, not literals: one kernel for all passes
        given = dr.opaque(mi.UInt32, seed & 0xFFFFFFFF), dr.opaque(mi.UInt32, samples)
        try:
            return trace(*given)
        except RuntimeError:        # shapes of another scene were freed since: Dr.Jit refuses the record, which is made anew
            if not recorded:
                raise
            trace.clear()
            return trace(*given)

    return one_pass


def _arrays(tables) -> dict:
    """Return the device arrays that an object of tables holds."""
    return {name: value for name, value in vars(tables).items() if type(value).__module__.startswith(("drjit", "mitsuba"))}


def _stream(seed, tiles, purpose: str):
    """Return random numbers for `purpose`, independent per tile."""
    a, b = mi.sample_tea_32(tiles, seed ^ crc32(purpose.encode()))
    moved = mi.UInt64(tiles) - dr.arange(mi.UInt64, dr.width(tiles))    # PCG32 adds the place in the array: the tile's number counts instead
    return mi.PCG32(dr.width(tiles), mi.UInt64(a) + moved, mi.UInt64(b) + moved)


@dr.syntax
def _trace(scene, view, lamps, surfaces, bands, step_nm, seed, samples, max_depth):
    rows, columns = view.shape
    tiles = dr.arange(mi.UInt32, rows * columns)
    row, column = tiles // columns + view.cut[0], tiles % columns + view.cut[1]     # of the whole grid, as are their numbers
    numbers = row * view.whole[1] + column
    pitch_x, pitch_y, angles = view.pitch_x, view.pitch_y, view.projection == "equidistant"     # a loop may not carry the frozen view itself
    left = mi.Float(column) * pitch_x + float(view.x[0] - (view.cut[1] + 0.5) * pitch_x)
    top = mi.Float(row) * pitch_y + float(view.y[0] - (view.cut[0] + 0.5) * pitch_y)
    origin = mi.Point3f(view.origin_m.tolist())
    right, down, forward = (mi.Vector3f(axis.tolist()) for axis in (view.right, view.down, view.forward))
    path_rng = _stream(seed, numbers, "path")
    group_rng = [_stream(seed, numbers, name) for name in lamps.groups]
    groups, packets = len(lamps.groups), len(bands)
    lit = [g for g in range(groups) if lamps.has_lamps(g)]
    sky = lamps.groups.index("sky") if "sky" in lamps.groups else -1
    total = [[mi.Spectrum(0) for _ in range(packets)] for _ in range(groups)]
    ramp = mi.Spectrum(*RAMP_NM, *RAMP_NM)      # surfaces are evaluated with reflectance 0 and 1, side by side
    done = mi.UInt32(0)
    while done < samples:
        x = left + path_rng.next_float32() * pitch_x
        y = top + path_rng.next_float32() * pitch_y
        if dr.hint(angles, mode="scalar"):
            theta = dr.sqrt(x * x + y * y)
            across = dr.select(theta > 1e-4, dr.sin(theta) / theta, 1)      # 1e-4: the series' next term is below float32
            ray = mi.Ray3f(origin, right * (across * x) + down * (across * y) + forward * dr.cos(theta), 0.0, ramp)
        else:
            ray = mi.Ray3f(origin, dr.normalize(right * x + down * y + forward), 0.0, ramp)
        shift = (path_rng.next_float32() - 0.5) * step_nm
        waves = [b + shift for b in bands]
        beta = [mi.Spectrum(1) for _ in range(packets)]
        depth = mi.UInt32(0)
        bsdf_density, specular = mi.Float(1), mi.Bool(True)
        active = mi.Bool(True)
        while active:
            si = scene.ray_intersect(ray, active)

            # light found by chance: the sky always, a lamp only past the first surface
            if dr.hint(sky >= 0, mode="scalar"):
                missed = active & ~si.is_valid()
                light = lamps.spectra.at(mi.UInt32(lamps.sky_row), waves, missed)
                for k in range(packets):
                    total[sky][k] += dr.select(missed, beta[k] * light[k], 0)
            if dr.hint(len(lit) > 0, mode="scalar"):
                lamp = lamps.lamp_at(si, active & (depth > 0))
                cos_lamp = -dr.dot(ray.d, si.n)
                found = active & (depth > 0) & (lamp != lamps.none) & (cos_lamp > 0)
                level = lamps.luminance(lamp, -ray.d, found)
                rival = CANDIDATES * lamps.density(lamp, dr.square(si.t), cos_lamp, found)
                level *= dr.select(specular, 1, bsdf_density / (bsdf_density + rival))
                mine = dr.gather(mi.UInt32, lamps.group, lamp, found)
                light = lamps.spectra.at(dr.gather(mi.UInt32, lamps.row, lamp, found), waves, found)
                for g in lit:
                    for k in range(packets):
                        total[g][k] += dr.select(found & (mine == g), beta[k] * light[k] * level, 0)

            # light looked for: one shadow ray for each group
            active &= si.is_valid() & (depth + 1 < max_depth)
            material = surfaces.material_at(si, active)
            smooth = active & surfaces.is_smooth(material, active)
            chosen = []
            for g in lit:
                lamp, point, towards, inverse, density = lamps.choose(g, group_rng[g], si, smooth)
                open_way = smooth & (inverse > 0)
                open_way &= ~scene.ray_test(si.spawn_ray_to(point), open_way)
                level = lamps.luminance(lamp, -towards, open_way) * inverse
                chosen.append((lamp, si.to_local(towards), level, density, open_way))
            pick, spot = path_rng.next_float32(), mi.Point2f(path_rng.next_float32(), path_rng.next_float32())
            seen, sampled, factor = surfaces.reflect(material, si, [c[1] for c in chosen], [c[4] for c in chosen], pick, spot, active)
            colour = surfaces.colours.at(material, waves, active)
            for index in range(len(lit)):
                lamp, _, level, density, open_way = chosen[index]
                value, rival = seen[index]
                level *= dr.select(open_way, CANDIDATES * density / (CANDIDATES * density + rival), 0)
                light = lamps.spectra.at(dr.gather(mi.UInt32, lamps.row, lamp, open_way), waves, open_way)
                for k in range(packets):
                    total[lit[index]][k] += dr.select(open_way, beta[k] * dr.lerp(value[0], value[1], colour[k]) * light[k] * level, 0)

            # onwards
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
