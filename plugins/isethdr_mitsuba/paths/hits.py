"""Hits: the surface that a ray meets, looked up in tables of all triangles.

Mitsuba finds the triangle of a hit, and then calls a function of the shape for position and normal.
One function is compiled for each shape, with the numbers of the shape in its code. With tables, the
code is short and the same for every scene. One kernel is compiled once and then taken from Dr.Jit's
cache on disk.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..world.geometry import World
from .device_memory import aligned


class HitTables:
    """Device tables of the triangles of a world and of the poses of its instances."""

    def __init__(self, world: World) -> None:
        """Make the tables of `world`."""
        meshes = [s for s in world.shapes if s.pose is None]
        fields = [mi.traverse(s.shape) for s in meshes]
        positions, faces = (
            [np.array(f[name]) for f in fields] for name in ("vertex_positions", "faces")
        )
        normals = [
            np.array(f["vertex_normals"]) if s.shape.has_vertex_normals() else np.zeros_like(p)
            for s, f, p in zip(meshes, fields, positions, strict=True)
        ]
        starts, first = (
            np.cumsum([0, *(len(a) // 3 for a in arrays)])[:-1] for arrays in (positions, faces)
        )
        faces = [f + np.uint32(start) for f, start in zip(faces, starts, strict=True)]
        # a world without surfaces gets one corner that no ray meets
        joined = lambda arrays: np.concatenate(arrays) if arrays else np.zeros(3)
        numbers = lambda arrays: mi.Float(aligned(joined(arrays), np.float32))
        self.positions = numbers(positions)
        self.normals = numbers(normals)
        self.faces = mi.UInt32(aligned(joined(faces), np.uint32))
        triangle = dict(zip(map(id, meshes), map(int, first), strict=True))
        self.first = mi.UInt32(aligned(world.table(lambda s: triangle.get(id(s), 0)), np.uint32))
        poses, part, parts = world.instances()
        self.part = mi.UInt32(aligned(part, np.uint32))
        self.parts = mi.UInt32(aligned(parts, np.uint32))
        # Passed as a list, which Dr.Jit copies into aligned memory. A NumPy array would be used in
        # place; it is aligned only by chance, and an unaligned one needs another kernel.
        self.to_world = mi.Float(poses[:, :3].ravel().tolist())
        # normals are transformed by the inverse transposed matrix
        turn = np.linalg.inv(poses[:, :3, :3]).transpose(0, 2, 1)
        self.turn = mi.Float(aligned(turn, np.float32))
        dr.eval(
            self.positions,
            self.normals,
            self.faces,
            self.first,
            self.part,
            self.parts,
            self.to_world,
            self.turn,
        )

    def meet(self, scene: Any, ray: Any, active: Any) -> tuple[Any, Any]:
        """Return the SurfaceInteraction3f of the first hit of `ray`, and the number of the shape.
        The fields t (infinite without a hit), time, p, n, sh_frame, wi and wavelengths are set.

        Parameters
        ----------
        scene : scene of Mitsuba.
        ray : Ray3f to trace.
        active : lanes that take part.
        """
        preliminary = scene.ray_intersect_preliminary(ray, active=active)
        hit = active & preliminary.is_valid()
        # instance 0 means a shape that is no instance; for an instance, `shape_index` is the number
        # of its part that was hit
        placed = dr.reinterpret_array(mi.UInt32, preliminary.instance)
        part = dr.gather(
            mi.UInt32,
            self.parts,
            dr.gather(mi.UInt32, self.part, placed, hit) + preliminary.shape_index,
            hit & (placed > 0),
        )
        shape = dr.select(placed > 0, part, dr.reinterpret_array(mi.UInt32, preliminary.shape))
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.t = dr.select(hit, preliminary.t, dr.inf)
        si.time = ray.time
        si.wavelengths = ray.wavelengths
        corner = dr.gather(
            mi.Vector3u,
            self.faces,
            dr.gather(mi.UInt32, self.first, shape, hit) + preliminary.prim_index,
            hit,
        )
        at = lambda table: [dr.gather(mi.Vector3f, table, corner[k], hit) for k in range(3)]
        a, b, c = at(self.positions)
        u = preliminary.prim_uv.x
        v = preliminary.prim_uv.y
        ab = b - a
        ac = c - a
        across = dr.cross(ab, ac)
        na, nb, nc = at(self.normals)
        # a mesh without vertex normals has zeros here
        smooth = na * (1 - u - v) + nb * u + nc * v
        smooth = dr.select(dr.squared_norm(smooth) > 0, smooth, across)  # none given: flat
        rows = [dr.gather(mi.Vector4f, self.to_world, 3 * placed + k, hit) for k in range(3)]
        turn = [dr.gather(mi.Vector3f, self.turn, 3 * placed + k, hit) for k in range(3)]
        point = a + ab * u + ac * v
        si.p = mi.Point3f(*(dr.dot(mi.Vector3f(r.x, r.y, r.z), point) + r.w for r in rows))
        turned = lambda n: dr.normalize(mi.Normal3f(*(dr.dot(r, n) for r in turn)))
        si.n = turned(across)
        si.sh_frame = mi.Frame3f(turned(smooth))
        si.wi = dr.select(hit, si.to_local(-ray.d), -ray.d)
        return si, shape
