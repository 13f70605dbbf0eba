"""Road surfaces: asphalt and markings fitted to the reflection of measured roads.

Each surface consists of lobes (grains, wide and narrow facets) that are fitted to an r-table of CIE
144:2001 at an observation angle of 1 degree, with light from 0 to 85 degrees off the normal, and to
an assumed R_L in headlamps. Outside these angles it is a model that is reciprocal and never
reflects more light than it receives. `scripts/fit_road_surfaces.py` makes the fit; the numbers are
in `road_surfaces.csv`.

| preset | road | fitted to |
|---|---|---|
| r1 r2 r3 r4 | dry, from diffuse to glossy | the CIE tables R1 to R4 |
| c1 c2 | dry: concrete; asphalt (the default) | the CIE tables C1 and C2 |
| damp | drying | a model: 16 % C2W3 and 84 % C2 |
| w1 w2 | moist to wet | a model: 32 % and 60 % C2W3, the rest C2: Q0 as published |
| c2w3 c2w4 | wet: C2 in the classes W3 and W4 | the CIE tables C2W3 and C2W4 |

R_L of asphalt in headlamps, 5 to 20 mcd m-2 lx-1 dry and about 1 wet, is an assumption: no measured
table was found. The same lobes fitted to the r-tables alone give 2.5 to 8 dry.

Markings are paint with glass beads. Their R_L in the geometry of EN 1436 (30 m) sets the beads.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Literal

import numpy as np

from isethdr_core.scene import Facets, Granular, Material, RetroReflection, Spectrum

from .retro_reflectors import luminous_mean
from .road_photometry import EN_1436_DEG

RoadSurfaceName = Literal["r1", "r2", "r3", "r4", "c1", "c2", "damp", "w1", "w2", "c2w3", "c2w4"]
# asphalt in its dry state; damp, w1, w2, c2w3 and c2w4 are its wet states
DEFAULT: RoadSurfaceName = "c2"
FIELDS = (
    "name,kind,gloss,reflectance,roughness,flatness,narrow_share,wide_alpha,wide_index,"
    "narrow_alpha,narrow_index,q0,s1,s2,r_l"
).split(",")
ASPHALT_NODES = ((400.0, 0.87), (700.0, 1.13))  # spectral shape of asphalt, a model: warm grey
PAINT_REFLECTANCE = 0.55
# R_L of markings, mcd m-2 lx-1: EN 1436 class R3 dry, RW2 wet (classes from memory)
DRY_MARKING_R_L = 150.0
WET_MARKING_R_L = 35.0
WET = ("damp", "w1", "w2", "c2w3", "c2w4")
PAINT = Granular(
    gloss=0.1, roughness=0.6, flatness=0.25, wide=Facets(0.4, 1.5), narrow=Facets(0.4, 1.5)
)
# yellow paint of road works: a model, with a steep edge near 510 nm
YELLOW = Spectrum((400.0, 480.0, 510.0, 540.0, 600.0, 700.0), (0.05, 0.07, 0.20, 0.40, 0.52, 0.55))
PAINT_R_L = 19.54  # R_L of paint without beads over its reflectance, mcd m-2 lx-1
BEAD_HALF_WIDTH_DEG = 6.0  # a model: angle over which beads in paint reflect light back


@dataclass(frozen=True)
class RoadSurface:
    """A fitted surface, and the figures of the table to which it was fitted."""

    name: str
    reflectance: float  # reflectance of the grains
    granular: Granular
    q0: float  # Q0 of the table, 1/sr
    s1: float
    s2: float
    r_l: float  # R_L of the fit, mcd m-2 lx-1 in the geometry of EN 1436


@cache
def road_surfaces() -> dict[str, RoadSurface]:
    """Return the fitted surfaces by name."""
    with files(__package__).joinpath("road_surfaces.csv").open() as file:
        return {row["name"]: _surface(row) for row in csv.DictReader(file)}


def _surface(row: dict[str, str]) -> RoadSurface:
    number = {key: float(row[key]) for key in FIELDS[2:]}
    narrow = Facets(number["narrow_alpha"], number["narrow_index"], _distribution(row["kind"]))
    granular = Granular(
        gloss=number["gloss"],
        roughness=number["roughness"],
        flatness=number["flatness"],
        wide=Facets(number["wide_alpha"], number["wide_index"], "ggx"),
        narrow=narrow,
        narrow_share=number["narrow_share"],
    )
    figures = (number[key] for key in ("q0", "s1", "s2", "r_l"))
    return RoadSurface(row["name"], number["reflectance"], granular, *figures)


def _distribution(name: str) -> Literal["beckmann", "ggx"]:
    return "beckmann" if name == "beckmann" else "ggx"


def asphalt(name: RoadSurfaceName) -> Material:
    """Return the asphalt of a surface. The mean reflectance of its grains, weighted by V(lambda),
    is the fitted one.
    """
    surface = road_surfaces()[name]
    nm, shape = np.array(ASPHALT_NODES).T
    mean = luminous_mean(Spectrum(tuple(nm.tolist()), tuple(shape.tolist())))
    value = np.minimum(surface.reflectance * shape / mean, 1.0)
    spectrum = Spectrum(tuple(nm.tolist()), tuple(value.tolist()))
    return Material("asphalt", "granular", spectrum, granular=surface.granular)


def marking(r_l: float, reflectance: float = PAINT_REFLECTANCE) -> Material:
    """Return the paint of a marking whose beads bring R_L to `r_l`, mcd m-2 lx-1 (EN 1436, 30 m).

    Parameters
    ----------
    r_l : R_L of the marking; the paint alone reaches `PAINT_R_L` times `reflectance`.
    reflectance : reflectance of the paint at all wavelengths.
    """
    beads = max(r_l - PAINT_R_L * reflectance, 0.0) / reflectance
    light, observer = np.sin(np.radians(EN_1436_DEG))
    width = 1 - np.cos(np.radians(BEAD_HALF_WIDTH_DEG))
    apart = 1 - np.cos(np.radians(EN_1436_DEG[1] - EN_1436_DEG[0]))
    falloff = 2.0
    peak = 1e-3 * beads * (light + observer) / light * (1 + apart / width) ** falloff
    retro = RetroReflection(peak=float(peak), width=float(width), falloff=falloff, form="beads")
    spectrum = Spectrum((360.0, 830.0), (reflectance, reflectance))
    return Material("road_paint", "granular", spectrum, granular=PAINT, retro=retro)


def road_materials(name: RoadSurfaceName) -> dict[str, Material]:
    """Return `asphalt`, `road_paint` and `road_paint_yellow` of a road with that surface."""
    r_l = WET_MARKING_R_L if name in WET else DRY_MARKING_R_L
    white = marking(r_l)
    yellow = replace(white, name="road_paint_yellow", reflectance=YELLOW)
    return {"asphalt": asphalt(name), "road_paint": white, "road_paint_yellow": yellow}
