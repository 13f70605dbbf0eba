"""Textures on the device: the share of the second reflectance of a surface at a point.

The share follows value noise (see Perlin 1985): smooth interpolation between random values at the
corners of a cubic lattice, one value for each corner and seed. The random values are hashes of
integers, so there is no table and no seam.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .device_memory import aligned

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Material

SPAN = 1 << 20  # largest distance of a point from the origin along each axis, in lattice cells


class TextureTables:
    """Device tables of the textures of materials. If no material has a texture, no code is compiled
    for them.
    """

    def __init__(self, materials: Sequence[Material], first_row: int) -> None:
        """Make the tables.

        Parameters
        ----------
        materials : materials by number.
        first_row : row of the first second reflectance in the table of spectra. Further ones follow
            in the order of the materials that have a texture.
        """
        self.any = any(m.texture is not None for m in materials)
        if not self.any:
            return
        rows = []
        second = []
        for number, material in enumerate(materials):
            texture = material.texture
            if texture is None:
                rows.append([0.0, 0.0, 0.0, 0.0])
                second.append([number, 0])
                continue
            strength = texture.patches / 2, texture.grain / 2
            rows.append([1 / texture.patch_m, strength[0], 1 / texture.grain_m, strength[1]])
            second.append([first_row, texture.seed & 0xFFFFFFFF])
            first_row += 1
        self.rows = mi.Float(aligned(rows, np.float32))
        self.second = mi.UInt32(aligned([one for one, _ in second], np.uint32))
        self.seed = mi.UInt32(aligned([seed for _, seed in second], np.uint32))
        dr.eval(self.rows, self.second, self.seed)

    def share(self, material: Any, point: Any, active: Any) -> tuple[Any, Any]:
        """Return the row of the second reflectance of a material and its share at a world point. A
        material without a texture has its own row and the share 0.

        Parameters
        ----------
        material : number of the material.
        point : point in the world, m.
        active : lanes that take part.
        """
        row = dr.gather(mi.Vector4f, self.rows, material, active)
        second = dr.gather(mi.UInt32, self.second, material, active)
        seed = dr.gather(mi.UInt32, self.seed, material, active)
        textured = active & (row.x > 0)
        share = 0.5 + row.y * noise(point * row.x, seed) + row.w * noise(point * row.z, seed + 1)
        return second, dr.select(textured, dr.clip(share, 0, 1), 0)


def noise(place: Any, seed: Any) -> Any:
    """Return smooth noise, -1..1, at the position `place`, in units of lattice cells."""
    low = dr.floor(place)
    at = place - low
    ease = at * at * (3 - 2 * at)
    corner = mi.Vector3u(mi.Vector3i(low) + SPAN)
    total = mi.Float(0)
    for k in range(8):
        step = k & 1, (k >> 1) & 1, k >> 2
        weight = mi.Float(1)
        for axis in range(3):
            weight *= ease[axis] if step[axis] else 1 - ease[axis]
        total += weight * _random(mi.Vector3u(*(corner[i] + step[i] for i in range(3))), seed)
    return total


def _random(corner: Any, seed: Any) -> Any:
    """Return the random value, -1..1, of a lattice corner (integer hash after Mueller, 2012)."""
    h = corner.x * 0x8DA6B343 + corner.y * 0xD8163841 + corner.z * 0xCB1AB31F + seed * 0x9E3779B9
    for _ in range(2):
        h = (h ^ (h >> 16)) * 0x45D9F3B
    h ^= h >> 16
    return mi.Float(h >> 8) * (2.0 / (1 << 24)) - 1
