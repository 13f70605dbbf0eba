"""Field points at which a point spread is computed, against a point spread for every tile."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_optics import WavefrontLens
from isethdr_optics.field import grid, point_choice
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.psf import kernels
from isethdr_optics.psf.kernels import KernelRequest
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core import quantities

from .changed import changed

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Lens

SHAPE = (21, 29)  # tiles; so few that the exact core of a kernel covers all of them
PITCH = 0.0015  # width of a tile, tangents of the field angle: 6 um behind a lens of 4 mm
BAND_NM = 550.0
# {field angle, degrees: {Zernike term: um}}: coma and astigmatism that grow with the field angle
FIELD_ZERNIKE_UM = {
    0: {},
    2: {8: 0.16, 5: 0.08},
}
RINGS = (0, 1, 2, 3, 4, 6)
PATCHES = (2, 4)  # numbers of rings, where each tile takes the point spread of the nearest place
DECADES = 3.0  # range of the light, evenly spread over the field so that every part of it counts


def measured() -> list[Work]:
    """Return one diagram: error of an image for several numbers of rings of field points. Kernels
    are computed anew each time.
    """
    lens = WavefrontLens(field_zernike_um=FIELD_ZERNIKE_UM, falloff="none")
    mixed = night()
    truth = one_per_tile(lens, mixed)
    points = []

    def point(name: str, rings: Any, share: Any = grid.weight, mark: str = "") -> None:
        with changed(point_choice, RINGS=rings), changed(grid, weight=share):
            light, cpu_s, peak_mb = timed(lambda: anew(lens, mixed), repeat=1)
        points.append(
            Point(name, float(np.abs(light - truth).sum() / truth.sum()), cpu_s, peak_mb, mark)
        )

    for rings in RINGS:
        count = len(grid.places(rings, 1.0, False))
        point(
            f"{rings} ring{'s' * (rings > 1)}, {count} field points" if rings else "one for all",
            (rings,),
            mark="" if rings else "peer",
        )
    for rings in PATCHES:
        point(f"{rings} rings, nearest field point", (rings,), nearest, "peer")
    point(f"chosen by the lens, {lens.error_allowed:g} allowed", point_choice.RINGS, mark="default")
    return [
        Work(
            "field",
            "error of the image, L1, over its light",
            "one point spread per tile, direct sums",
            1e-7,
            points,
        )
    ]


def night() -> xr.DataArray:
    """Return mixed radiance of one band. Its tiles are random over `DECADES`."""
    light = 10.0 ** (DECADES * np.random.default_rng(0).random((1, *SHAPE)))
    y, x = (quantities.centres(n, n * PITCH) for n in SHAPE)
    return quantities.plane(light, [BAND_NM], x, y, quantities.RADIANCE)


def one_per_tile(lens: Lens, mixed: xr.DataArray) -> np.ndarray:
    """Return irradiance (y, x), summed tile by tile. The light of every tile is spread by the
    kernel of its own wavefront.
    """
    x = mixed.x.values
    y = mixed.y.values
    pitch_um = (1e3 * lens.focal_length_mm * PITCH,) * 2
    reach = tuple(n - 1 for n in SHAPE)
    known = {}
    out = np.zeros(SHAPE)
    for row, column in np.ndindex(*SHAPE):
        position = grid.Place(
            0, float(np.hypot(x[column], y[row])), float(np.arctan2(-y[row], x[column])), 1
        )
        # the lens is symmetric: a quarter of the tiles is enough
        quadrant_position, flips = grid.first_quadrant(position)
        key = abs(2 * row - SHAPE[0] + 1), abs(2 * column - SHAPE[1] + 1)
        if key not in known:
            at = node_lens(
                lens,
                lens.wavefront_at(float(np.arctan(quadrant_position.radius))),
                quadrant_position.azimuth_rad,
            )
            kernels.forget()
            known[key] = (
                kernels.kernels(KernelRequest(at, (), [BAND_NM], pitch_um, reach))
                .bands[0]
                .astype(float)
            )
        kernel = np.flip(known[key], flips)
        top = SHAPE[0] - 1 - row
        left = SHAPE[1] - 1 - column
        out += mixed.values[0, row, column] * kernel[top : top + SHAPE[0], left : left + SHAPE[1]]
    return out * lens.throughput_sr()


def anew(lens: Lens, mixed: xr.DataArray) -> np.ndarray:
    """Return irradiance (y, x), with all kernels computed anew."""
    kernels.forget()
    return lens(mixed).values[0].astype(float)


def nearest(field_point: Any, step: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return a mask (y, x): 1 where `field_point` is the nearest point of the polar grid, else 0.

    Parameters
    ----------
    field_point : point of the polar grid.
    step : distance between the rings of the grid, tangents of the field angle.
    x, y : (x,) and (y,) tile centres, tangents of the field angle.
    """
    u = np.asarray(x, float)[None, :]
    v = np.asarray(y, float)[:, None]
    ring = np.rint(np.hypot(u, v) / step) == round(field_point.radius / step)
    if field_point.count == 1:
        return ring.astype(float)
    sector = np.rint(np.arctan2(-v, u) / (2 * np.pi) * field_point.count) % field_point.count
    return (
        ring
        & (
            sector
            == round(field_point.azimuth_rad / (2 * np.pi) * field_point.count) % field_point.count
        )
    ).astype(float)
