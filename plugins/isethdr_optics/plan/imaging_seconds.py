"""Imaging seconds: the expected run time of a lens for a frame, before there is any light.

It is the sum of measured costs: kernels that are not kept, their transforms, convolutions, ghosts
of a typical night, and finer lattices beside lamps. A wider exact core beside lamps depends on the
light and is not included.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.pipeline.memory import Frame

from ..flare.ghosts.ghost_flare import GhostFlare, ghost_seconds
from ..imaging import wing_truncation
from ..imaging.sensor_plane import without_geometry
from ..imaging.threads import MOST_THREADS, cpus
from ..psf import kernels

# CPU seconds for a million tiles x bands, on 2 GHz server cores beside other work
# (docs/measured/lens_kernels.md)
CONVOLVED_S = 0.06
TRANSFORMED_S = 0.075
# times that kernels from lattices are made beside lamps, ever finer (`spread_errors`)
LATTICES_BESIDE_LAMPS = 3.0


def expected_s(lens, flares, frame: Frame) -> float | None:
    """Return the expected seconds of a lens for the light of a frame. None if there is no estimate:
    without blur, with point spreads that vary over the field, or with a traced prescription.
    """
    if not lens.blurs or lens.field_varies or lens.traced is not None:
        return None
    wave = np.asarray(frame.wavelength_nm, float)
    values = 1e-6 * len(wave) * frame.rows * frame.columns
    seconds = CONVOLVED_S * values
    reach = (frame.rows - 1, frame.columns - 1)
    pitch_um = tuple(1e3 * lens.focal_length_mm * p for p in frame.pitch)
    axis_lens = without_geometry(lens)  # whose kernels they are
    shorter = wing_truncation.WORTH if frame.sensed else 0.0
    if not kernels.at_hand(axis_lens, flares, wave, pitch_um, reach, shorter):
        seconds += TRANSFORMED_S * values
        made_s = kernels.expected_s(axis_lens, flares, wave, pitch_um, reach)
        if (
            frame.lamps
            and frame.sensed
            and not kernels.from_patterns(axis_lens, flares, wave, pitch_um, reach)
        ):
            made_s *= LATTICES_BESIDE_LAMPS
        seconds += made_s
    corner = np.hypot(*(n / 2 * p for n, p in zip((frame.rows, frame.columns), frame.pitch)))
    for flare in flares:
        if isinstance(flare, GhostFlare):
            seconds += ghost_seconds(flare, lens, wave, float(corner))
    # two threads on two cores take 0.65 to 0.77 of the CPU seconds
    return float(seconds / min(cpus(), MOST_THREADS) ** 0.5)
