"""Refuse, before rendering, bands for which a sky, a lamp or a material has no data, and bands
beyond the spectra of the renderer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.scene import SceneDescription, SkyDome, Spectrum

from .lamps.placed_lamps import SPECTRUM_NM

MOST_NAMED = 5


def check_bands(description: SceneDescription, groups: Sequence[str], bands_nm: np.ndarray) -> None:
    """Refuse bands with a centre outside the data of a sky, lamp or material to be rendered, or
    outside `SPECTRUM_NM`, the wavelengths at which the renderer tabulates all spectra.

    Parameters
    ----------
    description : scene with the sky, lamps and materials to check.
    groups : light groups to render; the sky and lamps of other groups are not checked.
    bands_nm : (band,) centres, nm.

    Raises
    ------
    ConfigError : some data does not cover the bands. The message names the sky, lamps and materials
        concerned, and the range that all of them cover.
    """
    low = float(np.min(bands_nm))
    high = float(np.max(bands_nm))
    spans = {"the spectra of this renderer": (float(SPECTRUM_NM[0]), float(SPECTRUM_NM[-1]))}
    for what, spectrum in _spectra(description, groups):
        # lamps of one kind may have different spectra
        begin, end = spans.get(what, (-np.inf, np.inf))
        spans[what] = (
            max(begin, spectrum.wavelength_nm[0]),
            min(end, spectrum.wavelength_nm[-1]),
        )
    lacking = {w: (a, b) for w, (a, b) in spans.items() if a > low or b < high}
    if not lacking:
        return
    named = [f"{what} ({a:g} to {b:g} nm)" for what, (a, b) in lacking.items()]
    more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    first, last = (pick(span[k] for span in spans.values()) for k, pick in enumerate((max, min)))
    asked = (
        f"bands from {low:g} to {high:g} nm are asked for, beyond the data of"
        f" {', '.join(named[:MOST_NAMED])}{more}"
    )
    if first > last:
        raise ConfigError(f"{asked}; there is no band for which all have data")
    if max(low, first) > min(high, last):  # none of the bands has data
        low = first
        high = last
    raise ConfigError(
        f"{asked}; expected bands within {first:g} to {last:g} nm, for which all have data; type"
        f" for example renderer.first_nm={max(low, first):g} renderer.last_nm={min(high, last):g}"
    )


def _spectra(
    description: SceneDescription, groups: Sequence[str]
) -> Iterator[tuple[str, Spectrum | SkyDome]]:
    if "sky" in groups and description.sky is not None:
        yield "the sky", description.sky
    used = {}
    for placed in description.objects:
        for part in description.models[placed.model].parts:
            used[part.material] = None
            if part.lamp is not None and part.lamp.group in groups:
                yield f"lamp {part.lamp.kind}", part.lamp.spectrum
    for name in used:
        material = description.materials.get(name)
        if material is not None:
            yield f"material {name}", material.reflectance
            if material.texture is not None:
                yield f"texture of material {name}", material.texture.other
