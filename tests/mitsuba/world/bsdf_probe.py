"""Evaluate, sample and test a Mitsuba BSDF on arrays of directions (z up)."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

NM = 550.0


def vectors(v):
    """Return directions (..., 3) as one Mitsuba vector."""
    return mi.Vector3f(*np.ascontiguousarray(np.reshape(v, (-1, 3)).T.astype(np.float32)))


def seen_from(observer):
    """Return surface interactions seen from directions (..., 3)."""
    wi = vectors(observer)
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wi))
    si.wi = wi
    si.wavelengths = mi.Spectrum(NM)
    return si


def value(bsdf, light, observer):
    """Return the BSDF, 1/sr, at 550 nm for directions to light and observer."""
    light, observer = np.broadcast_arrays(light, observer)
    found = bsdf.eval(mi.BSDFContext(), seen_from(observer), vectors(light))
    return np.array(found)[0].reshape(light.shape[:-1]) / light[..., 2]


def towards(elevation_deg, azimuth_deg=20.0):
    """Return the unit vector at an elevation above the surface."""
    e = np.radians(elevation_deg)
    a = np.radians(azimuth_deg)
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def drawn(bsdf, observer, count, seed=1):
    """Return `count` sampled directions, their weights and their densities, for one observer."""
    rng = mi.PCG32(size=count, initstate=seed)
    point = mi.Point2f(rng.next_float32(), rng.next_float32())
    si = seen_from(np.tile(observer, (count, 1)))
    sample, weight = bsdf.sample(mi.BSDFContext(), si, rng.next_float32(), point)
    return np.array(sample.wo).T.astype(float), np.array(weight)[0], np.array(sample.pdf)


def albedo(bsdf, elevation_deg, count=200_000):
    """Return the share of the light from that elevation that is reflected, by sampling."""
    return float(drawn(bsdf, towards(elevation_deg), count)[1].mean())


def reciprocity(bsdf, count=50_000, seed=0):
    """Return the largest |f(a, b) - f(b, a)| over the mean of both, for random directions.

    Half of all directions are within 5 degrees of the horizon.
    """
    rng = np.random.default_rng(seed)
    grazing = rng.random((count, 2)) < 0.5
    up = np.where(grazing, rng.random((count, 2)) * 0.087, rng.random((count, 2))) + 1e-3
    up = np.minimum(up, 1)
    turn = 2 * np.pi * rng.random((count, 2))
    across = np.sqrt(1 - up**2)
    d = np.stack([across * np.cos(turn), across * np.sin(turn), up], -1)
    a = value(bsdf, d[:, 0], d[:, 1])
    b = value(bsdf, d[:, 1], d[:, 0])
    return float((2 * np.abs(a - b) / np.maximum(a + b, 1e-9)).max())


def samples_agree(bsdf, elevation_deg, count=50_000):
    """Return the largest relative differences between samples and evaluation.

    The first is that of the density, the second that of weight x density.
    """
    observer = towards(elevation_deg)
    wo, weight, density = drawn(bsdf, observer, count, 3)
    on = weight > 0
    si = seen_from(np.tile(observer, (count, 1)))
    value_at, density_at = bsdf.eval_pdf(mi.BSDFContext(), si, vectors(wo))
    again = np.array(density_at)[on]
    light = np.array(value_at)[0][on]
    density_off = np.abs(density[on] / again - 1).max()
    return float(density_off), float(np.abs((weight * density)[on] / light - 1).max())


def chi_square_p(  # noqa: PLR0913 - a helper of tests
    bsdf, observer, edges, samples, seed=5, order=6, sectors=16
):
    """Return the p value of samples against density, in rings and sectors about `observer`.

    A grid over the sphere has cells of a degree, which is too wide for lobes of half a degree.
    `edges` are the borders of the rings in t = 1 - cos(angle from the observer).
    """
    node, weight = np.polynomial.legendre.leggauss(order)
    middle = (edges[1:] + edges[:-1]) / 2
    half = np.diff(edges) / 2
    t = (middle[:, None] + half[:, None] * node).ravel()
    t_weight = np.outer(half, weight).ravel()
    sector = np.linspace(-np.pi, np.pi, sectors + 1)
    psi_half = np.pi / sectors
    psi = ((sector[1:] + sector[:-1])[:, None] / 2 + psi_half * node).ravel()
    frame = mi.Frame3f(mi.Vector3f(*map(float, observer)))
    s, u, n = (np.array(v).ravel() for v in (frame.s, frame.t, frame.n))
    tt, pp = np.meshgrid(t, psi, indexing="ij")
    sine = np.sqrt(tt * (2 - tt))[..., None]
    wo = n * (1 - tt)[..., None] + sine * (np.cos(pp)[..., None] * s + np.sin(pp)[..., None] * u)
    si = seen_from(np.tile(observer, (tt.size, 1)))
    density = np.array(bsdf.pdf(mi.BSDFContext(), si, vectors(wo))).reshape(tt.shape)
    cells = density * t_weight[:, None] * np.tile(psi_half * weight, sectors)
    rings = len(edges) - 1
    expected = cells.reshape(rings, order, sectors, order).sum((1, 3)) * samples
    found_wo, found_weight, _ = drawn(bsdf, observer, samples, seed)
    found_wo = found_wo[found_weight > 0]  # a direction drawn below the surface has weight 0
    t_found = ((found_wo - n) ** 2).sum(-1) / 2
    turn = np.arctan2(found_wo @ u, found_wo @ s)
    found, _, _ = np.histogram2d(t_found, turn, bins=(edges, sector))
    return _p_value(found, expected)


def chi_square_above_p(bsdf, elevation_deg, samples, seed=5, order=8, cells=(24, 32)):
    """Return the p value of samples against density, on a grid over the upper hemisphere.

    Cells end at the horizon, where the density of a surface seen at a grazing angle jumps to 0;
    they are smallest there and about the mirror direction.
    """
    observer = towards(elevation_deg, 0.0)
    up_edges = np.linspace(0, 1, cells[0] + 1) ** 2
    turn_edges = np.pi * np.linspace(-1, 1, cells[1] + 1) ** 3  # 0: away from the observer
    node, weight = np.polynomial.legendre.leggauss(order)

    def points(edges):
        middle = (edges[1:] + edges[:-1]) / 2
        half = np.diff(edges) / 2
        return (middle[:, None] + half[:, None] * node).ravel(), np.outer(half, weight).ravel()

    up, up_weight = points(up_edges)
    turn, turn_weight = points(turn_edges)
    z, a = np.meshgrid(up, turn, indexing="ij")
    across = np.sqrt(1 - z**2)
    wo = np.stack([-across * np.cos(a), -across * np.sin(a), z], -1)
    si = seen_from(np.tile(observer, (z.size, 1)))
    density = np.array(bsdf.pdf(mi.BSDFContext(), si, vectors(wo))).reshape(z.shape)
    whole = density * np.outer(up_weight, turn_weight)
    expected = whole.reshape(cells[0], order, cells[1], order).sum((1, 3)) * samples
    found_wo, found_weight, _ = drawn(bsdf, observer, samples, seed)
    found_wo = found_wo[found_weight > 0]
    around = np.arctan2(-found_wo[:, 1], -found_wo[:, 0])
    found, _, _ = np.histogram2d(found_wo[:, 2], around, bins=(up_edges, turn_edges))
    return _p_value(found, expected)


def _p_value(found, expected):
    from scipy.stats import chi2

    used = expected > 20
    statistic = ((found - expected)[used] ** 2 / expected[used]).sum()
    return float(chi2.sf(statistic, used.sum() - 1))
