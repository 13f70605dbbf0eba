"""Variation: paints, cloths, skins and furs differ from object to object, and vehicles are dirty.

Each model gets its own copy of a material that varies, with its own level and tilt of the spectrum.
Seed, model and material select both. Dirt is a film of dust in patches, which mixes the spectrum of
dust into that of the paint. The sizes of both effects are a model, not a measurement. Each surface
also varies from place to place, see `textures`. Retro-reflectors, lamps and glass do not vary:
their values are those of their class.
"""

from __future__ import annotations

from dataclasses import replace
from zlib import crc32

import numpy as np

from isethdr_core.scene import Material, Model, Spectrum, Texture

from .textures import textured

LEVEL = 0.12  # standard deviation of the logarithm of the reflectance
TILT = 0.04  # standard deviation of the relative change per 100 nm
BRIGHTEST = 0.92  # no surface of a street reflects more
VARIED = ("paint_", "cloth_", "skin", "hair_", "fur", "denim", "box_white")
DIRTY = ("paint_", "box_white")
# dry soil
DUST_NM = (400.0, 500.0, 600.0, 700.0)
DUST = (0.12, 0.17, 0.22, 0.26)
MOST_DUST = 0.45  # mean share of the paint that dust hides on the dirtiest vehicle
DUST_PATCH_M = 0.8
DUST_GRAIN_M = 0.03
DUST_GRAIN = 0.25
STEP_NM = 20.0
AGAIN = "+"  # between the name of a model and the number of a model with the same materials


def varied(
    models: dict[str, Model], materials: dict[str, Material], seed: int
) -> tuple[dict[str, Model], dict[str, Material]]:
    """Return models and materials with a material `name@model` for each one that varies.

    Parameters
    ----------
    models, materials : models and materials of a scene, by name. Models whose names differ only
        behind `AGAIN` have the same materials.
    seed : seed of the scene.
    """
    out: dict[str, Material] = {}
    changed = {}
    for key, model in models.items():
        looks = key.partition(AGAIN)[0]
        parts = []
        for part in model.parts:
            name = part.material
            if name.startswith(VARIED):
                name = f"{part.material}@{looks}"
                out[name] = _of_model(materials[part.material], looks, seed)
            else:
                out[name] = materials[name]
            parts.append(replace(part, material=name))
        changed[key] = Model(model.name, tuple(parts))
    return changed, out


def _of_model(material: Material, model: str, seed: int) -> Material:
    """Return the copy of a material for one model."""
    rng = np.random.default_rng([seed, crc32(f"{material.name}@{model}".encode())])
    level = np.exp(LEVEL * rng.normal())
    tilt = TILT * rng.normal()
    # a material that already has a texture gets a new one around its new mean
    mean = material.mean_reflectance()
    own = replace(material, reflectance=_changed(mean, level, tilt), texture=None)
    if material.name.startswith(DIRTY):
        own = _dirty(own, MOST_DUST * rng.uniform(), int(rng.integers(2**32)))
    else:
        own = textured(own, seed)
    return replace(own, name=f"{material.name}@{model}")


def _changed(spectrum: Spectrum, level: float, tilt: float) -> Spectrum:
    nm = _nodes(spectrum)
    value = level * spectrum.at(nm) * (1 + tilt * (nm - 550.0) / 100.0)
    return Spectrum(tuple(nm.tolist()), tuple(np.clip(value, 0, BRIGHTEST).tolist()))


def _dirty(material: Material, dust: float, seed: int) -> Material:
    """Return a material under dust, which hides the share `dust` of it on average, and between none
    and twice that share at single places.
    """
    nm = _nodes(material.reflectance)
    clean = material.reflectance.at(nm)
    dirty = clean + 2 * dust * (np.interp(nm, DUST_NM, DUST) - clean)
    other = Spectrum(tuple(nm.tolist()), tuple(dirty.tolist()))
    texture = Texture(other, seed, DUST_PATCH_M, 1 - DUST_GRAIN, DUST_GRAIN_M, DUST_GRAIN)
    return replace(material, texture=texture)


def _nodes(spectrum: Spectrum) -> np.ndarray:
    return np.unique(np.r_[spectrum.wavelength_nm, np.arange(380.0, 781.0, STEP_NM)])
