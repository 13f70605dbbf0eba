"""Kernel statements: what the kernels of a field are wrong by, and what they leave out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from isethdr_core.ledger import LeftOut, Note
from isethdr_core.uncertainty.error_terms import ErrorTerm, Quantity

from ..psf.error_parts import FAR_PERIOD, POINT_SPREAD, SPECKLE, SPREAD, term
from ..pupil import sampled_pupil
from . import wing_truncation
from .field_optics import FieldOptics


class Margin(NamedTuple):
    """Tiles of a field beyond what sensors see."""

    tiles: tuple[float, float]  # (y, x), on each side
    of_window: bool = False  # beyond the sensors' window, else beyond the camera's field


def kernel_notes(lens, given: FieldOptics, margin: Margin) -> list[Note]:
    """Return the errors of the kernels of a field with some margin, and what they leave out."""
    made = given.made
    if made is None:
        # of the product, and once more where tiles are moved
        rounding = float(np.finfo(np.float32).eps)
        label = "irradiance of tiles: no blur, a product, rounded to float32"
        return [term(rounding, "relative", "bound", label, key="rounding")]
    notes: list[Note] = [*_where_kernels_end(made)]
    for octave, error in enumerate(made.speckle.max(axis=0) if made.speckle.any() else ()):
        if error > 0:
            label = f"speckle of the kernel {2**octave} to {2 ** (octave + 1)} tiles from a lamp"
            notes.append(term(error, "relative", "statistical", label, key=SPECKLE, part=SPREAD))
    if lens.blurs and lens.zernike_um:
        cells = term(
            sampled_pupil.CELLS,
            "fraction of energy",
            "measured",
            "point spread near the axis, from cells of a pupil with a wavefront",
            key="cells of the pupil",
            acts_on=Quantity.OTHER,
            part=POINT_SPREAD,
        )
        notes.append(cells)
    if made.wrap:
        label = "kernel near the border of the frame, from the period of its far field"
        notes.append(term(made.wrap, "relative", "measured", label, key=FAR_PERIOD, part=SPREAD))
    if given.sensor.stretched:
        notes.append(_drawn_out(given.sensor.stretched))
    far = max(
        float(profile[: max(len(profile) // 2 - int(m), 0)].sum())
        for both in made.profiles
        for profile, m in zip(both, margin.tiles)
    )
    far += max(float(made.outside.max()), 0.0) * (
        isinstance(made, wing_truncation.NearKernels) or margin.of_window
    )
    beyond = LeftOut(
        "light from beyond the rendered margin",
        "not in the scene radiance",
        far,
        "fraction of a lamp there, into the field",
    )
    return [*notes, beyond]


def _where_kernels_end(made) -> list[Note]:
    """Return what of the light goes farther than kernels reach."""
    if isinstance(made, wing_truncation.NearKernels):
        return wing_truncation.notes(made)
    outside = term(
        max(float(made.outside.max()), 0.0),
        "fraction of energy",
        "measured",
        "light spread beyond the rendered frame",
        key="beyond the frame",
        acts_on=Quantity.OTHER,
        part=POINT_SPREAD,
    )
    return [outside]


def _drawn_out(stretched: float) -> ErrorTerm:
    """Return the error of point spread functions that are made for the axis and the reference
    wavelength, and drawn out with the image.

    A kernel k(r) drawn out by s is k(r / s) / s^2. Its wings fall with the cube of r (Airy), so
    that they are wrong by s - 1: an error of the spread light. Light that comes straight keeps its
    place and its sum.
    """
    label = "size of the point spread, drawn out as the image is"
    return term(stretched, "relative", "measured", label, key="point spread size", part=SPREAD)
