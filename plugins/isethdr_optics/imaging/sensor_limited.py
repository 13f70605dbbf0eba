"""Light for one sensor: kernels no wider, ghosts no fainter, tiles no farther out than it can tell;
the error left is for the rest.
"""

from __future__ import annotations

from dataclasses import replace

from isethdr_core import quantities
from isethdr_core.uncertainty.budget import CONVOLUTION, LEFT

from ..flare.ghosts.sensor_limited import seen_ghosts
from . import array_backend
from . import photocurrent as way
from .irradiance import irradiance
from .window import on_window, seen

WORTH = 1.5e6  # tiles x bands: to find functionals takes as long as to convolve so many
NOT_WORTH = (
    0.1  # of the error that there is anyway: to be more exact than that is not worth the seconds
)


def photocurrent(lens, mixed, flares, response):
    """Return photocurrent of `mixed` for a sensor, or irradiance where that is better, as
    `photocurrent.photocurrent` does, in its window.
    """
    quantities.check_mixed(mixed)
    mixed, given, response = seen(lens, mixed, flares, response)
    flares, faint = seen_ghosts(lens, mixed, flares, given, response)
    taken = given.noise_share + getattr(given.made, "noise_share", 0.0) + faint
    allowed = response.noise_fraction_allowed
    left = replace(
        response,
        noise_fraction_allowed=max(
            allowed - taken, LEFT * allowed, min(allowed, NOT_WORTH * taken)
        ),
    )
    if mixed.size < WORTH or array_backend.place():
        return on_window(
            irradiance(lens, mixed, flares, given, CONVOLUTION * left.error_allowed), response
        )
    return on_window(way.photocurrent(lens, mixed, flares, left, given), response)
