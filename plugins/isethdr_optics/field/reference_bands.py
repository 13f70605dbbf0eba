"""Reference bands: the wavelengths at which field points are chosen, for any bands of a run.

The image of a band must not depend on which other bands a run uses. Otherwise, leaving out bands
would change the others. All bands share the grid of field points and the reach of their cores. Both
are therefore decided at fixed wavelengths within the spectral range of the bands.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError

from ..pupil.wavefronts import coefficients_um

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..abilities import PupilOptics

# (first wavelength, end of the range, reference wavelengths) of each part of the spectrum, nm
PARTS_NM = (
    (0.0, 380.0, (340.0, 370.0)),
    (380.0, 780.0, (400.0, 550.0, 700.0)),
    (780.0, np.inf, (800.0, 1000.0)),
)
WIDTH_NM = 10.0


def references_nm(lens: PupilOptics, wavelength_nm: ArrayLike) -> list[float]:
    """Return the reference wavelengths for the kernels of a lens in some bands, nm, in rising
    order.

    Parameters
    ----------
    lens : lens of one field point. If it has a table `focal_shift_um`, all reference wavelengths
        lie within the table.
    wavelength_nm : centres of the bands, nm. If the lens is not defined at the fixed wavelengths,
        the first, the middle and the last of these are returned.
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
