"""Memory: arrays that cannot be held are refused before work starts, with their size."""

from __future__ import annotations

import os

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.ranges import LEAST_NM, MOST_NM


def check_psf(waves, pitch_um, size) -> None:
    """Refuse a point spread function of no wavelength, no pitch, or more samples than the memory holds."""
    if not (np.all(waves >= LEAST_NM) and np.all(waves <= MOST_NM)) or waves.size == 0:
        raise ConfigError(
            f"psf has wavelength_nm={waves.tolist()}; expected one or more in nanometres, "
            f"{LEAST_NM:g} to {MOST_NM:g}; type wavelength_nm=[450,550,650]"
        )
    if not (np.isfinite(pitch_um) and pitch_um > 0) or size < 1:
        raise ConfigError(f"psf has pitch_um={pitch_um!r}, size={size!r}; expected a pitch above 0 and one sample or more")
    check_fits(waves.size * float(size) ** 2, 8, f"a point spread function of {size} x {size} samples", "ask for a smaller size")


def check_kernels(bands: int, reach) -> None:
    """Refuse kernels that the memory does not hold."""
    what = f"kernels of {bands} bands over {reach[0] + 1} x {reach[1] + 1} tiles"
    check_fits(bands * np.prod([2.0 * r + 1 for r in reach]), 4, what, "render fewer bands or a smaller field")


def check_fits(count: float, bytes_each: int, what: str, advice: str) -> None:
    """Refuse `count` numbers of `bytes_each` where they exceed the machine's memory."""
    try:
        most = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # no such figure on this system
        return
    if count * bytes_each > most:
        size, most = (n / 2**30 for n in (count * bytes_each, most))
        raise ConfigError(f"{what} would take {size:.3g} GiB; expected at most this machine's {most:.3g} GiB; {advice}")
