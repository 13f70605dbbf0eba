"""Surfaces on the device: which material a ray met, its reflectance table, and one evaluation for all bands.

Only surfaces that differ in more than colour are compiled, whatever Mitsuba holds besides (it gives every instance
a surface of its own).
"""

from __future__ import annotations

from functools import partial

import drjit as dr
import mitsuba as mi
import numpy as np

from .placed_lamps import SPECTRUM_NM
from .spectra import SpectrumTable


class SurfaceTables:
    """Device tables of the materials of a world of ramp surfaces (`materials.ramp_surfaces`)."""

    def __init__(self, world, materials, surfaces):
        self.colours = SpectrumTable([np.clip(m.reflectance.at(SPECTRUM_NM), 0, 1) for m in materials])
        surfaces = list(surfaces) or [mi.load_dict({"type": "diffuse"})]
        unique = {id(s): s for s in surfaces}
        order = {key: k for k, key in enumerate(unique)}
        self.kinds = list(unique.values())
        self.kind = mi.UInt32([order[id(s)] for s in surfaces])
        self.smooth = mi.Bool([mi.has_flag(s.flags(), mi.BSDFFlags.Smooth) for s in surfaces])
        self.material_of = mi.UInt32(world.table(lambda s: s.material))
        dr.eval(self.kind, self.smooth, self.material_of)

    def material_at(self, si, active):
        """Return the number of the material at a surface interaction."""
        shape = dr.reinterpret_array(mi.UInt32, si.shape)
        return dr.gather(mi.UInt32, self.material_of, shape, active & (shape < dr.width(self.material_of)))

    def is_smooth(self, material, active):
        """Say whether light from a lamp can be reflected other than as by a mirror or a clear pane."""
        return dr.gather(mi.Bool, self.smooth, material, active)

    def reflect(self, material, si, directions, masks, pick, spot, active):
        """Evaluate the surface towards `directions` (local), and draw a direction of its own.

        Returns
        -------
        seen : a (value, density per solid angle) for each direction.
        sampled, factor : BSDFSample3f and its value / density.
        Values hold reflectance 0 in channel 0 and reflectance 1 in channel 1; the truth is linear between.
        """
        kind = dr.gather(mi.UInt32, self.kind, material, active)
        return dr.switch(kind, [partial(_reflect, surface) for surface in self.kinds], si, directions, masks, pick, spot, active)


def _reflect(surface, si, directions, masks, pick, spot, active):
    context = mi.BSDFContext()
    seen = [surface.eval_pdf(context, si, direction, mask & active) for direction, mask in zip(directions, masks, strict=True)]
    sampled, factor = surface.sample(context, si, pick, spot, active)
    return seen, sampled, factor
