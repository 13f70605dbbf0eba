"""Planning: what of a field, and of a lens's effects, is needed for some sensors; decided once,
before any light is made.
"""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np

from isethdr_core import quantities
from isethdr_core.data.camera_geometry import projection_of
from isethdr_core.data.temporal_modulation import DIM, components
from isethdr_core.demand import Response
from isethdr_core.ledger import LeftOut, Note
from isethdr_core.physics.optics.projection import angle_rad
from isethdr_core.pipeline.imaging_plan import LightBudget
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..flare.ghosts.sensor_limited import seen_ghosts
from ..imaging import array_backend
from ..imaging.accuracy_shares import CONVOLUTION, LEFT
from ..imaging.field_optics import field_optics
from ..imaging.kernel_statements import Margin, kernel_notes
from ..imaging.wing_truncation import cut_noise_share
from .lens_plan import LensPlan
from .region import region
from .window import seen

WORTH = 1.5e6  # tiles x bands: to find functionals takes as long as to convolve so many
# Of the error that the kernels have anyway. Functionals of a quarter of it add 3 % to its root
# sum of squares. A smaller share would send scenes with bright lamps band by band, several times
# slower.
NOT_WORTH = 0.25


def plan(lens, flares, field, response: Response | None, budget: LightBudget) -> LensPlan:
    """Return the plan of imaging a field; arguments as
    `isethdr_core.plugins.protocols.PlansImaging.plan`.

    Kernels end where the sensors of `response` cannot tell, ghosts that they cannot tell are not
    traced, and tiles beside their window are left out whose light cannot reach it. What is left of
    the error allowed is for the rest of the way. Light in components is made wavelength by
    wavelength, to the lens's own error.

    Raises
    ------
    UnitError : `field` is no mixed radiance, or holds negative or non-finite light.
    """
    for _, one in components(field):
        quantities.check_mixed(one)
    if DIM in field.dims:
        response = None
    part, light, dark = region(lens, flares, field, budget)
    _, mixed = components(light)[0]
    limits = lens.limits(_widest_rad(mixed), mixed.wavelength.values.astype(float))
    found = seen(lens, mixed, flares, response)
    optics = found.optics
    notes = [*dark, *limits, *optics.sensor.notes, *optics.notes, *found.notes]
    if found.tiles is not None:
        part = replace(part, tiles=found.tiles)
    error_allowed, left = budget.error_allowed, None
    if response is not None:
        part = replace(part, window_m=response.window_m)
        flares, faint, of_ghosts = seen_ghosts(lens, found.mixed, flares, optics, found.response)
        notes += of_ghosts
        left = _left(found, faint)
        error_allowed = CONVOLUTION * left.error_allowed
        if found.mixed.size < WORTH or array_backend.place():
            left = None
    notes += kernel_notes(lens, optics, _margin(found.mixed))
    checked = weakref.ref(field)
    return LensPlan(lens, flares, part, optics, error_allowed, left, *_sorted(notes), checked)


def whole(lens, flares, field, response: Response | None = None) -> LensPlan:
    """Return the plan that leaves nothing of a field out: full kernels, and functionals of the
    spectrum however small the field.
    """
    for _, one in components(field):
        quantities.check_mixed(one)
    part = region(lens, flares, field, LightBudget()).region
    optics = field_optics(lens, field, flares)
    notes = [*optics.sensor.notes, *optics.notes, *kernel_notes(lens, optics, _margin(field))]
    error_allowed = CONVOLUTION * response.error_allowed if response else 0.0
    return LensPlan(lens, flares, part, optics, error_allowed, response, *_sorted(notes))


def _sorted(notes: list[Note]) -> tuple[tuple[ErrorTerm, ...], tuple[LeftOut, ...]]:
    """Return the error terms of notes, and what was left out."""
    terms = tuple(note for note in notes if isinstance(note, ErrorTerm))
    return terms, tuple(note for note in notes if isinstance(note, LeftOut))


def _left(found, faint: float) -> Response:
    """Return the response with the share of its noise that is left for the way through the lens."""
    allowed = found.response.noise_fraction_allowed
    taken = found.optics.noise_share + cut_noise_share(found.optics.made) + faint
    left = max(allowed - taken, LEFT * allowed, min(allowed, NOT_WORTH * taken))
    return replace(found.response, noise_fraction_allowed=left)


def _widest_rad(mixed) -> float:
    """Return the largest angle off the axis of a field's tiles."""
    x, y = (np.abs(mixed[d].values).max() for d in ("x", "y"))
    return float(angle_rad(x, y, projection_of(mixed)))


def _margin(mixed) -> Margin:
    """Return the tiles of a field beyond the sensors' window, or beyond the camera's field where no
    window is known.
    """
    if known := mixed.attrs.get("tiles_beyond"):
        return Margin(known, of_window=True)
    full = quantities.full_field(mixed)[::-1]
    field = [mixed.attrs.get(k) or n for k, n in zip(("field_height", "field_width"), full)]
    pitch = [quantities.tile_pitch(mixed, d) for d in ("y", "x")]
    return Margin(tuple((n - w / p) / 2 for n, w, p in zip(mixed.shape[1:], field, pitch)))
