"""White balance: colours as seen by an eye that has adapted to the light of the scene. For views
only, never part of a stage.

A picture holds the light itself: a wall in sodium light is orange. `balanced` converts it to its
appearance in daylight.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import UnitError
from ..extras import needed
from ..physics.colour.colour_spaces import D65_XYZ

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike


def balanced(xyz: ArrayLike, white_xyz: ArrayLike) -> np.ndarray:
    """Return XYZ (y, x, 3) adapted from a light to D65: its white becomes a neutral of the same
    luminance (von Kries 1902).

    Cone responses are Bradford's (Lam 1985; ICC.1:2010, annex E); colour-science computes the
    matrix.

    Parameters
    ----------
    xyz : (..., 3), any scale; negative estimates stay.
    white_xyz : (3,) XYZ of a white in the scene's light, any scale, such as a picture's attribute
        `white_xyz`, or `grey_world`.

    Raises
    ------
    UnitError : a white without light, or outside what cones can see.
    ConfigError : colour-science is not installed.
    """
    white = np.asarray(white_xyz, float)
    if white.shape != (3,) or not np.all(np.isfinite(white)) or not white[1] > 0:
        raise UnitError(
            f"white_xyz is {white_xyz!r}; expected XYZ of a white with Y above 0, such as"
            " picture.attrs['white_xyz']"
        )
    with needed("a white balanced view", extra="colour"):
        import colour

    white = white / white[1]
    cone_responses = colour.adaptation.CAT_BRADFORD @ white
    if not np.all(cone_responses > 0):
        raise UnitError(
            f"white_xyz {white_xyz!r} is no colour of light: its cone responses are"
            f" {cone_responses}; expected all above 0"
        )
    adapted = colour.adaptation.matrix_chromatic_adaptation_VonKries(
        white, D65_XYZ, transform="Bradford"
    )
    return np.asarray(xyz, float) @ adapted.T


def grey_world(picture: xr.Dataset, lamps: np.ndarray | None = None) -> np.ndarray:
    """Return XYZ with Y = 1 of the scene's light, estimated as the mean over the picture (Buchsbaum
    1980).

    Every valid pixel has the same weight, whatever its brightness. Lamps (brighter than 100 times
    the 95th percentile) do not count.

    Parameters
    ----------
    picture : picture Dataset.
    lamps : (y, x) bool, pixels that are lamps; None takes `display_view.lamp_mask`.
    """
    from .display_view import lamp_mask, luminance

    use = picture["valid"].values & ~(
        lamp_mask(luminance(picture)) if lamps is None else np.asarray(lamps, bool)
    )
    if not use.any():
        raise UnitError(
            "no pixel is left from which the white can be estimated; expected valid pixels that are"
            " neither saturated nor lamps"
        )
    mean = picture["xyz"].values[use].mean(0)
    if not mean[1] > 0:
        raise UnitError(
            f"the picture's mean luminance is {mean[1]:g} cd/m2; expected a mean above 0, from"
            " which the white can be estimated"
        )
    return mean / mean[1]
