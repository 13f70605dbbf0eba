"""Retro-reflection as a Mitsuba surface: one BSDF in Python with exact sampling, in every variant.

The law is that of `isethdr_core.scene.RetroReflection`, which is reciprocal. Directions are drawn
around the incoming one in proportion to p(t) = (1 + t / width)^-falloff, by inversion of its
integral; t = 1 - cos(observation angle).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import RetroReflection

PLUGIN = "isethdr_retro_reflection"
TINY = 1e-12  # smallest cosine, and smallest divisor


def register() -> None:
    """Register the plugin with the current variant of Mitsuba."""
    mi.register_bsdf(PLUGIN, lambda properties: _retro_class()(properties))


def spread(width: float, falloff: float) -> float:
    """Return the integral of p(t) over the sphere of directions, sr.

    Parameters
    ----------
    width, falloff : parameters of p(t), see the module.
    """
    return 2 * np.pi * width / (falloff - 1) * (1 - (1 + 2 / width) ** (1 - falloff))


def retro_surface(retro: RetroReflection, reflectance: dict) -> dict:
    """Return the Mitsuba dictionary of the retro-reflecting part alone, at full strength.

    Parameters
    ----------
    retro : parameters of the retro-reflection.
    reflectance : Mitsuba dictionary of the spectrum by which the returned light is multiplied.
    """
    register()
    return {
        "type": PLUGIN,
        "reflectance": reflectance,
        "peak": float(retro.peak),
        "width": float(retro.width),
        "falloff": float(retro.falloff),
        "entrance": float(retro.entrance),
        "power": float(retro.power),
        "beads": retro.form == "beads",
    }


def _retro_class() -> type:
    class RetroSurface(mi.BSDF):
        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.reflectance = properties.get_texture("reflectance", 1.0)
            self.beads = bool(properties["beads"])
            width = float(properties["width"])
            falloff = float(properties["falloff"])
            self.summary = f"peak={float(properties['peak']):.4g}, width={width:.3g}"
            # data, not literals, so that all retro-reflectors of a form share one kernel
            number = lambda v: dr.opaque(mi.Float, float(v)) if dr.is_jit_v(mi.Float) else float(v)
            self.peak, self.width, self.falloff = map(number, (properties["peak"], width, falloff))
            self.entrance = number(properties["entrance"])
            self.half_power = number(float(properties["power"]) / 2)
            self.spread = number(spread(width, falloff))
            # integral of p(t) up to t = 2, relative to that up to infinity
            self.whole = number(1 - (1 + 2 / width) ** (1 - falloff))
            flag = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
            self.m_components = [flag]
            self.m_flags = flag

        def traverse(self, callback: Any) -> None:
            callback.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)

        def profile(self, wi: Any, wo: Any) -> Any:
            # |wi - wo|^2 / 2 is 1 - cos without cancellation, which matters because 0.2 degrees is
            # only 6e-6
            t = dr.squared_norm(wi - wo) / 2
            return dr.power(1 + t / self.width, -self.falloff)

        def over_profile(self, wi: Any, wo: Any) -> Any:
            """Return f cos_o / (R p), where f is the BSDF, R the reflectance and p the profile."""
            # scalar variants divide Python floats, and division by 0 raises an error
            cos_i = dr.maximum(mi.Frame3f.cos_theta(wi), TINY)
            cos_o = dr.maximum(mi.Frame3f.cos_theta(wo), TINY)
            if self.beads:
                return self.peak * cos_o / (cos_i + cos_o)
            half = wi + wo
            tan2 = (dr.square(half.x) + dr.square(half.y)) / dr.maximum(dr.square(half.z), TINY)
            loss = dr.power(tan2 / dr.square(self.entrance), self.half_power)
            return self.peak / cos_i * dr.exp(-loss)

        def above(self, wi: Any, wo: Any, active: Any) -> Any:
            return mi.Bool(active) & (mi.Frame3f.cos_theta(wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            active = self.above(si.wi, wo, active)
            profile = dr.select(active, self.profile(si.wi, wo), 0)
            level = dr.select(active, profile * self.over_profile(si.wi, wo), 0)
            return self.reflectance.eval(si, active) * level, profile / self.spread

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return dr.select(
                self.above(si.wi, wo, active), self.profile(si.wi, wo) / self.spread, 0
            )

        def sample(
            self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
        ) -> tuple[Any, Any]:
            # inversion: the integral of p(t) is a power of 1 + t / width
            stretch = dr.power(1 - self.whole * sample2.x, 1 / (1 - self.falloff))
            t = dr.clip((stretch - 1) * self.width, 0, 2)
            sine = dr.sqrt(t * (2 - t))
            s, c = dr.sincos(2 * dr.pi * sample2.y)
            wo = mi.Frame3f(si.wi).to_world(mi.Vector3f(sine * c, sine * s, 1 - t))
            active = self.above(si.wi, wo, active)
            drawn = mi.BSDFSample3f()
            drawn.wo = wo
            drawn.eta = 1.0
            drawn.pdf = dr.select(active, self.profile(si.wi, wo) / self.spread, 0)
            drawn.sampled_type = mi.UInt32(+self.m_flags)
            drawn.sampled_component = mi.UInt32(0)
            weight = dr.select(active, self.spread * self.over_profile(si.wi, wo), 0)
            return drawn, self.reflectance.eval(si, active) * weight

        def to_string(self) -> str:
            return f"RetroSurface[{self.summary}, beads={self.beads}]"

    return RetroSurface
