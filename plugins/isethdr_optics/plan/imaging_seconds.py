"""Imaging seconds: the expected run time of a lens for a frame, before there is any light.

It is the sum of measured costs: kernels that are not stored, their transforms, the kernels of field
points if the point spread varies, convolutions, ghosts in a typical night scene, and finer lattices
for light next to lamps. The sum is divided by the speed of this processor. A wider exact core for
light next to lamps depends on the light and is not included.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.pipeline.memory import Frame
from isethdr_core.pipeline.runtime_estimate.machine_speed import relative_speed

from ..abilities import TracesColour
from ..field.field_work import field_work
from ..field.meridian import ALONG
from ..flare.ghosts.ghost_flare import GhostFlare, ghost_seconds
from ..imaging import wing_truncation
from ..imaging.sensor_plane import without_geometry
from ..imaging.spread_errors import FINER_FACTORS
from ..imaging.threads import MOST_THREADS, cpus
from ..psf import kernels

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics, PupilOptics

# CPU seconds per million tiles x bands of the convolutions, and of the kernels' transforms, on busy
# 2 GHz server cores (docs/explanation/lens_kernel_choices.md)
CONVOLVED_S = 0.06
TRANSFORMED_S = 0.075
# number of times that kernels from lattices are computed, each time finer, if there are lamps
# (`spread_errors`)
LATTICES_BESIDE_LAMPS = 3.0
# Costs of point spreads that vary over the field, CPU seconds. For five frames the estimate was
# 0.76 to 1.3 times the measured time, and for one of them 1.9 times when the machine was faster
# (docs/explanation/lens_kernel_choices.md).
POINT_SAMPLE_S = 2.0e-8  # per sample of the transforms of field points
OVERLAID_S = 0.1  # per million tiles x bands x field points
TRACED = 1.8  # factor on the whole estimate if the colour of every field point is traced
TRACED_S = 4.0  # for chief rays, rims, exit pupils and wavefronts of a prescription


def expected_s(lens: LensOptics, flares: Sequence[Flare], frame: Frame) -> float | None:
    """Return the expected seconds of a lens for the light of a frame; None without blur.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    frame : tiles and bands of the light.

    Raises
    ------
    ConfigError : the field reaches beyond the field angles of the wavefront.
    """
    if not lens.blurs:
        return None
    wave = np.asarray(frame.wavelength_nm, float)
    values = 1e-6 * len(wave) * frame.rows * frame.columns
    seconds = CONVOLVED_S * values
    reach = (frame.rows - 1, frame.columns - 1)
    pitch_um = tuple(1e3 * lens.focal_length_mm * p for p in frame.pitch)
    axis_lens = without_geometry(lens)  # kernels are stored under this lens
    # kernels that vary over the field do not depend on sensors
    sensed = frame.sensed and not lens.field_varies
    shorter = wing_truncation.WORTH if sensed else 0.0
    request = kernels.KernelRequest(axis_lens, flares, wave, pitch_um, reach)
    made = not kernels.at_hand(request, shorter)
    if made:
        seconds += TRANSFORMED_S * values
        made_s = kernels.expected_s(request)
        from_lattices = not kernels.from_patterns(request)
        if (
            frame.lamps
            and sensed
            and from_lattices
            and kernels.can_be_finer(request, FINER_FACTORS[-1])
        ):
            made_s *= LATTICES_BESIDE_LAMPS
        seconds += made_s
    if lens.field_varies:
        seconds += _field_s(lens, flares, frame, made)
        if isinstance(lens, TracesColour):
            seconds = TRACED * seconds + TRACED_S
    corner = np.hypot(*(n / 2 * p for n, p in zip((frame.rows, frame.columns), frame.pitch)))
    for flare in flares:
        if isinstance(flare, GhostFlare):
            seconds += ghost_seconds(flare, lens, wave, float(corner))
    # the elapsed time of two threads on two cores is 0.65 to 0.77 of the CPU seconds
    return float(seconds / min(cpus(), MOST_THREADS) ** 0.5 / relative_speed())


def _field_s(lens: PupilOptics, flares: Sequence[Flare], frame: Frame, made: bool) -> float:
    """Return the additional CPU seconds for point spreads that vary over the field.

    Parameters
    ----------
    lens, flares, frame : as in `expected_s`.
    made : whether kernels are computed. Otherwise those of the axis are stored, and those of the
        field points are assumed to be stored too.
    """
    wave = np.asarray(frame.wavelength_nm, float)
    shape = (frame.rows, frame.columns)
    pitch_um = tuple(1e3 * lens.focal_length_mm * p for p in frame.pitch)
    corner = np.hypot(*((n - 1) / 2 * p for n, p in zip(shape, frame.pitch)))
    angles_rad = np.arctan(np.linspace(0.0, corner, ALONG)).tolist()
    work = field_work(lens, flares, angles_rad, wave, pitch_um, shape)
    values = 1e-6 * len(wave) * frame.rows * frame.columns
    samples = work.searched + (work.cores if made else 0.0)
    seconds = POINT_SAMPLE_S * samples + OVERLAID_S * work.points * values
    return seconds + made * work.reach_s
