"""Textures: dirt, wear and grain of every surface of a street.

Every texture is a model: a surface varies between two spectra, whose mean is the spectrum of the
material. Patches and grain have sizes in the world, so that two plants, posts or stretches of a
road differ. `PLAIN` names the materials without a texture, and why.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from isethdr_core.scene import Material, Spectrum, Texture

from .coloured import PREFIX, finish_of
from .living_spectra import LIVING


@dataclass(frozen=True)
class Look:
    """Difference of both spectra from their mean, and sizes of patches and grain."""

    contrast: float  # relative difference of both spectra from the mean at 550 nm
    tilt: float = 0.0  # increase of this difference per 100 nm
    patch_m: float = 1.0
    grain_m: float = 0.02
    grain: float = 0.3  # share of the grain in the variation; patches have the rest


LOOKS = {
    "asphalt": Look(0.15, 0.01, patch_m=2.5, grain_m=0.02, grain=0.4),
    "road_paint": Look(0.15, 0.02, patch_m=0.7, grain_m=0.03),
    "road_paint_yellow": Look(0.15, 0.02, patch_m=0.7, grain_m=0.03),
    "gravel": Look(0.25, 0.03, patch_m=1.5, grain_m=0.04, grain=0.5),
    "meadow": Look(0.35, 0.12, patch_m=3.0, grain_m=0.10),
    "grass": Look(0.30, 0.12, patch_m=2.0, grain_m=0.15),
    "grass_dry": Look(0.25, 0.05, patch_m=2.0, grain_m=0.15),
    "leaf": Look(0.30, 0.10, patch_m=5.0, grain_m=0.25),
    "leaf_light": Look(0.30, 0.10, patch_m=4.0, grain_m=0.25),
    "needle": Look(0.30, 0.08, patch_m=6.0, grain_m=0.25),
    "bark": Look(0.35, 0.03, patch_m=0.5, grain_m=0.04, grain=0.5),
    "bark_pale": Look(0.35, 0.03, patch_m=0.5, grain_m=0.04, grain=0.5),
    "concrete": Look(0.20, 0.02, patch_m=1.5, grain_m=0.03),
    "tunnel_lining": Look(0.25, 0.02, patch_m=2.0, grain_m=0.05),
    "tunnel_tile": Look(0.10, 0.01, patch_m=1.0, grain_m=0.30),
    "wall": Look(0.12, 0.02, patch_m=1.5, grain_m=0.03),
    "roof_tile": Look(0.25, 0.05, patch_m=0.8, grain_m=0.25, grain=0.5),
    "wall_white": Look(0.10, 0.02, patch_m=1.5, grain_m=0.03),
    "wall_yellow": Look(0.12, 0.02, patch_m=1.5, grain_m=0.03),
    "wall_grey": Look(0.14, 0.02, patch_m=1.8, grain_m=0.03),
    "wall_brick": Look(0.30, 0.05, patch_m=1.2, grain_m=0.10, grain=0.6),
    "wall_pink": Look(0.12, 0.02, patch_m=1.5, grain_m=0.03),
    "roof_slate": Look(0.25, 0.02, patch_m=0.8, grain_m=0.25, grain=0.5),
    "wood": Look(0.25, 0.04, patch_m=0.3, grain_m=0.02),
    "galvanised": Look(0.15, 0.01, patch_m=0.4, grain_m=0.05),
    "fur": Look(0.20, 0.03, patch_m=0.25, grain_m=0.03),
    "fur_dark": Look(0.20, 0.03, patch_m=0.25, grain_m=0.03),
    "fur_pale": Look(0.20, 0.03, patch_m=0.25, grain_m=0.03),
    # vehicles: dust, rubbed rubber and plastic, brake dust on wheels, water marks on metal
    "tyre": Look(0.30, 0.05, patch_m=0.20, grain_m=0.015, grain=0.4),
    "plastic_black": Look(0.25, 0.04, patch_m=0.30, grain_m=0.01),
    "gloss_black": Look(0.15, 0.03, patch_m=0.40, grain_m=0.01, grain=0.2),
    "underbody": Look(0.35, 0.06, patch_m=0.40, grain_m=0.03, grain=0.4),
    "interior": Look(0.15, 0.02, patch_m=0.50, grain_m=0.02),
    "seat": Look(0.15, 0.03, patch_m=0.25, grain_m=0.01, grain=0.5),
    "leather": Look(0.20, 0.04, patch_m=0.15, grain_m=0.008, grain=0.4),
    "chrome": Look(0.06, 0.01, patch_m=0.20, grain_m=0.01),
    "alloy": Look(0.10, 0.02, patch_m=0.15, grain_m=0.01),
    "steel": Look(0.15, 0.02, patch_m=0.30, grain_m=0.02),
    "plate_ink": Look(0.20, 0.04, patch_m=0.15, grain_m=0.01),
    # painted metal and plastic beside the road: splashes, scratches, bleached paint
    "metal_green": Look(0.20, 0.03, patch_m=0.40, grain_m=0.02),
    "metal_grey": Look(0.18, 0.02, patch_m=0.40, grain_m=0.02),
    "metal_red": Look(0.20, 0.03, patch_m=0.40, grain_m=0.02),
    "bin_green": Look(0.20, 0.04, patch_m=0.30, grain_m=0.02, grain=0.4),
    "roof_metal": Look(0.18, 0.02, patch_m=0.80, grain_m=0.05),
    "lamp_white": Look(0.10, 0.02, patch_m=0.30, grain_m=0.02),  # marker posts and diffusers
    "gap": Look(0.30, 0.03, patch_m=0.40, grain_m=0.03),  # joints, cracks and dark openings
    # people and animals: creases and weave, strands, blood under the skin
    "denim": Look(0.25, 0.04, patch_m=0.15, grain_m=0.006, grain=0.4),
    "sole": Look(0.25, 0.05, patch_m=0.08, grain_m=0.008, grain=0.4),
    "snout": Look(0.15, 0.04, patch_m=0.05, grain_m=0.006),
    "horn": Look(0.20, 0.04, patch_m=0.08, grain_m=0.01, grain=0.5),
    "antler": Look(0.20, 0.04, patch_m=0.08, grain_m=0.01, grain=0.5),
    # flowers and fruit
    "blossom": Look(0.12, 0.03, patch_m=0.30, grain_m=0.02, grain=0.5),
    "blossom_pink": Look(0.15, 0.05, patch_m=0.30, grain_m=0.02, grain=0.5),
    "flower_yellow": Look(0.15, 0.05, patch_m=0.30, grain_m=0.02, grain=0.5),
    "fruit_red": Look(0.20, 0.06, patch_m=0.20, grain_m=0.02, grain=0.5),
}
# leaves, bark and fur of the families of `things` vary as those above
LOOKS |= {
    name: LOOKS[kind]
    for name in LIVING
    for kind in ("leaf", "needle", "bark", "fur")
    if name.startswith(f"{kind}_")
}
KINDS = {  # looks by the beginning of a material's name
    "cloth_": Look(0.15, 0.03, patch_m=0.12, grain_m=0.006, grain=0.4),
    "hair_": Look(0.25, 0.04, patch_m=0.04, grain_m=0.004, grain=0.5),
    "skin": Look(0.08, 0.06, patch_m=0.05, grain_m=0.005),
}
# looks of the colours of an asset pack by finish; glass stays plain
FINISHES = {
    "matt": Look(0.15, 0.03, patch_m=0.40, grain_m=0.02, grain=0.4),
    "satin": Look(0.15, 0.03, patch_m=0.40, grain_m=0.02),
    "gloss": Look(0.10, 0.02, patch_m=0.60, grain_m=0.02, grain=0.2),
    "metal": Look(0.10, 0.02, patch_m=0.30, grain_m=0.01),
}
PLAIN = {  # why a material has no texture
    "glass": "a pane that light passes",
    "glass_tinted": "a pane that light passes",
    "window_dark": "a pane in front of a dark room",
    "lamp_clear": "cover of a lamp, cleaned by the rules of the road",
    "lamp_dark": "cover of a lamp, cleaned by the rules of the road",
    "lamp_red": "cover of a lamp, cleaned by the rules of the road",
    "lamp_amber": "cover of a lamp, cleaned by the rules of the road",
    "plate_white": "a retro-reflector, whose R_A is that of its class",
    "post_reflector": "a retro-reflector, whose R_A is that of its class",
    "stud_reflector": "a retro-reflector, whose R_I is that of its class",
    "sheeting_white": "a retro-reflector, whose R_A is that of its class",
    "sheeting_red": "a retro-reflector, whose R_A is that of its class",
    "sheeting_yellow": "a retro-reflector, whose R_A is that of its class",
    "sheeting_blue": "a retro-reflector, whose R_A is that of its class",
    "sheeting_green": "a retro-reflector, whose R_A is that of its class",
    "reflective_band": "a retro-reflector, whose R_A is that of its class",
    "reflector_red": "a retro-reflector, whose R_A is that of its class",
    "reflector_amber": "a retro-reflector, whose R_A is that of its class",
    "eye_deer": "a retro-reflector, whose R_A is a model of its own",
}
LOOKS |= {
    name: Look(0.22, 0.03, patch_m=0.5, grain_m=0.03, grain=0.5)
    for name in ("rock", "rock_dark", "rock_warm", "moss")
}
STEP_NM = 20.0


def look_of(name: str) -> Look | None:
    """Return the look of a material by name; None for names in `PLAIN` and for unknown names."""
    if name in LOOKS or name in PLAIN:
        return LOOKS.get(name)
    if name.startswith(PREFIX):
        return FINISHES.get(finish_of(name))
    return next((look for kind, look in KINDS.items() if name.startswith(kind)), None)


def textured(material: Material, seed: int) -> Material:
    """Return `material` with its texture, if it has one; its mean reflectance stays the same."""
    look = look_of(material.name)
    if look is None:
        return material
    own = material.mean_reflectance()
    nm = np.unique(np.r_[own.wavelength_nm, np.arange(380.0, 781.0, STEP_NM)])
    value = own.at(nm)
    change = look.contrast + look.tilt * (nm - 550.0) / 100.0
    # limit the change so that both spectra stay within 0 and 1 and keep their mean
    change = np.clip(change, -0.9, np.minimum(0.9, 1 / np.maximum(value, 1e-9) - 1))
    first, other = (
        Spectrum(tuple(nm.tolist()), tuple((value * (1 + sign * change)).tolist()))
        for sign in (-1, 1)
    )
    name_seed = int(np.frombuffer(material.name.encode().ljust(8, b"_")[:8], np.uint64)[0] % 2**31)
    texture = Texture(
        other,
        seed=(seed + name_seed) % 2**32,
        patch_m=look.patch_m,
        patches=1 - look.grain,
        grain_m=look.grain_m,
        grain=look.grain,
    )
    return replace(material, reflectance=first, texture=texture)
