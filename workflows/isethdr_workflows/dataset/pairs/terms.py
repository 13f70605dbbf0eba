"""Terms: the parts of the light of a scene that lens, dirt and reflections add.

A scene has several versions, which are called members. Each member adds one term to the previous
member:

| member      | lens          | flares                  | term it adds                        |
|-------------|---------------|-------------------------|-------------------------------------|
| `sharp`     | without blur  | none                    | `sharp`                             |
| `in_focus`  | all in focus  | none                    | `blur`: diffraction and aberrations |
| `no_flare`  | as it is      | none                    | `lens`; `blur` or `defocus` where   |
|             |               |                         | blur is a term of its own           |
| `no_ghosts` | as it is      | those that spread light | `scatter`: dirt, haze, iris         |
| `full`      | as it is      | all                     | `ghosts`: those that add light      |

A member that would equal the previous one is left out. The last member is always `full`. A term may
be negative: scatter takes light from the image of a lamp and spreads it. Mean electrons are an
affine function of the light, so the electrons of the terms add up to those of the full light.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_optics.abilities import DrawsPupil
from isethdr_optics.lenses.measured_lens import MeasuredLens
from isethdr_optics.lenses.prescription_lens import PrescribedLens
from isethdr_optics.lenses.thin_lens import IdealLens

from isethdr_core.data.quantities import centres, scene_radiance
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import Chain
from isethdr_core.plugins.protocols import (
    AddsLight,
    FocusesAtDepth,
    ScattersLight,
    TransmitsPupil,
)
from isethdr_core.plugins.registry import build
from isethdr_core.uncertainty.ledger import collected

if TYPE_CHECKING:
    import xarray as xr

FULL = "full"
NO_FLARE = "no_flare"
TERMS = {
    "lens": "light through the lens without any flare",
    "sharp": "light without blur and flare, at the lens's throughput, falloff and distortion",
    "blur": "diffraction at a round stop and aberrations, in focus",
    "defocus": "blur of depths that are out of focus",
    "scatter": "dirt, haze and the iris: what they spread, less what they take away",
    "ghosts": "reflections between surfaces",
}


@dataclass(frozen=True)
class Member:
    """One version of a scene.

    Parameters
    ----------
    name : name of the member.
    term : term that it adds to the previous member.
    lens, flares : lens and flares that image it.
    """

    name: str
    term: str
    lens: Any
    flares: dict[str, Any]


def members(chain: Chain, blur: bool) -> list[Member]:
    """Return the members of a scene; the last one has the full light.

    Parameters
    ----------
    chain : chain of the run.
    blur : whether blur is a term of its own.

    Raises
    ------
    ConfigError : blur is a term of its own, and the lens has no form without blur.
    """
    spread = {name: flare for name, flare in chain.flares.items() if spreads(flare)}
    ladder = []
    term = "lens"
    if blur:
        ladder.append(Member("sharp", "sharp", sharp(chain.lens), {}))
        term = "blur"
        in_focus = chain.lens.in_focus() if isinstance(chain.lens, FocusesAtDepth) else chain.lens
        if in_focus != chain.lens:
            ladder.append(Member("in_focus", "blur", in_focus, {}))
            term = "defocus"
    ladder.append(Member(NO_FLARE, term, chain.lens, {}))
    if spread:
        ladder.append(Member("no_ghosts", "scatter", chain.lens, spread))
    if len(spread) < len(chain.flares):
        ladder.append(Member("with_ghosts", "ghosts", chain.lens, dict(chain.flares)))
    last = ladder[-1]
    return [*ladder[:-1], Member(FULL, last.term, last.lens, dict(chain.flares))]


def check_added(chain: Chain, scene: xr.Dataset) -> None:
    """Apply the flares that add light to a few dark tiles. This finds a flare with a prescription
    that does not fit the lens before any light is computed.

    Parameters
    ----------
    chain : chain of the run.
    scene : scene radiance, for its field and its bands.

    Raises
    ------
    ConfigError : a flare cannot be used with the lens.
    """
    mixed = _dark(scene)
    for flare in chain.flares.values():
        if isinstance(flare, AddsLight):
            collected(lambda one=flare: one.irradiance(chain.lens, mixed))


def check_pupil(chain: Chain, scene: xr.Dataset) -> None:
    """Image a few dark tiles if a flare changes the light in the pupil of a lens that has none. The
    lens then refuses the flare before any light is computed.

    Parameters
    ----------
    chain : chain of the run.
    scene : scene radiance, for its field and its bands.

    Raises
    ------
    ConfigError : the lens has no pupil for a flare.
    """
    lens = chain.lens
    has_pupil = not isinstance(lens, MeasuredLens) and (
        not isinstance(lens, IdealLens) or lens.blurs
    )
    flares = tuple(chain.flares.values())
    if not has_pupil and any(isinstance(one, TransmitsPupil | DrawsPupil) for one in flares):
        collected(lambda: lens(_dark(scene), flares))


def _dark(scene: xr.Dataset) -> xr.DataArray:
    """Return a few dark tiles of mixed radiance, with the field and the outer bands of a scene."""
    width = float(scene.attrs["field_width"])
    height = float(scene.attrs["field_height"])
    bands = scene["wavelength"].values[[0, -1]]
    dark = scene_radiance(
        np.zeros((1, 2, 4, 4)), ["sky"], bands, centres(4, width), centres(4, height)
    )
    return build("lighting", "weights", weights={"sky": 1.0})(dark)


def spreads(flare: Any) -> bool:
    """Return whether a flare changes how light spreads. Other flares only add light."""
    return not isinstance(flare, AddsLight) or isinstance(flare, TransmitsPupil | ScattersLight)


def sharp(lens: Any) -> IdealLens:
    """Return the lens without blur, with the same geometry and throughput.

    Raises
    ------
    ConfigError : the lens is ray-traced or not a thin lens, so its geometry cannot be copied.
    """
    if not isinstance(lens, IdealLens) or isinstance(lens, PrescribedLens):
        raise ConfigError(
            f"blur=true needs a lens with a form without blur, and {type(lens).__name__} has none;"
            " expected a thin lens; type for example lens=wavefront, or blur=false"
        )
    same = {field.name: getattr(lens, field.name) for field in fields(IdealLens)}
    return IdealLens(**same | {"focus_m": "hyperfocal"})
