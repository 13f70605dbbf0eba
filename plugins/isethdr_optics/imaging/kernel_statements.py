"""Kernel statements: errors of the kernels of a field, and the light that they leave out."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.ledger import LeftOut, Note
from isethdr_core.uncertainty.error_terms import ErrorTerm, Quantity

from ..psf.error_parts import FAR_PERIOD, POINT_SPREAD, SPECKLE, SPREAD, term
from ..pupil import fine_cells
from . import wing_truncation
from .field_optics import FieldOptics

if TYPE_CHECKING:
    from ..abilities import LensOptics
    from ..psf.kernels import Kernels


class Margin(NamedTuple):
    """Overscan: tiles of a field beyond those that sensors see."""

    tiles: tuple[float, float]  # (y, x), on each side
    of_window: bool = False  # True: beyond the sensors' window; False: beyond the camera's field


def kernel_notes(lens: LensOptics, optics: FieldOptics, margin: Margin) -> list[Note]:
    """Return the errors of the kernels of a field, and the light that they leave out.

    Parameters
    ----------
    lens : a lens of this package.
    optics : optics of the field.
    margin : tiles of the field that the sensors do not see.
    """
    kernels = optics.kernels
    if kernels is None:
        # twice the rounding of one operation: the product, and the distortion that moves tiles
        rounding = float(np.finfo(np.float32).eps)
        label = "irradiance of tiles: no blur, a product, rounded to float32"
        return [term(rounding, "relative", "bound", label, key="rounding")]
    notes: list[Note] = [*_light_beyond_kernels(kernels)]
    for octave, error in enumerate(kernels.speckle.max(axis=0) if kernels.speckle.any() else ()):
        if error > 0:
            label = f"sampling of the kernel {2**octave} to {2 ** (octave + 1)} tiles from a lamp"
            notes.append(term(error, "relative", "statistical", label, key=SPECKLE, part=SPREAD))
    if lens.blurs and lens.zernike_um:
        cells = term(
            fine_cells.CELL_ERROR,
            "fraction of energy",
            "measured",
            "point spread near the axis, finite cells of a pupil with a wavefront",
            key="cells of the pupil",
            acts_on=Quantity.OTHER,
            part=POINT_SPREAD,
        )
        notes.append(cells)
    if kernels.wrap:
        label = "kernel near the border of the frame, period of its computed pattern"
        notes.append(term(kernels.wrap, "relative", "measured", label, key=FAR_PERIOD, part=SPREAD))
    if optics.sensor.stretched:
        notes.append(_stretched_image_error(optics.sensor.stretched))
    share_beyond = max(
        float(profile[: max(len(profile) // 2 - int(m), 0)].sum())
        for both in kernels.profiles
        for profile, m in zip(both, margin.tiles)
    )
    share_beyond += max(float(kernels.outside.max()), 0.0) * (
        isinstance(kernels, wing_truncation.TruncatedKernels) or margin.of_window
    )
    beyond = LeftOut(
        "light from beyond the rendered margin",
        "not in the scene radiance",
        share_beyond,
        "fraction of a lamp there, into the field",
    )
    return [*notes, beyond]


def _light_beyond_kernels(kernels: Kernels) -> list[Note]:
    """Return the share of the light that falls beyond the kernels."""
    if isinstance(kernels, wing_truncation.TruncatedKernels):
        return wing_truncation.notes(kernels)
    outside = term(
        max(float(kernels.outside.max()), 0.0),
        "fraction of energy",
        "measured",
        "light spread beyond the rendered frame",
        key="beyond the frame",
        acts_on=Quantity.OTHER,
        part=POINT_SPREAD,
    )
    return [outside]


def _stretched_image_error(stretched: float) -> ErrorTerm:
    """Return the error of the axis' point spread function, which distortion stretches with the
    image.

    A kernel k(r) stretched by s is k(r / s) / s^2. Its wings fall with the cube of r (Airy), so
    that their relative error is s - 1. Only spread light has this error; the position and the sum
    of direct light are not affected.
    """
    label = "size of the point spread, stretched with the image"
    return term(stretched, "relative", "measured", label, key="point spread size", part=SPREAD)
