"""Retro-reflectors: plates, posts, road studs, stripes of clothing, vehicle reflectors, eyes.

R_A, cd lx-1 m-2, decreases with the observation angle and with the entrance angle. Each angle has
its own law (`isethdr_core.scene.RetroReflection`). The fit covers the angles of the sources;
outside them it is a model. The values are the minima for new material; real sheets have up to twice
as much.

| name | what | R_A at observation / entrance, degrees | source |
|---|---|---|---|
| ra1 | number plates | 0.2/5: 70; 0.33/5: 50; 2/5: 5; 0.33/40: 9 | EN 12899-1 RA1 (1) |
| ra2 | signs, posts | 0.2/5: 250; 0.33/5: 180; 2/5: 5; 0.33/40: 95 | EN 12899-1 RA2 (1) |
| clothing | stripes of vests | 0.2/5: 330; 0.33/5: 250; 1/5: 25; 1.5/5: 10 | EN ISO 20471 (1) |
| vehicle_red | red, on vehicles | 0.33/0: 100; 1.5/0: 1.7; 0.33/20: 33 | UN R3 class IA (2) |
| stud | road studs | 0.3/5: 185; 1/10: 21; 2/15: 2.1 | EN 1463-1 type 2 (4) |
| animal_eye | deer | 0.33: 60; 1: 33; 2: 9 | a model (3) |

(1) Assumed, from memory; only 330 (clothing) and 180 (RA2) were confirmed. The values 70 and 250
are those of ASTM D4956-01, Types I and III, in a transcription. RA1 stands in for ISO 7591 (number
plates). (2) The regulation's text: at least 300, 5 and 100 mcd/lx, here on 30 cm2; amber 2.5 times
as much. (3) A pupil that returns 15 % of its light, half of it within 1.4 degrees; no measurement
was found. (4) Assumed, from memory: R_I of white studs with plastic reflectors, 220, 25 and 2.5
mcd/lx, over the face of 11.9 cm2 of `geometry.surroundings.road`. R_I at an entrance angle of 20
degrees is 112 / 279 of that at 0, as in ASTM D4280.

The product of two laws is within 10 to 25 % (rms) of the tables of ra1, ra2 and clothing; the worst
cell, clothing at 1 / 20, is 73 % too bright.
"""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files

import numpy as np

from isethdr_core.physics.photometry import v_lambda
from isethdr_core.scene import RetroReflection, Spectrum

# ASTM D4956-01, Type III at 0.2 / -4 degrees: white 250, red 45; from a transcription
RED_OVER_WHITE = 45 / 250
AMBER_OVER_RED = 2.5  # UN R3: reflected light of amber over that of red reflectors


@cache
def _numbers() -> dict[str, dict[str, float]]:
    text = files(__package__).joinpath("retro_reflectors.csv").read_text().splitlines()
    rows = csv.DictReader(line for line in text if not line.startswith("#"))
    return {row.pop("name"): {k: float(v) for k, v in row.items()} for row in rows}


def retro_names() -> tuple[str, ...]:
    """Return the names of the retro-reflectors."""
    return tuple(_numbers())


def retro_reflection(name: str, colour: Spectrum, times: float = 1.0) -> RetroReflection:
    """Return the retro-reflection `name` of a material of reflectance `colour`.

    The colour changes the spectral shape only, not R_A.

    Parameters
    ----------
    name : name of a row of `retro_reflectors.csv`.
    colour : reflectance of the material.
    times : factor on R_A.
    """
    row = _numbers()[name]
    return RetroReflection(
        peak=times * row["r_a_scale"] / luminous_mean(colour),
        width=row["width"],
        falloff=row["falloff"],
        entrance=row["entrance"],
        power=row["power"],
    )


def luminous_mean(spectrum: Spectrum) -> float:
    """Return the mean of a spectrum weighted by V(lambda)."""
    nm = np.arange(380.0, 781.0)
    return float(np.average(spectrum.at(nm), weights=v_lambda(nm)))
