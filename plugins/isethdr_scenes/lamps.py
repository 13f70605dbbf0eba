"""Lamps: what each kind of lamp sends out, in candela, degrees and a named spectrum.

Intensities are typical values. The limits beside them (minimum and maximum on the reference axis)
are assumptions: they name the UN regulation that they are meant to be, but were not checked against
its text. Regulations give limits, not beam shapes, so the angles are models.

A dipped beam is seven modules, because one round beam cannot keep the road wide and yet stay below
the cut-off: a hot spot just below the horizon towards the own side of the road, a middle lobe, two
shoulders and two sides on the road, and the stray light above the cut-off, which is what glares
into oncoming eyes. Right-hand traffic. Summed they stay inside the limits assumed for a class B
dipped beam (UN R112) at the points that a test lists.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from isethdr_core.scene import Lamp

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
    # vehicle headlamps; axes of the dipped beam: `LOW_BEAM`
    "low_beam": Kind("headlights", 18_000, "led_white", 0.9, 1.6),  # hot spot
    "low_beam_middle": Kind("headlights", 4_000, "led_white", 2.0, 5.0),  # road ahead
    "low_beam_shoulder": Kind(
        "headlights", 4_000, "led_white", 1.2, 2.2
    ),  # beside the hot spot, far away
    "low_beam_side": Kind("headlights", 5_000, "led_white", 3.5, 7.5),  # one side of the road
    "low_beam_stray": Kind(
        "headlights", 300, "led_white", 8, 50, 0.02
    ),  # everywhere, also above the cut-off
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

# kind of each module of the dipped beam, and its axis: degrees down, degrees to the left
LOW_BEAM = {
    "hot": ("low_beam", 1.5, -0.9),
    "middle": ("low_beam_middle", 5.0, 0.0),
    "side_left": ("low_beam_side", 7.5, 10.0),
    "side_right": ("low_beam_side", 7.5, -10.0),
    "shoulder_left": ("low_beam_shoulder", 2.2, 4.3),
    "shoulder_right": ("low_beam_shoulder", 2.2, -4.9),
    "stray": ("low_beam_stray", 0.0, 0.0),
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
    )


def low_beam(module: str) -> Lamp:
    """Return one module of a dipped beam that looks along +x, by its name in `LOW_BEAM`."""
    kind, down, left = LOW_BEAM[module]
    a, b = np.radians([down, left])
    return lamp(kind, (np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), -np.sin(a)))
