"""Pupil shapes: the stop and the flares of a lens as one sum of exact shapes."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.pupil import disc, shape_sum
from isethdr_core.plugins.protocols import TransmitsPupil

from ..abilities import DrawsPupil
from .pupil_size import radius_mm

if TYPE_CHECKING:
    from isethdr_core.physics.optics.pupil import Convex
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

# Number of grains and scratches in the square around a pupil, over `shape_sum.MOST_TERMS`, that can
# usually be drawn: usual dirt makes 1.2 terms for each of them.
DRAWN_EASILY = 0.7
ANY_NM = 550.0  # any wavelength, nm: shapes overlap in the same way at all wavelengths

_overlaps = lru_cache(maxsize=16)(shape_sum.overlaps)


def all_shapes(flares: Sequence[Flare]) -> bool:
    """Return whether every flare that changes the pupil states exact shapes."""
    return all(isinstance(f, DrawsPupil) or not isinstance(f, TransmitsPupil) for f in flares)


def opening_and_dirt(lens: PupilOptics, flares: Sequence[Flare]) -> tuple:
    """Return (opening, dirt): the stop within all rims and irises, and the dirt of all flares.

    Dirt is ((shape, loss), ...) or ((shape, loss, delay), ...): a convex shape in mm, 1 - amplitude
    transmission, and the optical path difference, um, that it adds.
    """
    shapes_of_flares = [
        f.pupil_shapes(radius_mm(lens)) for f in flares if isinstance(f, DrawsPupil)
    ]
    opening = disc(0.0, 0.0, radius_mm(lens))
    for rim in lens.rims:
        opening = opening & disc(*(radius_mm(lens) * v for v in rim))
    for iris, _ in shapes_of_flares:
        opening = opening & iris
    return opening, tuple(loss for _, dirt in shapes_of_flares for loss in dirt)


def check_dirt(lens: PupilOptics, flares: Sequence[Flare]) -> None:
    """Refuse dirt with too many overlaps to be drawn, before any other work.

    The overlaps are computed only if there are many grains and scratches, because this takes
    seconds. A few large ones that overlap too often are refused later, when the pupil is drawn.

    Raises
    ------
    ConfigError : more dirt than can be drawn.
    """
    if len(opening_and_dirt(lens, flares)[1]) > DRAWN_EASILY * shape_sum.MOST_TERMS:
        terms(lens, flares, ANY_NM)


def terms(lens: PupilOptics, flares: Sequence[Flare], wavelength_nm: float | None = None) -> list:
    """Return the stop and all flares with shapes as one sum of (shape, weight), shapes in mm.

    Weights are complex if dirt delays light.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    wavelength_nm : wavelength, nm, for dirt that delays light; may be None if no dirt does.

    Raises
    ------
    ConfigError : dirt with too many overlaps.
    """
    opening, dirt = opening_and_dirt(lens, flares)
    try:
        return _terms(opening, dirt, wavelength_nm if _delays(dirt) else None, lens.pupil_matrix)
    except ValueError as err:
        square_mm2 = (2 * radius_mm(lens)) ** 2
        allowed = min(DRAWN_EASILY * shape_sum.MOST_TERMS, len(dirt) / 2) / square_mm2
        raise ConfigError(
            f"{err}; this pupil is {2 * radius_mm(lens):.3g} mm wide: expected at most about"
            f" {allowed:.2g} grains and scratches per mm2; type for example"
            f" flare.NAME.dust_per_mm2={0.8 * allowed:.2g}"
            f" flare.NAME.scratches_per_mm2={0.2 * allowed:.2g}, or a larger lens.f_number"
        ) from None


@lru_cache(maxsize=16)
def _terms(
    opening: Convex,
    dirt: Sequence[Any],
    wavelength_nm: float | None,
    pupil_matrix: tuple[tuple[float, float], tuple[float, float]] | None,
) -> list[tuple[Convex, complex]]:
    parts = _overlaps(opening, tuple(d[0] for d in dirt))
    if pupil_matrix is not None:
        parts = [(part.mapped(pupil_matrix), shapes_inside) for part, shapes_inside in parts]
    return shape_sum.weighted(parts, [_loss(*d[1:], wavelength_nm=wavelength_nm) for d in dirt])


def _loss(loss: float, delay_um: float = 0.0, *, wavelength_nm: float | None) -> complex:
    """Return 1 - amplitude transmission of one shape of dirt; complex if it delays light."""
    return (
        1 - (1 - loss) * cmath.exp(2j * cmath.pi * 1e3 * delay_um / wavelength_nm)
        if delay_um
        else loss
    )


def delays_um(lens: PupilOptics, flares: Sequence[Flare]) -> set[float]:
    """Return the optical path differences, um, that shapes of dirt add; empty if no dirt delays
    light.
    """
    return _delays(opening_and_dirt(lens, flares)[1])


def _delays(dirt: tuple[Any, ...]) -> set[Any] | set[float]:
    return {d[2] for d in dirt if len(d) > 2 and d[2]}
