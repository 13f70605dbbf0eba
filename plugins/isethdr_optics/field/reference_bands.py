"""Reference bands: at which wavelengths the places of the field are chosen, whatever bands a run
asks for.

A band's image must not depend on which others are asked for, else leaving bands out would change
what is kept. So what all bands share, the grid of places and the reach of their cores, is judged at
fixed wavelengths of the part of the spectrum that bands lie in.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.errors import ConfigError

from ..pupil.wavefronts import coefficients_um

PARTS_NM = (
    (0.0, 380.0, (340.0, 370.0)),
    (380.0, 780.0, (400.0, 550.0, 700.0)),
    (780.0, np.inf, (800.0, 1000.0)),
)  # from, below, judged at
WIDTH_NM = 10.0


def references_nm(lens, wavelength_nm) -> list[float]:
    """Return the wavelengths at which kernels of a lens are judged for some bands, rising; those of
    the bands where the lens ends before.

    Parameters
    ----------
    lens : as it is at a place of the field; with a table of `focal_shift_um` they lie within it.
    """
    wave = np.asarray(wavelength_nm, float)
    candidates_nm = np.array(
        [
            w
            for first, last, some in PARTS_NM
            if np.any((wave >= first) & (wave < last))
            for w in some
        ]
    )
    if table_nm := sorted(map(float, lens.focal_shift_um)):
        candidates_nm = candidates_nm.clip(table_nm[0] + WIDTH_NM, table_nm[-1] - WIDTH_NM)
    try:
        for w in candidates_nm:
            for border in (w - WIDTH_NM, w + WIDTH_NM):
                coefficients_um(lens, border)
    except ConfigError:
        candidates_nm = wave[[0, len(wave) // 2, -1]]
    return sorted(set(candidates_nm.tolist()))
