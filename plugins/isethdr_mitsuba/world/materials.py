"""Materials as Mitsuba surfaces.

Every kind is linear in its reflectance R: value = a + b R. So one evaluation with R = 0 and R = 1
side by side gives all bands, and materials that differ in colour only share one surface
(`ramp_surfaces`). Mitsuba's own integrators get the reflectance itself (`coloured_surfaces`), as
evenly spaced tables, which are looked up without a search.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from isethdr_core.scene import Material, Spectrum

STEP_NM = 5.0  # spacing of the reflectance tables, nm
RAMP_NM = (400.0, 500.0)  # where the reflectance of a ramp surface is 0 and 1
RAMP = Spectrum(RAMP_NM, (0.0, 1.0))


def ramp_surfaces(description) -> dict:
    """Return a BSDF per material whose reflectance is 0 at RAMP_NM[0] and 1 at RAMP_NM[1]; equal
    ones are shared, between scenes too.
    """
    import mitsuba as mi

    made = {}
    for name, m in description.materials.items():
        told = {"roughness": m.roughness} if m.kind in ("plastic", "conductor") else {}
        told |= {"index": m.index} if m.kind in ("plastic", "thin_glass") else {}
        made[name] = _ramp_surface(mi.variant(), m.kind, **told)
    return made


@lru_cache(maxsize=256)
def _ramp_surface(variant, kind, **told):
    """Return the BSDF of ramp reflectance. Kept: Mitsuba works out tables of each rough plastic,
    0.05 CPU s. `variant` is whose types it is of.
    """
    import mitsuba as mi

    return mi.load_dict(surface(Material(kind, kind, RAMP, **told), *RAMP_NM))


def coloured_surfaces(description, first_nm: float, last_nm: float) -> dict:
    """Return a BSDF per material with its own reflectance between the two wavelengths."""
    import mitsuba as mi

    return {
        name: mi.load_dict(surface(m, first_nm, last_nm))
        for name, m in description.materials.items()
    }


def regular(spectrum, first_nm: float, last_nm: float, limit: float = np.inf) -> dict:
    """Return `spectrum` as an evenly spaced Mitsuba table that covers first_nm to last_nm."""
    # one step more on both ends: beyond its ends a regular table is 0, and bands are jittered by
    # half their width
    count = int(np.ceil((last_nm - first_nm) / STEP_NM)) + 3
    nm = first_nm - STEP_NM + STEP_NM * np.arange(count)
    value = np.clip(spectrum.at(nm), 0, limit)
    if not value.any():
        return {"type": "uniform", "value": 0.0}  # Mitsuba rejects a table of zeros
    if np.ptp(value) == 0:
        return {"type": "uniform", "value": float(value[0])}
    return {
        "type": "regular",
        "wavelength_min": float(nm[0]),
        "wavelength_max": float(nm[-1]),
        "values": ", ".join(f"{v:.9g}" for v in value),
    }


def surface(material, first_nm: float, last_nm: float) -> dict:
    """Return the Mitsuba dictionary of `material` for wavelengths first_nm to last_nm.

    Opaque kinds reflect on both sides, so that the winding of a mesh does not matter; glass passes
    light both ways.
    """
    table = regular(material.reflectance, first_nm, last_nm, limit=1.0)
    rough = material.roughness > 0
    microfacets = (
        {"alpha": float(max(material.roughness, 1e-3)), "distribution": "beckmann"} if rough else {}
    )
    if material.kind == "thin_glass":
        return {
            "type": "thindielectric",
            "int_ior": float(material.index),
            "ext_ior": 1.0,
            "specular_transmittance": table,
        }
    if material.kind == "diffuse":
        inner = {"type": "diffuse", "reflectance": table}
    elif material.kind == "plastic":
        inner = {
            "type": "roughplastic" if rough else "plastic",
            "diffuse_reflectance": table,
            "int_ior": float(material.index),
            "ext_ior": 1.0,
            **microfacets,
        }
    else:
        # 'none' is a perfect mirror, so the reflectance is all there is; its rise towards grazing
        # angles is left out
        inner = {
            "type": "roughconductor" if rough else "conductor",
            "material": "none",
            "specular_reflectance": table,
            **microfacets,
        }
    return {"type": "twosided", "side": inner}
