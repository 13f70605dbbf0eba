"""Materials as Mitsuba surfaces.

Every kind of surface is linear in its reflectance R: value = a + b R. One evaluation with R = 0 and
R = 1 side by side therefore gives all bands, and materials that differ only in colour share one
surface (`ramp_surfaces`). Mitsuba's own integrators get the reflectance itself
(`coloured_surfaces`), as evenly spaced tables, which need no search.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.scene import Facets, Granular, Material, Spectrum, flat

from .coat_energy import coat_energy

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import SceneDescription

KINDS = ("diffuse", "plastic", "conductor", "thin_glass", "granular")  # kinds of `Material`
STEP_NM = 5.0  # spacing of the reflectance tables, nm
RAMP_NM = (400.0, 500.0)  # wavelengths at which the reflectance of a ramp surface is 0 and 1
RAMP = Spectrum(RAMP_NM, (0.0, 1.0))
# surface of a marking without beads, grains alone: R_L is about 125 mcd m-2 lx-1 at a reflectance
# of 1
WORN_MARKING = Granular(
    gloss=0.0, roughness=1.0, flatness=1.0, wide=Facets(0.4, 1.5), narrow=Facets(0.4, 1.5)
)


def ramp_surfaces(description: SceneDescription) -> dict:
    """Return a BSDF per material, with reflectance 0 at RAMP_NM[0] and 1 at RAMP_NM[1]. Equal
    surfaces are shared, also between scenes.

    Raises
    ------
    ConfigError : a material has an unknown kind, or impossible retro-reflection or texture.
    """
    import mitsuba as mi

    surfaces = {}
    for name, m in description.materials.items():
        _check(name, m)
        roughness = {"roughness": m.roughness} if m.kind in ("plastic", "conductor") else {}
        roughness |= {"index": m.index} if m.kind in ("plastic", "thin_glass") else {}
        roughness |= {"granular": m.granular} if m.kind == "granular" else {}
        roughness |= {"retro": m.retro} if m.retro else {}
        surfaces[name] = _ramp_surface(mi.variant(), m.kind, **roughness)
    return surfaces


def _check(name: str, material: Material) -> None:
    """Raise ConfigError if a material has an unknown kind, or impossible retro-reflection or
    texture.
    """
    kind = material.kind
    if kind not in KINDS:
        raise ConfigError(
            f"material {name!r} has the unknown kind {kind!r}{did_you_mean(kind, KINDS)}"
        )
    retro = material.retro
    if retro is not None and not (0 < retro.share <= 1 and retro.falloff > 1 and retro.width > 0):
        raise ConfigError(
            f"material {name!r} has retro-reflection with share {retro.share:g}, falloff"
            f" {retro.falloff:g}, width {retro.width:g}; expected a share above 0 and at most 1, a"
            " falloff above 1 and a width above 0; None stands for no retro-reflection"
        )
    texture = material.texture
    if texture is not None and not (texture.patch_m > 0 and texture.grain_m > 0):
        raise ConfigError(
            f"material {name!r} has a texture with patch_m {texture.patch_m:g} and grain_m"
            f" {texture.grain_m:g}; expected sizes above 0 m; patches=0 or grain=0 switches one off"
        )


@lru_cache(maxsize=256)
def _ramp_surface(variant: str, kind: str, **roughness: Any) -> Any:
    """Return the BSDF with ramp reflectance. It is cached, because Mitsuba computes tables for each
    rough plastic (0.05 CPU s). `variant` is part of the key of the cache, because the types of a
    BSDF belong to one Mitsuba variant.
    """
    import mitsuba as mi

    return mi.load_dict(surface(Material(kind, kind, RAMP, **roughness), *RAMP_NM))


def coloured_surfaces(description: SceneDescription, first_nm: float, last_nm: float) -> dict:
    """Return a BSDF per material with its own reflectance between the two wavelengths.

    Parameters
    ----------
    description : scene with its materials.
    first_nm : shortest wavelength of the reflectances, nm.
    last_nm : longest wavelength of the reflectances, nm.
    """
    import mitsuba as mi

    return {
        name: mi.load_dict(surface(m, first_nm, last_nm))
        for name, m in description.materials.items()
    }


def regular(spectrum: Spectrum, first_nm: float, last_nm: float, limit: float = np.inf) -> dict:
    """Return `spectrum` as an evenly spaced Mitsuba table that covers first_nm to last_nm.

    Parameters
    ----------
    spectrum : values over wavelength.
    first_nm : shortest wavelength that the table covers, nm.
    last_nm : longest wavelength that the table covers, nm.
    limit : largest value of the table; negative values become 0.
    """
    # one more step at both ends, because a regular table is 0 beyond its ends, and wavelengths are
    # jittered within bands
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


def surface(material: Material, first_nm: float, last_nm: float) -> dict:
    """Return the Mitsuba dictionary of `material` for wavelengths first_nm to last_nm.

    Opaque kinds reflect on both sides, so that the winding of a mesh does not matter. Glass
    transmits light in both directions.

    Parameters
    ----------
    material : kind, reflectance and roughness of the surface.
    first_nm : shortest wavelength of the reflectance, nm.
    last_nm : longest wavelength of the reflectance, nm.
    """
    table = regular(material.mean_reflectance(), first_nm, last_nm, limit=1.0)
    if material.kind == "thin_glass":
        return {
            "type": "thindielectric",
            "int_ior": float(material.index),
            "ext_ior": 1.0,
            "specular_transmittance": table,
        }
    inner = _opaque(material, table)
    if material.retro is not None:
        inner = _with_retro_reflection(material, inner, table)
    return {"type": "twosided", "side": inner}


def _opaque(material: Material, table: dict) -> dict:
    """Return the Mitsuba dictionary of an opaque `material` with the reflectance `table`."""
    if material.kind == "diffuse":
        return {"type": "diffuse", "reflectance": table}
    if material.kind == "granular":
        return _granular(_granular_of(material), table)
    rough = material.roughness > 0
    if rough and not _own_surfaces().variant().startswith("scalar"):
        return _compensated(material, table)
    if material.kind == "plastic":
        base = coat_energy("plastic", material.roughness, material.index).base
        table = times(table, base)
    return _single_facets(material, table)


def _compensated(material: Material, table: dict) -> dict:
    """Return a rough surface with the lobe for the light that it loses between facets.

    Not for scalar variants, where each path would call Python; there the base of a coat is
    brightened instead.
    """
    own = _own_surfaces()
    missing = _missing(own.variant(), material.kind, material.roughness, material.index)
    return own.compensated_surface(_single_facets(material, table), table, missing)


@lru_cache(maxsize=256)
def _missing(variant: str, kind: str, roughness: float, index: float) -> np.ndarray:
    """Return the share of light (node,) that a white surface loses, measured in the current Mitsuba
    variant, `variant`.
    """
    white = Material(kind, kind, flat(1.0), roughness, index)
    reflectance = {"type": "uniform", "value": 1.0}
    return _own_surfaces().missing_light(_single_facets(white, reflectance))


def _own_surfaces() -> ModuleType:
    """Return the module of the surfaces written in Python; importing it imports Mitsuba."""
    from . import own_surfaces

    return own_surfaces


def _single_facets(material: Material, table: dict) -> dict:
    """Return Mitsuba's own coated or metallic surface, which follows light to one facet only."""
    rough = material.roughness > 0
    microfacets = (
        {"alpha": float(max(material.roughness, 1e-3)), "distribution": "beckmann"} if rough else {}
    )
    if material.kind == "plastic":
        return {
            "type": "roughplastic" if rough else "plastic",
            "diffuse_reflectance": table,
            "int_ior": float(material.index),
            "ext_ior": 1.0,
            **microfacets,
        }
    # 'none' is a perfect mirror, so the reflectance alone counts; its rise towards grazing angles
    # is left out
    return {
        "type": "roughconductor" if rough else "conductor",
        "material": "none",
        "specular_reflectance": table,
        **microfacets,
    }


