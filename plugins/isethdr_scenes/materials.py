"""Surface materials: spectral reflectances as (wavelength nm, value) nodes, linear between.

Every value is a plausible model written down by hand, not a measurement: diffuse reflectances of paint,
cloth, skin, fur, leaves, asphalt and concrete in the range that measurements of such surfaces have, with
the features that matter to a camera (chlorophyll's green peak and red edge, skin's haemoglobin dip, the
steep edges of red and yellow pigments). There is no retro-reflection: plates, vest bands, marker posts
and road paint are ordinary surfaces.
"""

from __future__ import annotations

from isethdr_core.scene import Material, Spectrum, flat

Nodes = float | list[tuple[float, float]]


def _spectrum(value: Nodes, scale: float = 1.0) -> Spectrum:
    if not isinstance(value, list):
        return flat(value * scale)
    return Spectrum(tuple(float(w) for w, _ in value), tuple(min(1.0, v * scale) for _, v in value))


LEAF = [(400, .03), (490, .035), (520, .09), (550, .135), (580, .085), (620, .05), (680, .035), (700, .12), (740, .45)]
SKIN = [(400, .16), (450, .21), (500, .26), (550, .27), (580, .29), (610, .45), (700, .54)]

PAINT = {  # under a smooth clear coat
    "white": .72, "silver": .42, "grey": .13, "black": .018,
    "red": [(400, .03), (560, .035), (590, .16), (620, .42), (700, .55)],
    "blue": [(400, .20), (460, .28), (520, .10), (580, .035), (700, .05)],
    "green": [(400, .04), (480, .10), (530, .17), (600, .06), (700, .08)],
    "yellow": [(400, .05), (490, .09), (530, .45), (600, .66), (700, .70)],
    "orange": [(400, .04), (540, .07), (590, .36), (640, .60), (700, .64)],
    "sand": [(400, .16), (500, .25), (600, .37), (700, .44)],
}
COATED = {  # name: (reflectance of the base, roughness of the coat)
    "galvanised": (.40, .35), "tyre": (.022, .35), "plastic_black": (.025, .25), "gloss_black": (.012, .04),
    "lamp_clear": (.62, .05), "lamp_dark": (.06, .05), "lamp_white": (.80, .03),
    "lamp_red": ([(400, .008), (585, .009), (610, .14), (640, .26), (700, .28)], .04),
    "lamp_amber": ([(400, .02), (540, .05), (580, .35), (620, .55), (700, .58)], .04),
    "plate_white": (.70, .2), "plate_ink": (.02, .2),
    "reflector_red": ([(400, .015), (590, .03), (620, .5), (700, .55)], .1),
    "skin": (SKIN, .45), "skin_dark": ([(w, v * .35) for w, v in SKIN], .4), "leather": (.03, .3),
    "antler": ([(400, .18), (600, .32), (700, .38)], .4),
    "asphalt": ([(400, .065), (700, .085)], .55), "window_dark": (.02, .03), "box_white": (.70, .15),
}
MATT = {
    "gap": .008, "underbody": .03, "interior": .045, "seat": .07, "hair_dark": .018,
    "hair_fair": [(400, .06), (550, .16), (700, .28)], "sole": .30,
    "denim": [(400, .10), (460, .13), (550, .07), (700, .09)],
    "cloth_dark": .03, "cloth_grey": .20, "cloth_white": .66,
    "cloth_navy": [(400, .05), (460, .06), (560, .022), (700, .03)],
    "cloth_red": [(400, .03), (560, .03), (600, .25), (640, .42), (700, .45)],
    "cloth_olive": [(400, .05), (550, .13), (600, .14), (700, .16)],
    "cloth_vest": [(400, .06), (490, .20), (520, .75), (600, .80), (700, .78)],
    "fur": [(400, .035), (500, .06), (560, .10), (600, .155), (650, .20), (700, .23)],
    "fur_dark": [(400, .04), (600, .07), (700, .10)], "fur_pale": [(400, .36), (600, .48), (700, .52)],
    "bark": [(400, .05), (600, .10), (700, .14)], "bark_pale": [(400, .14), (600, .22), (700, .26)],
    "leaf": LEAF, "leaf_light": [(w, v * 1.5) for w, v in LEAF],
    "needle": [(400, .018), (490, .024), (520, .05), (550, .07), (580, .045), (620, .03), (680, .022), (740, .3)],
    "grass": [(400, .03), (490, .04), (520, .09), (550, .13), (580, .095), (620, .07), (680, .05), (740, .38)],
    "grass_dry": [(400, .07), (500, .12), (550, .20), (600, .24), (700, .30)],
    "meadow": [(400, .025), (490, .035), (520, .07), (550, .095), (600, .065), (680, .045), (740, .3)],
    "gravel": [(400, .17), (700, .23)], "road_paint": .55, "concrete": [(400, .26), (700, .34)],
    "tunnel_tile": .55, "tunnel_lining": [(400, .22), (700, .28)],
    "wall": [(400, .45), (600, .60), (700, .62)], "roof_tile": [(400, .04), (560, .07), (620, .20), (700, .26)],
    "wood": [(400, .07), (600, .17), (700, .23)],
}
METAL = {"chrome": (.58, .03), "alloy": (.88, .22), "steel": (.55, .30)}  # normal reflectance, roughness
GLASS = {"glass": .84, "glass_tinted": .35}                               # inner transmittance of the pane

MATERIALS: dict[str, Material] = (
    {f"paint_{n}": Material(f"paint_{n}", "plastic", _spectrum(v), .06) for n, v in PAINT.items()}
    | {n: Material(n, "plastic", _spectrum(v), a) for n, (v, a) in COATED.items()}
    | {n: Material(n, "diffuse", _spectrum(v)) for n, v in MATT.items()}
    | {n: Material(n, "conductor", _spectrum(v), a) for n, (v, a) in METAL.items()}
    | {n: Material(n, "thin_glass", _spectrum(v)) for n, v in GLASS.items()}
)


def used(models) -> dict[str, Material]:
    """Return the materials that the parts of `models` name."""
    return {n: MATERIALS[n] for n in sorted({p.material for m in models.values() for p in m.parts})}
