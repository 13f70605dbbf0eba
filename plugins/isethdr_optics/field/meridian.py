"""Meridian: a lens with a varying point spread, at field points along +x of the field."""

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

ALONG = 9  # number of field points, from the axis to the border of the field, that are compared
ROUND = 1e-6  # largest deviation of a pupil from a circle that counts as round, radii of the stop


class Meridian(NamedTuple):
    """A lens at field points along +x of the field, and its symmetry about the axis."""

    along: list  # lenses of field points from the axis to the border of the field
    references_nm: list[float]  # wavelengths at which field points are chosen, in rising order
    symmetric: bool  # point spreads are round: one field point represents a ring
    mirrors: bool  # point spreads of one quadrant, mirrored, give those of the others


def meridian(
    lens: PupilOptics,
    flares: Sequence[Flare],
    angles_rad: Sequence[float],
    wavelength_nm: np.ndarray,
) -> Meridian:
    """Return a lens with a varying point spread at field points along +x of the field.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    angles_rad : field angles from 0 to the border of the field, rad.
    wavelength_nm : centres of the bands, nm.

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
    """Return whether the pupil of a field point is an ellipse."""
    matrix = np.array(place.pupil_matrix if place.pupil_matrix is not None else np.eye(2))
    return not np.allclose(matrix, matrix[0, 0] * np.eye(2), rtol=0, atol=ROUND)


def _shaped(flares: Sequence[Flare]) -> bool:
    return any(isinstance(f, TransmitsPupil | DrawsPupil) for f in flares)
