"""Planning: the decision which parts of a field, and which effects of a lens, the sensors need.

It is made once, before imaging.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import quantities
from isethdr_core.data.camera_geometry import projection_of
from isethdr_core.data.temporal_modulation import DIM, components
from isethdr_core.demand import Response
from isethdr_core.ledger import LeftOut, Note
from isethdr_core.physics.optics.projection import angle_rad
from isethdr_core.pipeline.imaging_plan import LightBudget
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..abilities import BlursByDepth
from ..flare.ghosts.sensor_limited import without_faint_ghosts
from ..imaging import array_backend
from ..imaging.accuracy_shares import CONVOLUTION, LEFT
from ..imaging.field_optics import field_optics
from ..imaging.kernel_statements import Margin, kernel_notes
from ..imaging.wing_truncation import truncation_noise_share
from . import behind_glass, depth_layers
from .behind_glass import PlanBehindGlass
from .depth_layers import DefocusedPlan
from .lens_plan import LensPlan
from .region import region
from .window import window_view

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics, PupilOptics
    from .window import WindowView

# number of tiles x bands below which convolving band by band is faster than fitting functionals
WORTH = 1.5e6
# Error that functionals may always have, as a share of the error already used by kernels. A quarter
# adds 3 % to the root sum of squares. With a smaller share, scenes with bright lamps would be
# convolved band by band, several times slower.
NOT_WORTH = 0.25


def plan(
    lens: LensOptics,
    flares: Sequence[Flare],
    field: xr.DataArray,
    response: Response | None,
    budget: LightBudget,
) -> LensPlan | DefocusedPlan | PlanBehindGlass:
    """Return the plan of imaging a field, as `isethdr_core.plugins.protocols.PlansImaging.plan`.

    Flares in front of the lens change the field first. A lens focused at a distance then blurs the
    field by its depth, in layers.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    field : mixed radiance ([component,] wavelength, y, x); with the label depth if the lens is
        focused at a distance.
    response : response of the sensors; None asks for irradiance, band by band.
    budget : the light that is needed, and the allowed error.

    Raises
    ------
    ConfigError : the lens is focused at a distance, and the field has no depth.
    UnitError : `field` is not mixed radiance, or holds negative or non-finite light.
    """
    front, flares = behind_glass.split(flares)
    if not front:
        return _plan_in_air(lens, flares, field, response, budget)
    glass = behind_glass.glass(lens, front, field)
    return behind_glass.plan_behind(
        glass, _plan_in_air(lens, flares, glass.behind, response, budget)
    )


def _plan_in_air(
    lens: LensOptics,
    flares: Sequence[Flare],
    field: xr.DataArray,
    response: Response | None,
    budget: LightBudget,
) -> LensPlan | DefocusedPlan:
    """Return the plan of a lens without flares in front of it; arguments as in `plan`."""
    if not isinstance(lens, BlursByDepth) or lens.focus_m == "hyperfocal":
        return _plan(lens, flares, field, response, budget)
    for _, component in components(field):
        quantities.check_mixed(component)
    _, mixed = components(field)[0]
    blur = depth_layers.blur_tiles(lens, mixed)
    discs = depth_layers.beyond_diffraction(lens, mixed, blur)
    judged_by = depth_layers.finest(lens, mixed, response)
    found = depth_layers.layers(discs, judged_by.least)
    lens = lens.in_focus()
    notes = depth_layers.layer_notes(blur, discs, found, judged_by)
    if len(found) == 1 and not found[0].blur:
        return _plan(lens, flares, field, response, budget, notes)
    blurred = depth_layers.defocused(field, found)
    made = _plan(lens, flares, blurred, response, budget, notes)
    edges = depth_layers.at_edges(blur)
    terms = *made.terms, *depth_layers.layer_terms(lens, edges)
    return DefocusedPlan(made, found, edges, terms, made.left_out)


def _plan(
    lens: LensOptics,
    flares: Sequence[Flare],
    field: xr.DataArray,
    response: Response | None,
    budget: LightBudget,
    of_depth: Sequence[Note] | None = None,
) -> LensPlan:
    """Return the plan of a lens with the same kernels for all depths.

    Kernels are truncated where the sensors of `response` see no difference. Ghosts that are too
    faint for the sensors are not traced. Tiles outside the sensors' window are left out if they
    send too little light into it. The rest of the allowed error is for the convolutions. Light with
    components is imaged band by band, without the response of the sensors.

    Parameters
    ----------
    lens, flares, field, response, budget : as in `plan`.
    of_depth : notes about defocus that is left out; None: the note of a lens focused at its
        hyperfocal distance.

    Raises
    ------
    UnitError : `field` is not mixed radiance, or holds negative or non-finite light.
    """
    for _, component in components(field):
        quantities.check_mixed(component)
    pixels_of = response
    if DIM in field.dims:
        response = None
    part, light, dark = region(lens, flares, field, budget)
    _, mixed = components(light)[0]
    limits = lens.limits(_widest_rad(mixed), mixed.wavelength.values.astype(float))
    view = window_view(lens, mixed, flares, response)
    optics = view.optics
    if of_depth is None:
        at_hyperfocal = isinstance(lens, BlursByDepth)
        judged_by = depth_layers.finest(lens, mixed, pixels_of)
        of_depth = [depth_layers.hyperfocal_note(lens, judged_by)] if at_hyperfocal else []
    notes = [*of_depth, *dark, *limits, *optics.sensor.notes, *optics.notes, *view.notes]
    if view.tiles is not None:
        part = replace(part, tiles=view.tiles)
    error_allowed = budget.error_allowed
    remaining = None
    if response is not None:
        part = replace(part, window_m=response.window_m)
        flares, faint, of_ghosts = without_faint_ghosts(
            lens, view.mixed, flares, optics, view.response
        )
        notes += of_ghosts
        remaining = _remaining_response(view, faint)
        error_allowed = CONVOLUTION * remaining.error_allowed
        if view.mixed.size < WORTH or array_backend.device_transfer():
            remaining = None
    notes += kernel_notes(lens, optics, _margin(view.mixed))
    checked = weakref.ref(field)
    return LensPlan(lens, flares, part, optics, error_allowed, remaining, *_sorted(notes), checked)


def complete_plan(
    lens: PupilOptics,
    flares: Sequence[Flare],
    field: xr.DataArray,
    response: Response | None = None,
) -> LensPlan | PlanBehindGlass:
    """Return the plan that leaves nothing out: full kernels, and functionals for a field of any
    size.

    Flares in front of the lens change the field first, as in `plan`. A lens focused at a distance
    is imaged as if focused at its hyperfocal distance.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    field : mixed radiance ([component,] wavelength, y, x).
    response : `isethdr_core.demand.Response` of the sensors; None: irradiance only.
    """
    front, flares = behind_glass.split(flares)
    if front:
        glass = behind_glass.glass(lens, front, field)
        made = complete_plan(lens, flares, glass.behind, response)
        return behind_glass.plan_behind(glass, made)
    for _, component in components(field):
        quantities.check_mixed(component)
    part = region(lens, flares, field, LightBudget()).region
    optics = field_optics(lens, field, flares)
    notes = [*optics.sensor.notes, *optics.notes, *kernel_notes(lens, optics, _margin(field))]
    error_allowed = CONVOLUTION * response.error_allowed if response else 0.0
    return LensPlan(lens, flares, part, optics, error_allowed, response, *_sorted(notes))


def _sorted(notes: list[Note]) -> tuple[tuple[ErrorTerm, ...], tuple[LeftOut, ...]]:
    """Return (error terms, omissions) of notes."""
    terms = tuple(note for note in notes if isinstance(note, ErrorTerm))
    return terms, tuple(note for note in notes if isinstance(note, LeftOut))


def _remaining_response(view: WindowView, faint: float) -> Response:
    """Return the response with the allowed share of its noise that remains for the convolutions.

    `faint` is the share that omitted ghosts use.
    """
    allowed = view.response.noise_fraction_allowed
    used = view.optics.noise_share + truncation_noise_share(view.optics.kernels) + faint
    remaining = max(allowed - used, LEFT * allowed, min(allowed, NOT_WORTH * used))
    return replace(view.response, noise_fraction_allowed=remaining)


def _widest_rad(mixed: xr.DataArray) -> float:
    """Return the largest field angle of a field's tiles, rad."""
    x, y = (np.abs(mixed[d].values).max() for d in ("x", "y"))
    return float(angle_rad(x, y, projection_of(mixed)))


def _margin(mixed: xr.DataArray) -> Margin:
    """Return the overscan: the tiles of a field beyond the sensors' window, or else beyond the
    camera's field.
    """
    if beyond := mixed.attrs.get("tiles_beyond"):
        return Margin(beyond, of_window=True)
    full = quantities.full_field(mixed)[::-1]
    field = [mixed.attrs.get(k) or n for k, n in zip(("field_height", "field_width"), full)]
    pitch = [quantities.tile_pitch(mixed, d) for d in ("y", "x")]
    return Margin(tuple((n - w / p) / 2 for n, w, p in zip(mixed.shape[1:], field, pitch)))
