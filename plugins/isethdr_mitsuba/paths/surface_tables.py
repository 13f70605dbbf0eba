"""Surfaces on the device: the material that a ray met, its reflectance table, and one evaluation
for all bands.

Surfaces that differ only in colour share their compiled code. (Mitsuba itself gives every instance
a surface of its own.)
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..lamps.placed_lamps import SPECTRUM_NM
from .device_memory import aligned
from .texture_noise import TextureTables

if TYPE_CHECKING:
    from ..world.geometry import World


class SurfaceTables:
    """Device tables of the materials of a world of ramp surfaces (`materials.ramp_surfaces`)."""

    def __init__(self, world: World, materials: Iterable[Any], surfaces: Iterable[Any]) -> None:
        """Make the tables of all materials.

        Parameters
        ----------
        world : scene with the shapes that have the materials.
        materials : `Material` by number, as in the shapes of the world.
        surfaces : BSDF of each material, in the same order.
        """
        materials = list(materials)
        second = [m.texture.other for m in materials if m.texture is not None]
        self.reflectance = np.array(
            [
                np.clip(spectrum.at(SPECTRUM_NM), 0, 1)
                for spectrum in (*(m.reflectance for m in materials), *second)
            ]
        ).reshape(-1, len(SPECTRUM_NM))
        self.textures = TextureTables(materials, len(materials))
        surfaces = list(surfaces) or [mi.load_dict({"type": "diffuse"})]
        unique = {id(s): s for s in surfaces}
        order = {key: k for k, key in enumerate(unique)}
        self.kinds = list(unique.values())
        self.kind = mi.UInt32([order[id(s)] for s in surfaces])
        self.smooth = mi.Bool([mi.has_flag(s.flags(), mi.BSDFFlags.Smooth) for s in surfaces])
        self.material_of = mi.UInt32(aligned(world.table(lambda s: s.material), np.uint32))
        dr.eval(self.kind, self.smooth, self.material_of)

    def material_at(self, shape: Any, active: Any) -> Any:
        """Return the number of the material of a shape."""
        return dr.gather(mi.UInt32, self.material_of, shape, active)

    def is_smooth(self, material: Any, active: Any) -> Any:
        """Return whether the surface scatters light, unlike a perfect mirror or a clear pane."""
        return dr.gather(mi.Bool, self.smooth, material, active)

    def towards(self, material: Any, si: Any, direction: Any, active: Any) -> tuple[Any, Any]:
        """Return (value, density per solid angle) of the surface towards `direction` (local).

        Channel 0 of the value is for reflectance 0, channel 1 for reflectance 1. The value is
        linear in the reflectance.

        Parameters
        ----------
        material : number of the material.
        si : surface interaction.
        direction : unit vector in the axes of the surface.
        active : lanes that take part.
        """
        kind = dr.gather(mi.UInt32, self.kind, material, active)
        return dr.switch(
            kind, [partial(_towards, surface) for surface in self.kinds], si, direction, active
        )

    def onwards(self, material: Any, si: Any, pick: Any, spot: Any, active: Any) -> tuple[Any, Any]:
        """Draw a direction: return a BSDFSample3f, and value / density with channels as in
        `towards`.

        Parameters
        ----------
        material : number of the material.
        si : surface interaction.
        pick : random number from 0 to 1 that picks a lobe of the surface.
        spot : two random numbers from 0 to 1 that pick the direction.
        active : lanes that take part.
        """
        kind = dr.gather(mi.UInt32, self.kind, material, active)
        return dr.switch(
            kind, [partial(_onwards, surface) for surface in self.kinds], si, pick, spot, active
        )


def _towards(surface: Any, si: Any, direction: Any, active: Any) -> tuple[Any, Any]:
    return surface.eval_pdf(mi.BSDFContext(), si, direction, active)


def _onwards(surface: Any, si: Any, pick: Any, spot: Any, active: Any) -> tuple[Any, Any]:
    return surface.sample(mi.BSDFContext(), si, pick, spot, active)
