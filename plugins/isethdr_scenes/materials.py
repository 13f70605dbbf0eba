"""Surface materials: spectral reflectances as (wavelength nm, value) nodes, linearly interpolated.

Every value is a plausible model written down by hand, not a measurement: diffuse reflectances of
paint, cloth, skin, fur, leaves, asphalt and concrete in the range that measurements of such
surfaces have, with the features that matter to a camera (green peak and red edge of chlorophyll,
haemoglobin dip of skin, steep edges of red and yellow pigments). Asphalt and markings are fitted to
measurements: see `road_surfaces`. Retroreflectors are in `retro_reflectors`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from isethdr_core.scene import Material, Spectrum, flat

from .coloured import PREFIX, material_of
from .living_spectra import LIVING, SKINS
from .retro_reflectors import AMBER_OVER_RED, RED_OVER_WHITE, luminous_mean, retro_reflection
from .road_surfaces import DEFAULT, RoadSurfaceName, road_materials
from .textures import textured

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Model

Nodes = float | list[tuple[float, float]]


def _spectrum(value: Nodes, scale: float = 1.0) -> Spectrum:
    if not isinstance(value, list):
        return flat(value * scale)
    return Spectrum(tuple(float(w) for w, _ in value), tuple(min(1.0, v * scale) for _, v in value))


LEAF = [
    (400, 0.03),
    (490, 0.035),
    (520, 0.09),
    (550, 0.135),
    (580, 0.085),
    (620, 0.05),
    (680, 0.035),
    (700, 0.12),
    (740, 0.45),
]
SKIN = [(400, 0.16), (450, 0.21), (500, 0.26), (550, 0.27), (580, 0.29), (610, 0.45), (700, 0.54)]

PAINT = {  # reflectance of the paint below a smooth clear coat
    "white": 0.72,
    "silver": 0.42,
    "grey": 0.13,
    "black": 0.018,
    "red": [(400, 0.03), (560, 0.035), (590, 0.16), (620, 0.42), (700, 0.55)],
    "blue": [(400, 0.20), (460, 0.28), (520, 0.10), (580, 0.035), (700, 0.05)],
    "green": [(400, 0.04), (480, 0.10), (530, 0.17), (600, 0.06), (700, 0.08)],
    "yellow": [(400, 0.05), (490, 0.09), (530, 0.45), (600, 0.66), (700, 0.70)],
    "orange": [(400, 0.04), (540, 0.07), (590, 0.36), (640, 0.60), (700, 0.64)],
    "sand": [(400, 0.16), (500, 0.25), (600, 0.37), (700, 0.44)],
}
COATED = {  # name: (reflectance of the base, roughness of the coat)
    "galvanised": (0.40, 0.35),
    "tyre": (0.022, 0.35),
    "plastic_black": (0.025, 0.25),
    "gloss_black": (0.012, 0.04),
    "lamp_clear": (0.62, 0.05),
    "lamp_dark": (0.06, 0.05),
    "lamp_white": (0.80, 0.03),
    "lamp_red": ([(400, 0.008), (585, 0.009), (610, 0.14), (640, 0.26), (700, 0.28)], 0.04),
    "lamp_amber": ([(400, 0.02), (540, 0.05), (580, 0.35), (620, 0.55), (700, 0.58)], 0.04),
    "plate_ink": (0.02, 0.2),
    "skin": (SKIN, 0.45),
    "skin_dark": ([(w, v * 0.35) for w, v in SKIN], 0.4),
    "leather": (0.03, 0.3),
    "antler": ([(400, 0.18), (600, 0.32), (700, 0.38)], 0.4),
    "window_dark": (0.02, 0.03),
    "box_white": (0.70, 0.15),
    "bin_green": ([(400, 0.02), (480, 0.05), (530, 0.10), (600, 0.03), (700, 0.04)], 0.3),
    "metal_green": ([(400, 0.04), (500, 0.08), (550, 0.09), (700, 0.06)], 0.25),
    "metal_grey": (0.16, 0.25),
    "metal_red": ([(400, 0.03), (580, 0.05), (610, 0.30), (700, 0.42)], 0.2),
}
SHEETING_BASE = 0.60  # reflectance of white sheeting
# coloured sheeting of class `ra2`: spectral shape, and R_A relative to white sheeting
SHEETING = {
    "sheeting_red": ([(400, 0.02), (580, 0.03), (610, 0.45), (700, 0.60)], RED_OVER_WHITE),
    # R_A over that of white, 250; ASTM D4956-01, Type III: yellow 170, blue 20, green 45; from
    # memory
    "sheeting_yellow": ([(400, 0.05), (480, 0.08), (520, 0.45), (700, 0.62)], 170 / 250),
    "sheeting_blue": ([(400, 0.12), (450, 0.22), (500, 0.10), (560, 0.03), (700, 0.04)], 20 / 250),
    "sheeting_green": ([(400, 0.03), (480, 0.10), (520, 0.22), (580, 0.06), (700, 0.04)], 45 / 250),
}
# name: (reflectance of the base, roughness of its coat, retro-reflector, factor on its R_A)
RETRO = {
    "plate_white": (0.70, 0.2, "ra1", 1.0),
    "post_reflector": (0.60, 0.2, "ra2", 1.0),
    "sheeting_white": (SHEETING_BASE, 0.2, "ra2", 1.0),
    "stud_reflector": (SHEETING_BASE, 0.1, "stud", 1.0),
    "reflective_band": (0.35, 0.3, "clothing", 1.0),
    "reflector_red": (
        [(400, 0.015), (590, 0.03), (620, 0.5), (700, 0.55)],
        0.1,
        "vehicle_red",
        1.0,
    ),
    "reflector_amber": (
        [(400, 0.02), (540, 0.05), (580, 0.35), (620, 0.55), (700, 0.58)],
        0.1,
        "vehicle_red",
        AMBER_OVER_RED,
    ),
    "eye_deer": (
        [(400, 0.015), (500, 0.035), (550, 0.04), (600, 0.032), (700, 0.02)],
        0.04,
        "animal_eye",
        1.0,
    ),
}
MATT = {
    "gap": 0.008,
    "underbody": 0.03,
    "interior": 0.045,
    "seat": 0.07,
    "hair_dark": 0.018,
    "hair_fair": [(400, 0.06), (550, 0.16), (700, 0.28)],
    "sole": 0.30,
    "denim": [(400, 0.10), (460, 0.13), (550, 0.07), (700, 0.09)],
    "cloth_dark": 0.03,
    "cloth_grey": 0.20,
    "cloth_white": 0.66,
    "cloth_navy": [(400, 0.05), (460, 0.06), (560, 0.022), (700, 0.03)],
    "cloth_red": [(400, 0.03), (560, 0.03), (600, 0.25), (640, 0.42), (700, 0.45)],
    "cloth_olive": [(400, 0.05), (550, 0.13), (600, 0.14), (700, 0.16)],
    "cloth_vest": [(400, 0.06), (490, 0.20), (520, 0.75), (600, 0.80), (700, 0.78)],
    "fur": [(400, 0.035), (500, 0.06), (560, 0.10), (600, 0.155), (650, 0.20), (700, 0.23)],
    "fur_dark": [(400, 0.04), (600, 0.07), (700, 0.10)],
    "fur_pale": [(400, 0.36), (600, 0.48), (700, 0.52)],
    "bark": [(400, 0.05), (600, 0.10), (700, 0.14)],
    "bark_pale": [(400, 0.14), (600, 0.22), (700, 0.26)],
    "leaf": LEAF,
    "leaf_light": [(w, v * 1.5) for w, v in LEAF],
    "needle": [
        (400, 0.018),
        (490, 0.024),
        (520, 0.05),
        (550, 0.07),
        (580, 0.045),
        (620, 0.03),
        (680, 0.022),
        (740, 0.3),
    ],
    "grass": [
        (400, 0.03),
        (490, 0.04),
        (520, 0.09),
        (550, 0.13),
        (580, 0.095),
        (620, 0.07),
        (680, 0.05),
        (740, 0.38),
    ],
    "grass_dry": [(400, 0.07), (500, 0.12), (550, 0.20), (600, 0.24), (700, 0.30)],
    "meadow": [
        (400, 0.025),
        (490, 0.035),
        (520, 0.07),
        (550, 0.095),
        (600, 0.065),
        (680, 0.045),
        (740, 0.3),
    ],
    "gravel": [(400, 0.17), (700, 0.23)],
    "concrete": [(400, 0.26), (700, 0.34)],
    "tunnel_tile": 0.55,
    "tunnel_lining": [(400, 0.22), (700, 0.28)],
    "wall": [(400, 0.45), (600, 0.60), (700, 0.62)],
    "roof_tile": [(400, 0.04), (560, 0.07), (620, 0.20), (700, 0.26)],
    "wood": [(400, 0.07), (600, 0.17), (700, 0.23)],
    "wall_white": [(400, 0.55), (600, 0.70), (700, 0.71)],
    "wall_yellow": [(400, 0.25), (500, 0.38), (570, 0.54), (700, 0.60)],
    "wall_grey": [(400, 0.28), (700, 0.34)],
    "wall_brick": [(400, 0.06), (540, 0.11), (600, 0.26), (700, 0.34)],
    "wall_pink": [(400, 0.30), (520, 0.36), (600, 0.52), (700, 0.56)],
    "roof_slate": [(400, 0.07), (700, 0.08)],
    "roof_metal": [(400, 0.22), (700, 0.26)],
}
# normal reflectance, roughness
METAL = {
    "chrome": (0.58, 0.03),
    "alloy": (0.88, 0.22),
    "steel": (0.55, 0.30),
}
GLASS = {"glass": 0.84, "glass_tinted": 0.35}  # inner transmittance of the pane


def _retro(name: str, value: Nodes, roughness: float, kind: str, times: float) -> Material:
    """Return a plastic material with retro-reflection."""
    colour = _spectrum(value)
    retro = retro_reflection(kind, colour, times)
    return Material(name, "plastic", colour, roughness, retro=retro)


def _sheeting(name: str, shape: Nodes, share: float) -> Material:
    """Return coloured sheeting with `share` of the R_A of white sheeting. The share scales the
    reflectance, so both colours have the same retro-reflection lobe.
    """
    white = flat(SHEETING_BASE)
    scale = share * SHEETING_BASE / luminous_mean(_spectrum(shape))
    return Material(
        name, "plastic", _spectrum(shape, scale), 0.2, retro=retro_reflection("ra2", white)
    )


MATERIALS: dict[str, Material] = (
    {f"paint_{n}": Material(f"paint_{n}", "plastic", _spectrum(v), 0.06) for n, v in PAINT.items()}
    | {n: Material(n, "plastic", _spectrum(v), a) for n, (v, a) in COATED.items()}
    | {n: Material(n, "diffuse", _spectrum(v)) for n, v in (MATT | LIVING).items()}
    | {n: Material(n, "plastic", _spectrum(v), 0.45) for n, v in SKINS.items()}
    | {n: Material(n, "conductor", _spectrum(v), a) for n, (v, a) in METAL.items()}
    | {n: Material(n, "thin_glass", _spectrum(v)) for n, v in GLASS.items()}
    | {n: _retro(n, *told) for n, told in RETRO.items()}
    | {n: _sheeting(n, *told) for n, told in SHEETING.items()}
    | road_materials(DEFAULT)
)


def used(
    models: dict[str, Model], road_surface: RoadSurfaceName = DEFAULT, seed: int = 0
) -> dict[str, Material]:
    """Return the materials of the parts of `models`, with their textures.

    Parameters
    ----------
    models : models by name; their parts name materials, also colours of asset packs.
    road_surface : surface of asphalt and markings.
    seed : seed of the textures.
    """
    all_materials = MATERIALS | road_materials(road_surface)
    names = sorted({p.material for m in models.values() for p in m.parts})
    plain = {n: material_of(n) if n.startswith(PREFIX) else all_materials[n] for n in names}
    return {n: textured(material, seed) for n, material in plain.items()}
