"""Spectral reflectances of cloth, hair, skin, fur, leaves, bark and stone of the families of
`things`.

As in `materials`, every value is a plausible model written down by hand, not a measurement.
Spectra are (wavelength nm, reflectance) nodes with linear interpolation.
"""

from __future__ import annotations

Nodes = float | list[tuple[float, float]]


def _leaf(green: float, red: float, infrared: float = 0.45) -> list[tuple[float, float]]:
    """Return a leaf with these reflectances at 550, 620 to 680 and 740 nm.

    A leaf always absorbs blue. In summer its chlorophyll also absorbs red; in autumn it reflects
    red.
    """
    blue = 0.03 + 0.05 * green
    edge = red + 0.25 * (infrared - red)
    return [
        (400.0, blue),
        (490.0, blue + 0.01),
        (520.0, 0.65 * green),
        (550.0, green),
        (580.0, 0.5 * (green + red)),
        (620.0, red),
        (680.0, red),
        (700.0, edge),
        (740.0, infrared),
    ]


def _warm(at_400: float, at_550: float, at_700: float) -> list[tuple[float, float]]:
    """Return a spectrum that rises from blue to red: hair, fur, wood, earth."""
    return [(400.0, at_400), (550.0, at_550), (700.0, at_700)]


SKIN_LIGHT = [
    (400.0, 0.16),
    (450.0, 0.21),
    (500.0, 0.26),
    (550.0, 0.27),
    (580.0, 0.29),
    (610.0, 0.45),
    (700.0, 0.54),
]
SKINS: dict[str, list[tuple[float, float]]] = {  # skin below a thin film of grease
    "skin_tan": [(nm, 0.62 * value) for nm, value in SKIN_LIGHT],
}
LIVING: dict[str, Nodes] = {
    "cloth_black": 0.02,
    "cloth_beige": [(400, 0.22), (500, 0.33), (600, 0.42), (700, 0.47)],
    "cloth_brown": _warm(0.04, 0.08, 0.15),
    "cloth_blue": [(400, 0.14), (460, 0.25), (520, 0.14), (580, 0.05), (700, 0.06)],
    "cloth_light_blue": [(400, 0.42), (460, 0.52), (520, 0.46), (580, 0.33), (700, 0.34)],
    "cloth_green": [(400, 0.04), (500, 0.12), (530, 0.19), (600, 0.06), (700, 0.10)],
    "cloth_yellow": [(400, 0.05), (490, 0.10), (530, 0.48), (600, 0.64), (700, 0.67)],
    "cloth_pink": [(400, 0.42), (500, 0.30), (560, 0.26), (610, 0.56), (700, 0.66)],
    "cloth_purple": [(400, 0.16), (450, 0.18), (540, 0.04), (620, 0.11), (700, 0.22)],
    "cloth_orange_vest": [(400, 0.06), (560, 0.10), (590, 0.62), (620, 0.86), (700, 0.80)],
    "cloth_tights": _warm(0.10, 0.17, 0.27),
    "hair_black": 0.012,
    "hair_brown": _warm(0.025, 0.05, 0.10),
    "hair_red": [(400, 0.03), (540, 0.07), (600, 0.17), (700, 0.26)],
    "hair_grey": 0.26,
    "hair_white": 0.55,
    "fur_fox": [(400, 0.05), (500, 0.09), (560, 0.18), (600, 0.33), (650, 0.40), (700, 0.44)],
    "fur_black": 0.02,
    "fur_white": [(400, 0.50), (550, 0.62), (700, 0.66)],
    "fur_boar": _warm(0.035, 0.055, 0.09),
    "fur_brown": _warm(0.03, 0.075, 0.17),
    "fur_chestnut": _warm(0.035, 0.09, 0.26),
    "fur_tan": _warm(0.12, 0.24, 0.40),
    "fur_grey": _warm(0.16, 0.20, 0.24),
    "fur_wool": _warm(0.36, 0.48, 0.55),
    "snout": _warm(0.20, 0.25, 0.42),
    "horn": _warm(0.20, 0.30, 0.36),
    "leaf_dark": _leaf(0.085, 0.025, 0.38),
    "leaf_yellow_green": _leaf(0.21, 0.075),
    "leaf_silver": _leaf(0.20, 0.13, 0.48),
    "leaf_young": _leaf(0.25, 0.06, 0.48),
    "leaf_yellow": [(400, 0.05), (490, 0.08), (530, 0.32), (600, 0.50), (700, 0.56), (740, 0.58)],
    "leaf_orange": [(400, 0.04), (500, 0.06), (560, 0.16), (610, 0.38), (700, 0.48), (740, 0.52)],
    "leaf_red": [(400, 0.04), (560, 0.045), (600, 0.15), (650, 0.30), (700, 0.38), (740, 0.48)],
    "leaf_brown": [(400, 0.05), (500, 0.08), (600, 0.19), (700, 0.29), (740, 0.36)],
    "needle_blue": [(400, 0.06), (490, 0.09), (550, 0.12), (620, 0.07), (680, 0.06), (740, 0.35)],
    "needle_light": _leaf(0.15, 0.055, 0.40),
    "blossom": [(400, 0.52), (500, 0.62), (550, 0.62), (620, 0.70), (700, 0.74)],
    "blossom_pink": [(400, 0.46), (500, 0.40), (550, 0.36), (620, 0.62), (700, 0.70)],
    "flower_yellow": [(400, 0.04), (490, 0.06), (530, 0.45), (600, 0.68), (700, 0.72)],
    "fruit_red": [(400, 0.03), (560, 0.04), (600, 0.20), (650, 0.36), (700, 0.42)],
    "bark_dark": _warm(0.03, 0.05, 0.08),
    "bark_birch": _warm(0.42, 0.54, 0.58),
    "bark_red": _warm(0.07, 0.14, 0.28),
    "rock": _warm(0.18, 0.23, 0.26),
    "rock_dark": _warm(0.08, 0.10, 0.11),
    "rock_warm": _warm(0.18, 0.29, 0.38),
    "moss": _leaf(0.11, 0.05, 0.30),
}
