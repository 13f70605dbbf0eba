"""Memory: checks that the machine's memory holds point spread functions and kernels."""

from __future__ import annotations

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.memory import Need, check_fits
from isethdr_core.plugins.ranges import LEAST_NM, MOST_NM


def check_psf(waves: np.ndarray, pitch_um: float, size: int) -> None:
    """Refuse a point spread function without valid wavelengths or a valid pitch, or one with more
    samples than the memory holds.

    Parameters
    ----------
    waves : (wavelength,) wavelengths, nm.
    pitch_um : distance of the samples, um.
    size : number of samples along each axis.
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


def check_kernels(held_bytes: float, bands: int, reach: tuple[int, int]) -> None:
    """Refuse kernels that, together with their lattices, the memory does not hold.

    Parameters
    ----------
    held_bytes : memory of the kernels and their lattices.
    bands : number of bands.
    reach : (y, x) tiles from the axis to the border of the kernels.
    """
    subject = f"kernels of {bands} bands over {reach[0] + 1} x {reach[1] + 1} tiles"
    check_fits([Need(subject, held_bytes, "render fewer bands or a smaller field")])
