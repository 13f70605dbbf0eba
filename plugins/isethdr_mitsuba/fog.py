"""Fog in this renderer: the sky used with fog, and the light that is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.fog import Fog
from isethdr_core.errors import ConfigError
from isethdr_core.scene import SceneDescription, SkyDome, Spectrum

from .lamps.placed_lamps import SPECTRUM_NM

SCALAR = "scalar"
# Share of the airlight that is missing at each of these visibilities, by night and by day, in the
# scene of `python -m isethdr_measured fog_scattering` (docs/explanation/fog.md)
VISIBILITIES_M = 50.0, 100.0, 200.0, 500.0
LOST = (0.81, 0.59, 0.23, 0.05), (0.05, 0.08, 0.05, 0.03)


def in_fog(description: SceneDescription, variant: str) -> SceneDescription:
    """Return the description to render. With fog, a sky with a gradient, sun and moon is replaced
    by the uniform sky that gives level ground the same illuminance.

    Raises
    ------
    ConfigError : the scene has fog, and the variant is scalar and does not render fog.
    """
    if description.fog is None:
        return description
    if variant.startswith(SCALAR):
        raise ConfigError(
            f"scene {description.name!r} has fog, which the variant {variant} does not render;"
            " expected LLVM 17 or newer (`isethdr doctor` says what to install); or type"
            " scene.visibility_m=null for clear air"
        )
    if not isinstance(description.sky, SkyDome):
        return description
    ledger.left_out(
        "gradient of the sky, sun and moon",
        "in fog, a uniform sky with the same illuminance on level ground replaces them",
        float("nan"),
        "",
        key="sky in fog",
    )
    even = description.sky.at(SPECTRUM_NM)
    first_nm = description.sky.wavelength_nm[0]
    last_nm = description.sky.wavelength_nm[-1]
    nm = SPECTRUM_NM[(first_nm <= SPECTRUM_NM) & (last_nm >= SPECTRUM_NM)]
    value = np.interp(nm, SPECTRUM_NM, even)
    return replace(description, sky=Spectrum(tuple(nm.tolist()), tuple(value.tolist())))


def state_fog(fog: Fog | None, with_lamps: bool, with_sky: bool) -> None:
    """State in the ledger which light in fog is left out, and about what share of the airlight.

    Parameters
    ----------
    fog : fog of the scene; None: clear air, and nothing is stated.
    with_lamps, with_sky : whether light of lamps and of the sky is rendered.
    """
    if fog is None:
        return
    lost = [float(np.interp(np.log(fog.visibility_m), np.log(VISIBILITIES_M), v)) for v in LOST]
    if with_lamps:
        ledger.left_out(
            "light of lamps that fog scatters more than once, or onto surfaces",
            "only single scattering towards the camera is computed; visibility"
            f" {fog.visibility_m:.3g} m",
            lost[0],
            "relative",
            key="scattered twice",
        )
    if with_sky:
        ledger.left_out(
            "light of the sky that surfaces reflect into the fog",
            "random walks through the fog end at surfaces",
            lost[1],
            "relative",
            key="reflected into the fog",
        )