def times(table: dict, factor: float) -> dict:
    """Return a table of `regular` with all values multiplied by `factor`."""
    if table["type"] == "uniform":
        return {"type": "uniform", "value": factor * table["value"]}
    values = [factor * float(v) for v in table["values"].split(",")]
    return {**table, "values": ", ".join(f"{v:.9g}" for v in values)}


def _granular_of(material: Material) -> Granular:
    if material.granular is None:
        raise ConfigError(
            f"material {material.name!r} is of kind granular without lobes; expected them; type"
            " Material(..., granular=isethdr_core.scene.Granular(...))"
        )
    return material.granular


def _granular(surface: Granular, table: dict) -> dict:
    """Return the Mitsuba dictionary of grains and facets, mixed by their shares."""
    grains = {
        "type": "principled",
        "base_color": table,
        "roughness": float(surface.roughness),
        "flatness": float(surface.flatness),
        "specular": 0.0,
        # otherwise Mitsuba draws directions for a gloss of strength 0, and the density does not
        # match the samples
        "main_specular_sampling_rate": 0.0,
    }
    facets = {
        "type": "blendbsdf",
        "weight": float(surface.narrow_share),
        "bsdf_0": _facets(surface.wide),
        "bsdf_1": _facets(surface.narrow),
    }
    return {
        "type": "blendbsdf",
        "weight": float(surface.gloss),
        "bsdf_0": grains,
        "bsdf_1": facets,
    }


def _facets(facets: Facets) -> dict:
    """Return microfacets of a dielectric as the dictionary of a conductor that has the same index
    and does not absorb.
    """
    return {
        "type": "roughconductor",
        "distribution": facets.distribution,
        "alpha": float(facets.roughness),
        "eta": float(facets.index),
        "k": 0.0,
    }


def _with_retro_reflection(material: Material, base: dict, table: dict) -> dict:
    """Return `base` on its share of the surface, and retro-reflection on the rest.

    In a scalar variant, beads on a whole road cost fourteen times as much as everything else,
    because each path calls Python. There a marking consists of grains alone, which return as much
    light as a worn marking.
    """
    own = _own_surfaces()
    retro = material.retro
    if retro.form == "beads" and own.variant().startswith("scalar"):
        return _granular(WORN_MARKING, table)
    strong = replace(retro, peak=retro.peak / retro.share)
    return {
        "type": "blendbsdf",
        "weight": float(retro.share),
        "bsdf_0": base,
        "bsdf_1": own.retro_surface(strong, table),
    }
