"""Kernel statements: what the kernels of a field are wrong by, and what they leave out, for the
ledger.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.uncertainty.error_terms import Quantity

from ..psf.error_parts import FAR_PERIOD, SPECKLE, SPREAD
from ..pupil import sampled_pupil
from . import wing_truncation
from .field_optics import FieldOptics


class Margin(NamedTuple):
    """Tiles of a field beyond what sensors see."""

    tiles: tuple[float, float]  # (y, x), on each side
    of_window: bool = False  # beyond the sensors' window, else beyond the camera's field


def state_kernels(lens, given: FieldOptics, margin: Margin) -> None:
    """State in the ledger the errors of the kernels of a field with some margin."""
    made = given.made
    if made is None:
        rounding = float(
            np.finfo(np.float32).eps
        )  # of the product, and once more where tiles are moved
        ledger.error(
            rounding,
            "relative",
            "bound",
            "irradiance of tiles: no blur, a product, rounded to float32",
            key="rounding",
        )
        return
    if isinstance(made, wing_truncation.NearKernels):
        wing_truncation.state(made)
    else:
        ledger.error(
            max(float(made.outside.max()), 0.0),
            "fraction of energy",
            "measured",
            "light spread beyond the rendered frame",
            key="beyond the frame",
            acts_on=Quantity.POINT_SPREAD,
        )
    for octave, error in enumerate(made.speckle.max(axis=0) if made.speckle.any() else ()):
        if error > 0:
            label = f"speckle of the kernel {2**octave} to {2 ** (octave + 1)} tiles from a lamp"
            ledger.error(error, "relative", "statistical", label, key=SPECKLE, part=SPREAD)
    if lens.blurs and lens.zernike_um:
        ledger.error(
            sampled_pupil.CELLS,
            "fraction of energy",
            "measured",
            "point spread near the axis, from cells of a pupil with a wavefront",
            key="cells of the pupil",
            acts_on=Quantity.POINT_SPREAD,
        )
    if made.wrap:
        label = "kernel near the border of the frame, from the period of its far field"
        ledger.error(made.wrap, "relative", "measured", label, key=FAR_PERIOD, part=SPREAD)
    if given.sensor.stretched:
        _state_drawn_out(given.sensor.stretched)
    far = max(
        float(profile[: max(len(profile) // 2 - int(m), 0)].sum())
        for both in made.profiles
        for profile, m in zip(both, margin.tiles)
    )
    far += max(float(made.outside.max()), 0.0) * (
        isinstance(made, wing_truncation.NearKernels) or margin.of_window
    )
    ledger.left_out(
        "light from beyond the rendered margin",
        "not in the scene radiance",
        far,
        "fraction of a lamp there, into the field",
    )


def _state_drawn_out(stretched: float) -> None:
    """State that point spread functions are made for the axis and the reference wavelength, and
    drawn out with the image.

    A kernel k(r) drawn out by s is k(r / s) / s^2. Its wings fall with the cube of r (Airy), so
    that they are wrong by s - 1: an error of the spread light. Light that comes straight keeps its
    place and its sum.
    """
    label = "size of the point spread, drawn out as the image is"
    ledger.error(stretched, "relative", "measured", label, key="point spread size", part=SPREAD)
