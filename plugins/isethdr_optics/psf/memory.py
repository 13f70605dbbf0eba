"""Memory: what point spread functions and kernels take, and a refusal of those that the machine
cannot hold.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.pipeline.memory import FLOAT32_BYTES, Frame, Need, check_fits
from isethdr_core.plugins.ranges import LEAST_NM, MOST_NM


def check_psf(waves, pitch_um, size) -> None:
    """Refuse a point spread function of no wavelength, no pitch, or more samples than the memory
    holds.
    """
    if not (np.all(waves >= LEAST_NM) and np.all(waves <= MOST_NM)) or waves.size == 0:
        raise ConfigError(
            f"psf has wavelength_nm={waves.tolist()}; expected one or more in nanometres, "
            f"{LEAST_NM:g} to {MOST_NM:g}; type wavelength_nm=[450,550,650]"
        )
    if not (np.isfinite(pitch_um) and pitch_um > 0) or size < 1:
        raise ConfigError(
            f"psf has pitch_um={pitch_um!r}, size={size!r}; expected a pitch above 0 and one sample"
            " or more"
        )
    need = Need(
        f"a point spread function of {size} x {size} samples",
        8 * waves.size * float(size) ** 2,
        "ask for a smaller size",
    )
    check_fits([need])


def check_kernels(lens, flares, wavelength_nm, pitch_um, reach) -> None:
    """Refuse kernels, with their lattices, that the memory does not hold or that would take
    hours.
    """
    what = f"kernels of {len(wavelength_nm)} bands over {reach[0] + 1} x {reach[1] + 1} tiles"
    size = _kernel_bytes(lens, flares, wavelength_nm, pitch_um, reach)
    check_fits([Need(what, size, "render fewer bands or a smaller field")])


def kernel_bytes(lens, flares, frame: Frame) -> float:
    """Return the bytes of the kernels of all bands over a frame, and of the lattices that they are
    read from.

    With a sensor's response kernels may end at `tails.WORTH` of the frame: so much is certain, and
    `check_kernels` sees the rest.
    """
    from ..pupil import sampled_pupil
    from . import wing_truncation
    from .scatter import active

    wave = np.asarray(frame.wavelength_nm, float)
    blurred = hasattr(lens, "zernike_um")
    if not (blurred or active(flares, wave)):
        return 0.0
    part = wing_truncation.WORTH if frame.sensed and blurred else 1.0
    reach = [int(part * (n - 1)) for n in (frame.rows, frame.columns)]
    pitch_um = [1e3 * lens.focal_length_mm * p for p in frame.pitch]
    if blurred and lens.zernike_um:
        sampled_pupil.core_pitch_mm(
            lens, min(pitch_um), wave.min(), sampled_pupil.FEWEST_SAMPLES
        )  # refuses what no pupil can follow
    return _kernel_bytes(lens, flares, wave, pitch_um, reach)


def _kernel_bytes(lens, flares, wavelength_nm, pitch_um, reach) -> float:
    """Return the bytes of kernels that reach so many (y, x) tiles, and of lattices; those of traced
    lenses are not counted.
    """
    from . import kernels, scaled_pattern, wings

    held = float(FLOAT32_BYTES * len(wavelength_nm) * np.prod([2.0 * r + 1 for r in reach]))
    shortest = float(np.min(wavelength_nm - band_widths_nm(wavelength_nm) / 2))
    if (
        not hasattr(lens, "zernike_um")
        or lens.field_varies
        or lens.traced is not None
        or shortest <= 0
    ):
        return held
    if kernels.without_lattices(lens, shortest, pitch_um, reach):
        return held
    frame = kernels._frame(lens, flares, wavelength_nm, pitch_um, reach)
    if frame is not None:
        return scaled_pattern.memory_bytes(lens, frame)
    return held + wings.lattice_bytes(
        lens, shortest, kernels.fine_tiles(lens, shortest, pitch_um, reach)
    )
