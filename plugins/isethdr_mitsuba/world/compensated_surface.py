"""Rough surfaces that lose no light between facets: a Mitsuba surface and a lobe for the missing
light.

Mitsuba's rough surfaces follow light to one facet only. Let A(c) be the share of light from the
cosine c that the surface reflects if nothing is absorbed, and B the cosine-weighted mean of 1 - A
over the hemisphere. The lobe (1 - A(c_i)) (1 - A(c_o)) / (pi B), times the reflectance, returns
exactly the missing light at every angle (Kelemen and Szirmay-Kalos 2001; Kulla and Conty 2017,
slides 14 to 16). It is reciprocal. The reflectance of a metal is thus that of the rough surface as
a whole, all facets included; reflections between facets do not make its colour more saturated.

A is measured on the surface itself, by sampling it at fixed points.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

PLUGIN = "isethdr_compensated_surface"
# Number of nodes of the table. They are even in the square root of the cosine, because the loss
# changes quickly at grazing angles.
NODES = 33
GRAZING = 1e-3  # cosine of the first node; at 0 there is no light
SIDE = 64  # number of sample points along each side of the grid with which a node is measured


def register() -> None:
    """Register the plugin with the current variant of Mitsuba."""
    mi.register_bsdf(PLUGIN, lambda properties: _compensated_class()(properties))


def compensated_surface(inner: dict, reflectance: dict, missing: np.ndarray) -> dict:
    """Return the Mitsuba dictionary of a rough surface with the lobe for its missing light.

    Parameters
    ----------
    inner : dictionary of the rough surface, linear in `reflectance`.
    reflectance : dictionary of a spectrum.
    missing : (node,) share of light that a white surface loses (`missing_light`).
    """
    register()
    text = ",".join(f"{v:.9g}" for v in missing)
    return {"type": PLUGIN, "inner": inner, "reflectance": reflectance, "missing": text}


def missing_light(white: dict) -> np.ndarray:
    """Return the share of light (node,), 0 to 1, that the surface of the dictionary `white` loses.
    The cosines of the nodes are even in their square root.

    Each node is the mean over a grid of sample points. A third coordinate, which chooses the lobe,
    is spread evenly.
    """
    bsdf = mi.load_dict(white)
    cosine = np.maximum(np.linspace(0, 1, NODES) ** 2, GRAZING)
    count = SIDE**2
    k = np.arange(count)
    points = ((k % SIDE + 0.5) / SIDE, (k // SIDE + 0.5) / SIDE, (k * 0.6180339887498949) % 1)
    x, y, pick = (mi.Float(np.tile(p, NODES).astype(np.float32)) for p in points)
    up = np.repeat(cosine, count)
    si = dr.zeros(mi.SurfaceInteraction3f, NODES * count)
    si.wi = mi.Vector3f(
        mi.Float(np.sqrt(1 - up**2).astype(np.float32)), 0.0, mi.Float(up.astype(np.float32))
    )
    _, weight = bsdf.sample(mi.BSDFContext(), si, pick, mi.Point2f(x, y))
    albedo = np.array(weight[0]).reshape(NODES, count).mean(1, dtype=float)
    return np.clip(1 - albedo, 0, 1)


def mean_over_hemisphere(missing: np.ndarray) -> float:
    """Return the cosine-weighted mean of a table that is linear in the square root of the cosine.

    The integral of 2 c m dc equals that of 4 x^3 m dx, with c = x^2. The integrand is a polynomial
    of the fourth degree on each interval. Simpson's rule would have an error of order h^5 there;
    four Gauss points are exact.
    """
    nodes = np.linspace(0, 1, len(missing))
    node, weight = np.polynomial.legendre.leggauss(4)
    half = 0.5 / (len(missing) - 1)
    x = (nodes[:-1] + half)[:, None] + half * node
    return float((4 * x**3 * np.interp(x, nodes, missing) * weight * half).sum())


def _compensated_class() -> type:
    class CompensatedSurface(mi.BSDF):
        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.reflectance = properties.get_texture("reflectance", 1.0)
            self.inner = properties["inner"]
            missing = np.array([float(v) for v in properties["missing"].split(",")])
            mean = max(mean_over_hemisphere(missing), 1e-9)
            # data, not literals, so that all surfaces of a kind share one kernel
            self.missing = mi.Float(missing.astype(np.float32))
            self.level = dr.opaque(mi.Float, 1 / (np.pi * mean))
            self.lobe = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide
            components = [self.inner.flags(k) for k in range(self.inner.component_count())]
            self.m_components = [*components, self.lobe]
            self.m_flags = self.inner.flags() | self.lobe

        def traverse(self, callback: Any) -> None:
            callback.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)
            callback.put("inner", self.inner, mi.ParamFlags.Differentiable)

        def missing_at(self, cosine: Any, active: Any) -> Any:
            along = dr.sqrt(dr.clip(cosine, 0, 1)) * (NODES - 1)
            first = dr.minimum(mi.UInt32(along), NODES - 2)
            ends = [dr.gather(mi.Float, self.missing, first + k, active) for k in (0, 1)]
            return dr.lerp(*ends, along - mi.Float(first))

        def with_lobe(
            self, si: Any, wo: Any, inner: tuple[Any, Any], active: Any
        ) -> tuple[Any, Any]:
            """Return value and density of rough surface and lobe together, from those of the rough
            surface, `inner`.
            """
            value, density = inner
            cos_i = mi.Frame3f.cos_theta(si.wi)
            cos_o = mi.Frame3f.cos_theta(wo)
            active = mi.Bool(active) & (cos_i > 0) & (cos_o > 0)
            chance = self.missing_at(cos_i, active)
            lobe = chance * self.missing_at(cos_o, active) * self.level * cos_o
            value = value + self.reflectance.eval(si, active) * dr.select(active, lobe, 0)
            density = dr.lerp(density, cos_o * dr.inv_pi, chance)
            return dr.select(active, value, 0), dr.select(active, density, 0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            return self.with_lobe(si, wo, self.inner.eval_pdf(ctx, si, wo, active), active)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def sample(
            self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
        ) -> tuple[Any, Any]:
            cos_i = mi.Frame3f.cos_theta(si.wi)
            active = mi.Bool(active) & (cos_i > 0)
            chance = self.missing_at(cos_i, active)
            diffuse = sample1 < chance
            again = dr.select(
                diffuse, 0, (sample1 - chance) / dr.maximum(1 - chance, dr.epsilon(mi.Float))
            )
            drawn, _ = self.inner.sample(ctx, si, again, sample2, active)
            wo = dr.select(diffuse, mi.warp.square_to_cosine_hemisphere(sample2), drawn.wo)
            value, density = self.eval_pdf(ctx, si, wo, active)
            drawn.wo = wo
            drawn.eta = 1.0
            drawn.pdf = density
            drawn.sampled_type = dr.select(
                diffuse, mi.UInt32(+mi.BSDFFlags.DiffuseReflection), drawn.sampled_type
            )
            return drawn, dr.select(density > 0, value / density, 0)

        def to_string(self) -> str:
            return f"CompensatedSurface[{self.inner}]"

    return CompensatedSurface
