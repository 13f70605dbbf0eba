"""Kernel memory: the memory of the kernels of a frame, estimated before they are computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.pipeline.memory import Frame

from ..psf import kernels, scatter
from ..pupil import pupil_grid, pupil_shapes
from . import wing_truncation

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics


def kernel_bytes(lens: LensOptics, flares: Sequence[Flare], frame: Frame) -> float:
    """Return the bytes of the kernels of all bands over a frame, and of their lattices.

    With the response of a sensor, kernels may end at `wing_truncation.WORTH` of the frame. The
    result is the memory that is certainly needed; `memory.check_kernels` tests the rest.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    frame : tiles and bands of the light.

    Raises
    ------
    ConfigError : the wavefront is too steep for the largest number of pupil cells, or there is too
        much dirt.
    """
    wave = np.asarray(frame.wavelength_nm, float)
    blurred = lens.blurs
    if not (blurred or scatter.active(flares, wave)):
        return 0.0
    part = wing_truncation.WORTH if frame.sensed and blurred else 1.0
    reach = [int(part * (n - 1)) for n in (frame.rows, frame.columns)]
    pitch_um = [1e3 * lens.focal_length_mm * p for p in frame.pitch]
    if blurred and lens.zernike_um:
        # raises an error if the wavefront is too steep
        pupil_grid.core_pitch_mm(lens, min(pitch_um), wave.min(), pupil_grid.FEWEST_SAMPLES)
    if blurred:
        pupil_shapes.check_dirt(lens, flares)
    return kernels.held_bytes(kernels.KernelRequest(lens, flares, wave, pitch_um, reach))
