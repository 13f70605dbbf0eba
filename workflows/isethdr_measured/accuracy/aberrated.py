"""Functionals of the spectrum in place of bands, through a pupil with a wavefront. The kernels of
such a lens have no mirror symmetry.
"""

from __future__ import annotations

from isethdr_workflows.accuracy.point import Work

from isethdr_core.plugins.registry import build

from .basis import against_bands

# (rows, columns) tiles of the scene
SHAPE = (135, 240)
F_NUMBER = 16.0  # so large that the exact core of a kernel covers the whole scene
ZERNIKE_UM = {4: 0.05, 5: 0.03, 8: 0.03, 12: 0.03}  # as the preset wavefront_automotive


def measured() -> list[Work]:
    """Return one diagram: largest error of a tile's electrons in standard deviations of the noise,
    against the noise allowed.
    """
    lens = build("lens", "wavefront", focal_length_mm=6.0, f_number=F_NUMBER, zernike_um=ZERNIKE_UM)
    return [against_bands("aberrated", lens, (build("flare", "aperture"),), SHAPE)]
