"""Refuse, before rendering, bands that a sky, a lamp or a material has no data for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.scene import SceneDescription, SkyDome, Spectrum

MOST_NAMED = 5


def check_bands(description: SceneDescription, groups: Sequence[str], bands_nm: np.ndarray) -> None:
    """Refuse bands with a centre outside the data of a sky, lamp or material to be rendered.

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
    spans = {
        what: (s.wavelength_nm[0], s.wavelength_nm[-1]) for what, s in _spectra(description, groups)
    }
    lacking = {w: (a, b) for w, (a, b) in spans.items() if a > low or b < high}
    if not lacking:
        return
    named = [f"{what} ({a:g} to {b:g} nm)" for what, (a, b) in lacking.items()]
    more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    first, last = (pick(span[k] for span in spans.values()) for k, pick in enumerate((max, min)))
    raise ConfigError(
        f"bands from {low:g} to {high:g} nm are asked for, beyond the data of"
        f" {', '.join(named[:MOST_NAMED])}{more}; expected bands within {first:g} to {last:g} nm,"
        f" for which all have data; type for example renderer.first_nm={max(low, first):g}"
        f" renderer.last_nm={min(high, last):g}"
    )


def _spectra(
    description: SceneDescription, groups: Sequence[str]
) -> Iterator[tuple[str, Spectrum | SkyDome]]:
    if "sky" in groups and description.sky is not None:
        yield "the sky", description.sky
    used = {}
    for placed in description.objects:
        model = description.models.get(placed.model)  # a missing model is reported later
        for part in model.parts if model else ():
            used[part.material] = None
            if part.lamp is not None and part.lamp.group in groups:
                yield f"lamp {part.lamp.kind}", part.lamp.spectrum
    for name in used:
        material = description.materials.get(name)
        if material is not None:
            yield f"material {name}", material.reflectance
            if material.texture is not None:
                yield f"texture of material {name}", material.texture.other
