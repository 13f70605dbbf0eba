"""The beam-limited area light as a Mitsuba emitter, for Mitsuba's own integrators, in every
spectral variant.

It is used where the integrator of this plugin cannot run, and in tests as an independent check of
its tables.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .device_grids import DeviceGrids
from .placed_lamps import LAMBERTIAN_COS, SPECTRUM_NM, PlacedLamp, emission_table

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..world.view import View

PLUGIN = "isethdr_beam_lamp"
NEAR_CLIP_M = 1e-3
# Sampling weight of a lamp that is not sampled. With 0, Mitsuba would give full weight to rays that
# hit the lamp by chance.
NEVER = 1e-7


def beam_lamp(
    placed: PlacedLamp, hidden_from: np.ndarray | None = None, mirrored_only: bool = False
) -> Any:
    """Return a new Mitsuba emitter for `placed`, to be attached to the mesh of its triangles.

    Parameters
    ----------
    placed : lamp.
    hidden_from : (3,) point in the world, m, or None. Rays that start there do not hit the emitter.
        Pass the pinhole if `visible_lamps` adds the direct light of the lamp.
    mirrored_only : if true, the lamp lights no surface, and is visible only in perfect mirrors and
        through panes. Use it if `spots` light the surfaces. The attribute `on` of the emitter
        switches the lamp on and off.
    """
    mi.register_emitter(PLUGIN, lambda properties: _beam_class()(properties))
    table = emission_table([placed.lamp.spectrum])[0] * placed.peak_cd_m2
    spectrum = {
        "type": "regular",
        "wavelength_min": float(SPECTRUM_NM[0]),
        "wavelength_max": float(SPECTRUM_NM[-1]),
        "values": ", ".join(f"{v:.9g}" for v in table),
    }
    point = [1e30] * 3 if hidden_from is None else [float(v) for v in hidden_from]
    emitter = mi.load_dict(
        {
            "type": PLUGIN,
            "radiance": spectrum if table.any() else {"type": "uniform", "value": 0.0},
            "axis": mi.ScalarVector3f(*(float(v) for v in placed.axis)),
            "floor": placed.floor,
            "cos_inner": placed.cos_inner,
            "cos_outer": placed.cos_outer,
            "hidden_from": mi.ScalarVector3f(*point),
            **({"mirrored_only": True, "sampling_weight": NEVER} if mirrored_only else {}),
        }
    )
    if placed.grid is not None:
        emitter.follow_grid(placed)
    return emitter


def film(wavelength_nm: ArrayLike, step_nm: float, width: int, height: int) -> dict:
    """Return the Mitsuba dictionary of a film with one top-hat channel per band. Its values are
    integrals over the band; divide them by `step_nm` for means.

    Parameters
    ----------
    wavelength_nm : (band,) centres, nm.
    step_nm : width of the bands, nm.
    width : number of columns.
    height : number of rows.
    """
    out = {
        "type": "specfilm",
        "width": width,
        "height": height,
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    edge = 1e-3  # nm; Mitsuba's tables need four separate nodes
    for k, centre in enumerate(np.asarray(wavelength_nm, float)):
        low = centre - step_nm / 2
        high = centre + step_nm / 2
        out[f"band{k:03d}"] = {
            "type": "irregular",
            "wavelengths": f"{low}, {low + edge}, {high - edge}, {high}",
            "values": "0, 1, 1, 0",
        }
    return out


def sensor(view: View, film_entry: dict) -> dict:
    """Return the Mitsuba pinhole camera of `view`; its tiles must be square."""
    origin = [float(v) for v in view.origin_m]
    matrix = np.eye(4)
    # Mitsuba's camera axes: left, up, forward
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = (
        -view.right,
        -view.down,
        view.forward,
        origin,
    )
    fov = 2 * np.degrees(np.arctan(len(view.x) * view.pitch_x / 2))
    return {
        "type": "perspective",
        "fov": float(fov),
        "fov_axis": "x",
        "near_clip": NEAR_CLIP_M,
        "far_clip": 1e6,
        "to_world": mi.ScalarTransform4f(matrix),
        "film": film_entry,
        "sampler": {"type": "independent"},
    }


def _beam_class() -> type:
    class BeamLamp(mi.Emitter):
        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.radiance = properties.get_emissive_texture("radiance", 1.0)
            get = lambda name: (
                dr.opaque(mi.Float, properties[name]) if dr.is_jit_v(mi.Float) else properties[name]
            )
            self.cos_inner = get("cos_inner")
            self.cos_outer = get("cos_outer")
            self.floor = get("floor")
            self.axis = mi.Vector3f(properties["axis"])
            self.hidden_from = mi.Point3f(properties["hidden_from"])
            self.on = True
            self.mirrored_only = properties.get("mirrored_only", False)
            self.lambertian = properties["cos_inner"] <= LAMBERTIAN_COS
            # for a lamp with a table: function returning the luminance relative to its largest
            self.grid_pattern = None
            self.m_flags = mi.EmitterFlags.Surface
            self.m_needs_sample_3 = True

        def follow_grid(self, placed: PlacedLamp) -> None:
            if dr.is_jit_v(mi.Float):
                grids = DeviceGrids([placed])
                number = dr.opaque(mi.UInt32, 0)
                self.grid_pattern = lambda d, active: grids.pattern(
                    number, d, self.axis, mi.Float(0), mi.Bool(active)
                )
            else:
                highest = max(placed.grid.value.max(), 1e-300)  # 0 for a lamp that is off
                self.grid_pattern = lambda d, _: float(placed.grid.at(np.array(d)) / highest)

        def traverse(self, callback: Any) -> None:
            callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def light(self, si: Any, outwards: Any, normal: Any, active: Any) -> Any:
            pattern = 1.0
            if self.grid_pattern is not None:
                pattern = (self.grid_pattern(outwards, active) + self.floor) / (1 + self.floor)
            elif not self.lambertian:
                t = dr.clip(
                    (dr.dot(outwards, self.axis) - self.cos_outer)
                    / dr.maximum(self.cos_inner - self.cos_outer, 1e-6),
                    0,
                    1,
                )
                pattern = (t * t * (3 - 2 * t) + self.floor) / (1 + self.floor)
            return dr.select(
                mi.Bool(active) & (dr.dot(outwards, normal) > 0),
                self.radiance.eval(si, active) * pattern,
                0.0,
            )

        def eval(self, si: Any, active: Any = True) -> Any:
            if not self.on:
                return mi.Spectrum(0)
            outwards = si.to_world(si.wi)
            start = si.p + outwards * dr.select(dr.isfinite(si.t), si.t, 0)
            # camera rays start on the near plane; in float32 the start of a ray is computed with an
            # error of about 1e-6 of its length
            far = dr.norm(start - self.hidden_from) > 3 * NEAR_CLIP_M + 1e-5 * dr.select(
                dr.isfinite(si.t), si.t, 0
            )
            return self.light(si, outwards, si.n, mi.Bool(active) & far)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
            if self.mirrored_only:
                nothing = mi.DirectionSample3f()
                nothing.pdf = 0.0
                return nothing, mi.Spectrum(0)
            ds = self.get_shape().sample_direction(it, sample, active)
            active = mi.Bool(active) & (ds.pdf > 0)
            ds.emitter = mi.EmitterPtr(self) if dr.is_jit_v(mi.Float) else self
            value = self.light(_at(it, ds), -ds.d, ds.n, active)
            return ds, value / dr.select(active, ds.pdf, 1.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            if self.mirrored_only:
                # a large density gives rays from surfaces, which spots light, no weight; rays from
                # mirrors do not use the density
                return 1e18
            return dr.select(
                dr.dot(ds.d, ds.n) < 0, self.get_shape().pdf_direction(it, ds, active), 0.0
            )

        def eval_direction(self, it: Any, ds: Any, active: bool = True) -> Any:
            return self.light(_at(it, ds), -ds.d, ds.n, active)

        def sample_wavelengths(self, si: Any, sample: Any, active: bool = True) -> Any:
            return self.radiance.sample_spectrum(si, mi.math.sample_shifted(sample), active)

        def bbox(self) -> Any:
            return self.get_shape().bbox()

        def to_string(self) -> str:
            return "BeamLamp[]"

    return BeamLamp


def _at(it: Any, ds: Any) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = ds.p
    si.n = ds.n
    si.uv = ds.uv
    si.wavelengths = it.wavelengths
    return si
