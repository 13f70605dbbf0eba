"""Lamps: intensity in candela, beam angles and spectrum of each kind of lamp.

Intensities are typical values. The comments beside them give the limits (minimum and maximum on the
reference axis) of a UN regulation. Regulations give limits, not beam shapes, so the angles are
models.

A dipped beam is a table over two angles that fulfils all of UN R112, class B: `dipped_beam`. All
other lamps are round.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from isethdr_core.scene import Lamp

from .dipped_beam import PEAK_CD, dipped_beam
from .lamp_spectra import spectrum_of


@dataclass(frozen=True)
class Kind:
    """One kind of lamp, as built."""

    group: str
    intensity_cd: float
    spectrum: str
    inner_deg: float = 90.0
    outer_deg: float = 90.0
    lambertian_share: float = 1e-3


KINDS = {
    # vehicle headlamps
    # dipped beam: a table of candela, `dipped_beam`; a little glow of the lens towards all sides
    "low_beam": Kind("headlights", PEAK_CD, "led_white", lambertian_share=4e-3),
    "position": Kind(
        "headlights", 40, "led_white", 20, 80, 0.05
    ),  # UN R7: 4-140 cd; daytime lamps are dimmed to it
    # street
    "street": Kind(
        "streetlights", 4_000, "sodium", 55, 80, 0.02
    ),  # about 12 klm downwards, as of a 150 W lamp
    # everything else
    "tail": Kind("other", 8, "red", 20, 80, 0.05),  # UN R7: 4-17 cd
    "brake": Kind("other", 80, "red", 15, 60, 0.05),  # UN R7 (S1): 60-260 cd
    "indicator": Kind("other", 200, "amber", 15, 60, 0.05),  # UN R6: 175-1000 cd
    "marker": Kind("other", 4, "amber", 30, 80, 0.05),  # UN R91: side marker 0.6-25 cd
    "reverse": Kind("other", 150, "led_white", 20, 60, 0.05),  # UN R23: 80-600 cd
    "bike_front": Kind(
        "other", 50, "led_white", 4, 25, 0.05
    ),  # StVZO/ISO 6742: 10 lx at 10 m and more
    "bike_tail": Kind("other", 5, "red", 20, 80, 0.05),  # ISO 6742-1: 2.5 cd at least
    "sign": Kind("other", 25, "amber", 30, 80, 0.05),  # amber destination sign, some 100 cd/m2
    "window": Kind("other", 12, "led_warm"),  # lit room: some 10 cd/m2 over 1.2 m2
    "tunnel": Kind(
        "streetlights", 1_500, "led_white", 60, 85, 0.02
    ),  # tunnel luminaire, some 4 klm
}


def groups_of(kinds: Iterable[str]) -> tuple[str, ...]:
    """Return the light groups of a scene under a sky with these kinds of lamps: `sky` first."""
    return ("sky", *sorted({KINDS[kind].group for kind in kinds}))


def lamp(kind: str, axis) -> Lamp:
    """Return the lamp `kind` of `KINDS` that points along `axis` (model coordinates; any
    length).
    """
    k = KINDS[kind]
    direction = np.asarray(axis, float) / np.linalg.norm(axis)
    return Lamp(
        kind,
        k.group,
        float(k.intensity_cd),
        spectrum_of(k.spectrum),
        tuple(direction.tolist()),
        k.inner_deg,
        k.outer_deg,
        k.lambertian_share,
        dipped_beam() if kind == "low_beam" else None,
    )
