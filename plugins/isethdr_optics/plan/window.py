"""Window: the tiles of a field that are needed for sensors that see only a window of the image
plane.

Two bounds allow tiles outside the window to be left out. Truncated kernels bring no light from
beyond their reach: their bound (`wing_truncation`) holds for the whole field. With kernels of the
full frame, the light is lost that tiles beyond some reach would send into the window. It is at most
the light of the brightest such tile times the energy of the kernel beyond that reach. A bright lamp
outside the window therefore disables cropping; a lamp within it does not.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

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
from ..pupil import pupil_size
from .region import UNSEEN, tiles_left_out

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.physics.convolution.mirrored import Mirrored
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics, PupilOptics
    from ..imaging.sensor_plane import SensorPlane

SHARE = 0.25  # share of the light's allowed error that cropping may use
# largest share of all tiles that may remain: with more, cropping saves less than its kernel costs
WORTH = 0.75
GUESS_FACTOR = 1.1  # safety factor of an estimate from one band; all bands are checked afterwards
WHY = f"{UNSEEN}, and too little of their light spreads to one"


class WindowView(NamedTuple):
    """The part of a field that sensors need, and its optics."""

    tiles: dict[str, slice] | None  # {y, x} slices of the field; None: all tiles
    mixed: xr.DataArray  # light of these tiles
    optics: FieldOptics
    response: Response | None  # response with the allowed error that remains for the convolutions
    notes: tuple[Note, ...] = ()  # the tiles that are left out, and the error of this


def window_view(
    lens: LensOptics, mixed: xr.DataArray, flares: Sequence[Flare], response: Response | None
) -> WindowView:
    """Return the tiles that sensors of `response` need, and their optics.

    All tiles are kept in these cases: the response states no window; the lens has distortion,
    lateral colour, traced relative illumination or kernels that vary over the field; a flare adds
    light; or the tiles outside the window are too bright.

    Parameters
    ----------
    lens : a lens of this package.
    mixed : mixed radiance (wavelength, y, x).
    flares : flare components of the lens.
    response : `isethdr_core.demand.Response` of the sensors, or None.
    """
    plane = sensor_plane(lens, mixed)
    inner = _window_tiles(lens, mixed, flares, response)
    view = (
        None if inner is None else _without_dark_tiles(lens, mixed, flares, response, plane, inner)
    )
    if view is None:
        optics = field_optics(lens, mixed, flares, response, plane)
        view = WindowView(None, mixed, optics, response)
        reach = max(mixed.shape)
        share = 0.0
    else:
        view, reach, share = view
    if inner is not None and isinstance(view.optics.kernels, wing_truncation.TruncatedKernels):
        # truncated kernels bring no light from farther away
        view = _within_kernels(mixed, view, plane, inner, reach)
    unit = wing_truncation.UNIT
    notes = []
    if view.tiles is not None:
        bound = share + wing_truncation.truncation_noise_share(view.optics.kernels)
        notes.append(tiles_left_out(mixed.shape, view.mixed.shape, WHY, bound, unit))
    if share:
        label = "light of tiles beyond the window that sensors see, left out"
        notes.append(term(share, unit, "bound", label, key="tiles beyond the window"))
    return view._replace(notes=tuple(notes))


def _window_tiles(
    lens: LensOptics, mixed: xr.DataArray, flares: Sequence[Flare], response: Response | None
) -> Any | None:
    """Return the slices {y, x} of the tiles in the window; None if all tiles are kept."""
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


def _without_dark_tiles(
    lens: PupilOptics,
    mixed: xr.DataArray,
    flares: Sequence[Flare],
    response: Response,
    plane: SensorPlane,
    inner: Any,
) -> tuple[WindowView, int, float] | None:
    """Return (`WindowView`, reach, bound) without distant dark tiles; None if all tiles are needed.

    The reach is in tiles from the window. The bound is the error over the sensor's noise.
    """
    axis_lens = without_geometry(lens)
    wave = mixed.wavelength.values.astype(float)
    frame = mixed.shape[1:]
    largest_reach = _largest_reach(inner, frame)
    if largest_reach < 0:
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
    brightest = _brightest(mixed, inner, float(np.max(relative)))
    allowed = SHARE * response.noise_fraction_allowed
    edges = (
        wing_truncation.EDGES
        * wave
        / wave[0]
        * pupil_size.blur_um(axis_lens, wave[0])
        / ((largest_reach + 1) * max(pitch_um))
    )
    # every stop spreads at least this share of the light; it is known without a kernel
    if light.share(2 * edges, most=brightest(largest_reach)) > allowed:
        return None
    reach_of_probe = tuple(min(largest_reach, n - 1) for n in frame)
    probe = kernels.kernels(
        kernels.KernelRequest(axis_lens, flares, wave[-1:], pitch_um, reach_of_probe)
    )
    guess = GUESS_FACTOR * wave / wave[-1]
    reach = bisect_left(
        range(largest_reach + 1),
        -allowed,
        key=lambda r: -light.share(2 * guess * _beyond(probe.bands[0], r), most=brightest(r)),
    )
    if reach > largest_reach:
        return None
    tiles, near = _tiles_around(mixed, inner, (reach, reach))
    remaining = replace(
        response, noise_fraction_allowed=(1 - SHARE) * response.noise_fraction_allowed
    )
    optics = field_optics(lens, near, flares, remaining, plane.of_tiles(tiles))
    kernels_of_part = optics.kernels
    aperture_share = optics.kernels.transmitted if lens.aperture_loss else 1.0
    outside = np.array([_beyond(b, reach) for b in kernels_of_part.bands])
    centre = np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in kernels_of_part.bands], float)
    share = light.share(
        2 * outside * aperture_share,
        centre * aperture_share,
        everywhere=True,
        most=brightest(reach),
    )
    if share > allowed:
        return None
    return WindowView(tiles, near, optics, remaining), reach, share


def _within_kernels(
    mixed: xr.DataArray, view: WindowView, plane: SensorPlane, inner: Any, reach: int
) -> WindowView:
    """Return the view of the tiles within the kernels' reach, at most `reach` from the window."""
    optics_of_view = view.optics
    tiles, near = _tiles_around(
        mixed, inner, [min(n // 2, reach) for n in optics_of_view.kernels.bands[0].shape]
    )
    if near.shape == view.mixed.shape:
        return view
    plane = plane.of_tiles(tiles)
    relative = plane.relative if np.ndim(plane.relative) else None
    kernels_of_near = replace(optics_of_view.kernels, frame=near.shape[1:])
    optics_of_near = replace(
        optics_of_view, sensor=plane, kernels=kernels_of_near, relative=relative, electron_map=None
    )
    return WindowView(tiles, near, optics_of_near, view.response)


def _tiles_around(
    mixed: xr.DataArray, inner: dict[str, slice], reach: Sequence[int]
) -> tuple[dict[str, slice] | None, xr.DataArray]:
    """Return the tiles {y, x} within `reach` (y, x) of a window, None for all, and their radiance.

    The attribute `tiles_beyond` of the radiance is the number of tiles (y, x) beyond the window.
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


def _largest_reach(inner: Any, frame: tuple[int, int]) -> int:
    """Return the largest number of tiles around the window with which cropping still saves time; -1
    if it never does.
    """
    reach = -1
    sides = [(inner[d].start, inner[d].stop, n) for d, n in zip(("y", "x"), frame)]
    while np.prod(
        [min(stop + reach + 1, n) - max(start - reach - 1, 0) for start, stop, n in sides]
    ) <= WORTH * np.prod(frame):
        reach += 1
    return reach


def _brightest(mixed: xr.DataArray, inner: Any, factor: float) -> Callable[..., Any]:
    """Return function(reach) -> (band,) light of the brightest tile beyond `reach` tiles from the
    window. `factor` multiplies the light.
    """
    rows, columns = (mixed.values.max(axis=axis) for axis in (2, 1))

    def brightest(reach: int) -> np.ndarray:
        beyond = [
            side
            for d, maxima in (("y", rows), ("x", columns))
            for side in (
                maxima[:, : max(inner[d].start - reach, 0)],
                maxima[:, inner[d].stop + reach :],
            )
        ]
        return np.concatenate(beyond, axis=1).max(axis=1, initial=0.0).astype(float) * factor

    return brightest


def _beyond(kernel: Mirrored | np.ndarray, reach: int) -> float:
    """Return the energy of a kernel outside the square within `reach` tiles of its middle."""
    return 1 - float(
        kernel[tuple(slice(max(n // 2 - reach, 0), n // 2 + reach + 1) for n in kernel.shape)].sum(
            dtype=float
        )
    )
