"""White-furnace test of coated and metallic surfaces: print `world/coat_energy.csv` of
isethdr_mitsuba.

    python scripts/coat_energy.py

For each roughness and index, the table holds the factor by which the base below a coat must be
brighter so that the surface loses no light at its best angle, and the resulting reflectance at its
worst angle. Angles are from 0 to 85 degrees. It takes about 90 CPU s.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

ANGLES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0)
ROUGHNESS = (0.0, 0.02, 0.05, *np.round(np.arange(0.1, 1.01, 0.1), 2))
INDICES = (1.2, 1.35, 1.5, 1.65, 1.8, 2.0)
SIDE = 256  # side of the square grid of sample points; a third number of a point selects a lobe


def albedo(bsdf: Callable[..., Any], angle_deg: float) -> float:
    """Return the share of light from an angle that is reflected."""
    k = np.arange(SIDE**2)
    points = [(k % SIDE + 0.5) / SIDE, (k // SIDE + 0.5) / SIDE, (k * 0.6180339887498949) % 1]
    x, y, pick = (mi.Float(p.astype(np.float32)) for p in points)
    si = dr.zeros(mi.SurfaceInteraction3f, SIDE**2)
    a = np.radians(angle_deg)
    si.wi = mi.Vector3f(float(np.sin(a)), 0.0, float(np.cos(a)))
    si.wavelengths = mi.Spectrum(550.0)
    _, weight = bsdf.sample(mi.BSDFContext(), si, pick, mi.Point2f(x, y))
    return float(np.array(weight)[0].mean(dtype=float))


def plastic(alpha: float, index: float, reflectance: float) -> Any:
    """Return the coated surface."""
    coat = {"alpha": float(alpha), "distribution": "beckmann"} if alpha else {}
    return mi.load_dict(
        {
            "type": "roughplastic" if alpha else "plastic",
            "diffuse_reflectance": {"type": "uniform", "value": reflectance},
            "int_ior": float(index),
            "ext_ior": 1.0,
            **coat,
        }
    )


def metal(alpha: float) -> Any:
    """Return the metallic surface."""
    shape = {"type": "roughconductor", "alpha": float(alpha), "distribution": "beckmann"}
    return mi.load_dict({**shape, "material": "none"})


def main() -> None:
    """Print a line for each surface."""
    mi.set_variant("llvm_ad_spectral")
    print("kind,roughness,index,base,least")
    for alpha in ROUGHNESS:
        for index in INDICES:
            coat, whole = (
                np.array([albedo(plastic(alpha, index, r), a) for a in ANGLES_DEG])
                for r in (0.0, 1.0)
            )
            base = float(((1 - coat) / (whole - coat)).min())
            least = float((coat + base * (whole - coat)).min())
            print(f"plastic,{alpha:g},{index:g},{base:.4f},{least:.4f}")
        least = min(albedo(metal(alpha), a) for a in ANGLES_DEG) if alpha else 1.0
        print(f"conductor,{alpha:g},1.5,1,{min(least, 1.0):.4f}")


if __name__ == "__main__":
    main()
