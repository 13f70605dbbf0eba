"""Fit the lobes of road surfaces to r-tables, and print plugins/isethdr_scenes/road_surfaces.csv.

    python scripts/fit_road_surfaces.py FOLDER

FOLDER holds the r-tables R1.txt ... C2W4.txt: 29 rows of 20 numbers, 10^4 r. Lines that begin with
# are ignored. The tables of the CIE are not part of this project. It takes about 30 CPU s.

The fit minimises squared errors of r, with the weights of Q0 for cells, and with additional terms
for Q0, S1, S2 and R_L. R_L of asphalt is an assumed value, not a measurement: see `WANTED_R_L`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from isethdr_scenes.road_photometry import Q0_WEIGHTS, figures, r_table, retro_luminance
from isethdr_scenes.road_surfaces import FIELDS
from scipy.optimize import least_squares

# assumed R_L, mcd m-2 lx-1; 5 to 20 is stated for dry asphalt, about 1 for wet asphalt
WANTED_R_L = {
    "r1": 12.0,
    "r2": 10.0,
    "r3": 9.0,
    "r4": 7.0,
    "c1": 12.0,
    "c2": 9.0,
    "damp": 6.0,
    "w1": 4.0,
    "w2": 2.5,
    "c2w3": 1.5,
    "c2w4": 1.0,
}
# share of C2W3 in a mixture with C2 that replaces tables that were not found. With these shares W1
# and W2 have the published Q0 of their class, and nearly its S1; damp is half-way from C2 to W1
MIXTURES = {"damp": 0.16, "w1": 0.32, "w2": 0.60}
LOW = [0.02, 0.01, 0, 0, 0, 0.08, 1.25, 0.05, 1.25]
HIGH = [0.95, 0.80, 1, 1, 1, 1, 2.5, 1, 2.5]
MOST_GLOSS_DRY = 0.7
STARTS = (
    (0.6, 0.3, 0.6, 0.9, 0.3, 0.5, 1.5, 0.25, 1.5),
    (0.4, 0.3, 0.9, 0.9, 0.1, 0.6, 1.5, 0.15, 1.5),
)


def fresnel(cosine: np.ndarray, index: float) -> np.ndarray:
    """Return the reflectance of a dielectric for unpolarised light."""
    inside = np.sqrt(1 - (1 - cosine**2) / index**2)
    across = (cosine - index * inside) / (cosine + index * inside)
    along = (index * cosine - inside) / (index * cosine + inside)
    return 0.5 * (across**2 + along**2)


def facets(
    light: np.ndarray, observer: np.ndarray, kind: str, alpha: float, index: float
) -> np.ndarray:
    """Return the BSDF of microfacets (Walter et al. 2007, equations 20 and 25 to 34)."""
    half = light + observer
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    up = half[..., 2]
    cosine = (half * light).sum(-1)
    if kind == "ggx":
        density = alpha**2 / (np.pi * (up**2 * (alpha**2 - 1) + 1) ** 2)
        shadow = lambda z: 2 / (1 + np.sqrt(1 + alpha**2 * (1 / z**2 - 1)))
    else:
        density = np.exp(-(1 / up**2 - 1) / alpha**2) / (np.pi * alpha**2 * up**4)

        def shadow(z: np.ndarray) -> np.ndarray:
            a = 1 / np.maximum(alpha * np.sqrt(np.maximum(1 / z**2 - 1, 0)), 1e-9)
            rational = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
            return np.where(a >= 1.6, 1, rational)

    ci = light[..., 2]
    co = observer[..., 2]
    return density * shadow(ci) * shadow(co) * fresnel(cosine, index) / (4 * ci * co)


def grains(
    light: np.ndarray, observer: np.ndarray, roughness: float, flatness: float
) -> np.ndarray:
    """Return the diffuse BSDF of Mitsuba's `principled` with base colour 1 (Burley 2012, 2015)."""
    ci = light[..., 2]
    co = observer[..., 2]
    half = light + observer
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    fi = (1 - ci) ** 5
    fo = (1 - co) ** 5
    rr = 2 * roughness * (half * light).sum(-1) ** 2
    diffuse = (1 - 0.5 * fi) * (1 - 0.5 * fo) + rr * (fo + fi + fo * fi * (rr - 1))
    ends = (1 + (rr / 2 - 1) * fi) * (1 + (rr / 2 - 1) * fo)
    flat = 1.25 * (ends * (1 / (ci + co) - 0.5) + 0.5)
    return ((1 - flatness) * diffuse + flatness * flat) / np.pi


def model(x: np.ndarray, kind: str) -> Callable[..., Any]:
    """Return the BSDF of a road surface.

    Parameters
    ----------
    x : the nine fitted numbers.
    kind : distribution of the narrow facets: "ggx" or "beckmann".
    """
    gloss, reflectance, roughness, flatness, narrow, alpha, index, alpha2, index2 = x

    def bsdf(light: np.ndarray, observer: np.ndarray) -> np.ndarray:
        wide = facets(light, observer, "ggx", alpha, index)
        second = facets(light, observer, kind, alpha2, index2)
        mirrored = (1 - narrow) * wide + narrow * second
        matt = reflectance * grains(light, observer, roughness, flatness)
        return gloss * mirrored + (1 - gloss) * matt

    return bsdf


def fit(name: str, table: Any, kind: str) -> np.ndarray:
    """Return the best fit of all start values."""
    known = table > 0
    weight = np.sqrt(Q0_WEIGHTS / Q0_WEIGHTS.max())
    high = [HIGH[0] if "w" in name else MOST_GLOSS_DRY, *HIGH[1:]]

    def residuals(x: np.ndarray) -> np.ndarray:
        bsdf = model(x, kind)
        model_table = r_table(bsdf) * known
        heavy = 2 * weight * (model_table - table) / (0.03 * table.max() + 0.15 * table)
        light = 0.3 * (model_table - table) / (0.02 * table.max() + 0.3 * table)
        merits = 40 * (np.array(figures(model_table)) / figures(table) - 1)
        retro = 5 * np.log(retro_luminance(bsdf) / WANTED_R_L[name])
        return np.r_[heavy[known], light[known], merits, retro]

    starts = [np.clip(s, np.add(LOW, 1e-3), np.subtract(high, 1e-3)) for s in STARTS]
    runs = [least_squares(residuals, s, bounds=(LOW, high), max_nfev=400) for s in starts]
    return min(runs, key=lambda run: run.cost)


def main(folder: Path) -> None:
    """Print one line for each surface."""

    def read(name: str) -> np.ndarray:
        return np.loadtxt(folder / f"{name.upper()}.txt")

    print(",".join(FIELDS))
    for name in WANTED_R_L:
        share = MIXTURES.get(name)
        table = read(name) if share is None else (1 - share) * read("c2") + share * read("c2w3")
        fits = [(kind, fit(name, table, kind)) for kind in ("ggx", "beckmann")]
        kind, best = min(fits, key=lambda pair: pair[1].cost)
        q0, s1, s2 = figures(table)
        numbers = [f"{v:.5g}" for v in (*best.x, q0, s1, s2, retro_luminance(model(best.x, kind)))]
        print(",".join([name, kind, *numbers]), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
