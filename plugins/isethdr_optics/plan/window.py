"""Window: what a lens takes of the field, and makes light of, for sensors that see a window of the
image plane only.

Two bounds leave out tiles beyond the window. Kernels that end at a reach take nothing from beyond
it: their bound (`wing_truncation`) is that of the whole field. Kernels of the full frame lose the
light that tiles beyond some reach would send into the window: at most the brightest of them x the
energy of the kernel beyond that reach. A bright lamp outside the window disables cropping; one
within the window does not.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core import quantities
from isethdr_core.demand import Response
from isethdr_core.ledger import Note
from isethdr_core.pipeline import window as core
from isethdr_core.plugins.protocols import AddsLight

from ..imaging import wing_truncation
from ..imaging.field_optics import FieldOptics, field_optics
from ..imaging.photoelectron_map import electrons
from ..imaging.sensor_plane import sensor_plane, without_geometry
from ..psf import kernels
from ..psf.error_parts import term
from ..pupil import sampled_pupil
from .region import UNSEEN, tiles_left_out

if TYPE_CHECKING:
    import xarray as xr

SHARE = 0.25  # of the error allowed of light
WORTH = 0.75  # of all tiles: more than this left is not worth a kernel that tells how many
SPARE = 1.1  # what one band tells of the others: the bound is checked with all of them
WHY = f"{UNSEEN}, and too little of their light spreads to one"


class Seen(NamedTuple):
    """What sensors see of a field."""

    tiles: dict[str, slice] | None  # of the field, {y, x}; None: all
    mixed: xr.DataArray  # their light
    optics: FieldOptics
    response: Response | None  # with the error that is left for the rest of the way
    notes: tuple[Note, ...] = ()  # what of the tiles is left out, and its error


def seen(lens, mixed, flares, response) -> Seen:
    """Return the tiles whose light a sensor of `response` can tell, and what the lens makes of
    them.

    All tiles are kept where the response states no window, where light is moved, drawn twice or
    spread unlike over the field, and where no bound says that tiles beyond are too dark.
    """
    plane = sensor_plane(lens, mixed)
    inner = _inner(lens, mixed, flares, response)
    found = None if inner is None else _without_dark(lens, mixed, flares, response, plane, inner)
    if found is None:
        optics = field_optics(lens, mixed, flares, response, plane)
        found, reach, share = Seen(None, mixed, optics, response), max(mixed.shape), 0.0
    else:
        found, reach, share = found
    if inner is not None and isinstance(found.optics.made, wing_truncation.NearKernels):
        # nothing from farther away is taken anyway
        found = _within_kernels(mixed, found, plane, inner, reach)
    unit, notes = wing_truncation.UNIT, []
    if found.tiles is not None:
        bound = share + wing_truncation.cut_noise_share(found.optics.made)
        notes.append(tiles_left_out(mixed.shape, found.mixed.shape, WHY, bound, unit))
    if share:
        label = "light of tiles beyond the window that sensors see, left out"
        notes.append(term(share, unit, "bound", label, key="tiles beyond the window"))
    return found._replace(notes=tuple(notes))


def _inner(lens, mixed, flares, response):
    """Return the slices {y, x} of the tiles that the window sees; None where all are kept."""
    if response is None or response.window_m is None or not lens.blurs or lens.field_varies:
        return None
    if (
        lens.distortion != "none"
        or lens.falloff == "traced"
        or lens.lateral_colour_percent
        or lens.lateral_colour != "none"
    ):
        return None
    if any(isinstance(flare, AddsLight) for flare in flares):
        return None
    inside = core.tiles(mixed, [side / (1e-3 * lens.focal_length_mm) for side in response.window_m])
    return None if core.cut(mixed, inside) is mixed else inside


def _without_dark(lens, mixed, flares, response, plane, inner):
    """Return (`Seen`, reach, bound) without tiles so far out, and so dark, that the sensor cannot
    tell; None where none are.
    """
    plain, wave, frame = (
        without_geometry(lens),
        mixed.wavelength.values.astype(float),
        mixed.shape[1:],
    )
    most = _largest_reach(inner, frame)
    if most < 0:
        return None
    relative = plane.relative
    pitch_um = tuple(
        1e3 * lens.focal_length_mm * quantities.tile_pitch(mixed, d) for d in ("y", "x")
    )
    light = wing_truncation.Light(
        np.asarray(mixed.values)[:, inner["y"], inner["x"]],
        relative[inner["y"], inner["x"]] if np.ndim(relative) else relative,
        lens.gains_sr(wave) * electrons(response, wave),
        response,
    )
    brightest, allowed = (
        _brightest(mixed, inner, float(np.max(relative))),
        SHARE * response.noise_fraction_allowed,
    )
    edges = (
        wing_truncation.EDGES
        * wave
        / wave[0]
        * sampled_pupil.blur_um(plain, wave[0])
        / ((most + 1) * max(pitch_um))
    )
    if (
        light.share(2 * edges, most=brightest(most)) > allowed
    ):  # no stop is without them: nothing has to be made to find out
        return None
    probe = kernels.kernels(
        plain, flares, wave[-1:], pitch_um, tuple(min(most, n - 1) for n in frame)
    )
    guess = SPARE * wave / wave[-1]
    reach = bisect_left(
        range(most + 1),
        -allowed,
        key=lambda r: -light.share(2 * guess * _beyond(probe.bands[0], r), most=brightest(r)),
    )
    if reach > most:
        return None
    tiles, part = _cut(mixed, inner, (reach, reach))
    left = replace(response, noise_fraction_allowed=(1 - SHARE) * response.noise_fraction_allowed)
    given = field_optics(lens, part, flares, left, plane.of_tiles(tiles))
    made, loss = given.made, given.made.transmitted if lens.aperture_loss else 1.0
    outside = np.array([_beyond(b, reach) for b in made.bands])
    centre = np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in made.bands], float)
    share = light.share(2 * outside * loss, centre * loss, everywhere=True, most=brightest(reach))
    if share > allowed:
        return None
    return Seen(tiles, part, given, left), reach, share


def _within_kernels(mixed, found: Seen, plane, inner, reach) -> Seen:
    """Return those tiles, `reach` beyond the window at most, that kernels take light for the window
    from.
    """
    given = found.optics
    tiles, near = _cut(mixed, inner, [min(n // 2, reach) for n in given.made.bands[0].shape])
    if near.shape == found.mixed.shape:
        return found
    plane = plane.of_tiles(tiles)
    relative = plane.relative if np.ndim(plane.relative) else None
    made = replace(given.made, frame=near.shape[1:])
    optics = replace(given, sensor=plane, made=made, relative=relative, counted=None)
    return Seen(tiles, near, optics, found.response)


def _cut(mixed, inner, reach):
    """Return the tiles within `reach` (y, x) of a window, {y, x} or None for all of them, and their
    mixed radiance.

    Attribute `tiles_beyond` : (y, x) from the window to where the light ends that is known.
    """
    tiles = {
        d: slice(max(inner[d].start - r, 0), min(inner[d].stop + r, mixed.sizes[d]))
        for d, r in zip(("y", "x"), reach)
    }
    part = core.cut(mixed, tiles)
    if part is mixed:
        return None, mixed
    beyond = tuple(min(inner[d].start, mixed.sizes[d] - inner[d].stop) for d in ("y", "x"))
    return tiles, part.assign_attrs(tiles_beyond=beyond)


def _largest_reach(inner, frame) -> int:
    """Return how many tiles beyond the window may stay where that is to be worth while; -1 where
    none may.
    """
    reach = -1
    sides = [(inner[d].start, inner[d].stop, n) for d, n in zip(("y", "x"), frame)]
    while np.prod(
        [min(stop + reach + 1, n) - max(start - reach - 1, 0) for start, stop, n in sides]
    ) <= WORTH * np.prod(frame):
        reach += 1
    return reach


def _brightest(mixed, inner, factor):
    """Return function(reach) -> the brightest light, per band, of tiles farther than `reach` from
    the window.
    """
    rows, columns = (mixed.values.max(axis=axis) for axis in (2, 1))

    def brightest(reach):
        beyond = [
            side
            for d, most in (("y", rows), ("x", columns))
            for side in (
                most[:, : max(inner[d].start - reach, 0)],
                most[:, inner[d].stop + reach :],
            )
        ]
        return np.concatenate(beyond, axis=1).max(axis=1, initial=0.0).astype(float) * factor

    return brightest


def _beyond(kernel, reach) -> float:
    """Return the energy that a kernel has farther than `reach` tiles from its middle, along either
    axis.
    """
    return 1 - float(
        kernel[tuple(slice(max(n // 2 - reach, 0), n // 2 + reach + 1) for n in kernel.shape)].sum(
            dtype=float
        )
    )
