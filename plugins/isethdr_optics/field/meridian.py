"""Meridian: a lens whose point spread varies, as light along +x of the field sees it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.plugins.protocols import TransmitsPupil

from ..abilities import DrawsPupil
from . import grid
from .reference_bands import references_nm

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

ALONG = 9  # field points from the axis to the border of the field, at which a lens is looked at
ROUND = 1e-6  # radii of the stop, by which a round pupil may be off


class Meridian(NamedTuple):
    """A lens as light along +x of the field sees it, and what of that holds around the axis."""

    along: list  # lenses of field points from the axis to the border of the field
    references_nm: list[float]  # wavelengths at which field points are chosen, rising
    symmetric: bool  # point spreads are round: one field point stands for a ring
    mirrors: bool  # a quadrant of the field holds all point spreads


def meridian(
    lens: PupilOptics,
    flares: Sequence[Flare],
    angles_rad: Sequence[float],
    wavelength_nm: np.ndarray,
) -> Meridian:
    """Return a lens whose point spread varies, along +x of the field.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    angles_rad : off the axis, from 0 to the border of the field.
    wavelength_nm : of the bands.

    Raises
    ------
    ConfigError : the field reaches beyond the field angles of the wavefront.
    """
    along = [lens.at_place(angle, 0.0) for angle in angles_rad]
    wavefronts = [lens.wavefront_at(angle) for angle in angles_rad]
    terms = [*wavefronts, *(dict(at.uneven) for at in along)]
    symmetric = grid.is_symmetric(terms) and not any(at.rims or _stretched(at) for at in along)
    mirrors = (
        grid.is_symmetric([lens.zernike_um or {}])
        and grid.is_mirrored(wavefronts)
        and not _shaped(flares)
    )
    return Meridian(along, references_nm(along[-1], wavelength_nm), symmetric, mirrors)


def _stretched(place: PupilOptics) -> bool:
    """Return whether the pupil of a place is an ellipse."""
    matrix = np.array(place.pupil_matrix if place.pupil_matrix is not None else np.eye(2))
    return not np.allclose(matrix, matrix[0, 0] * np.eye(2), rtol=0, atol=ROUND)


def _shaped(flares: Sequence[Flare]) -> bool:
    return any(isinstance(f, TransmitsPupil | DrawsPupil) for f in flares)
