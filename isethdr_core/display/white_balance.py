"""White balance: colours as seen by an eye that has adapted to the light of the scene. For views,
never a stage.

A picture holds the light itself: a wall in sodium light is orange. `balanced` turns it into what
would be seen in daylight.
"""

from __future__ import annotations

import numpy as np

from ..errors import UnitError
from ..physics.colour.colour_spaces import D65_XYZ

# Bradford cone responses (Lam 1985; ICC.1:2010, annex E)
CONES = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def balanced(xyz, white_xyz) -> np.ndarray:
    """Return XYZ (y, x, 3) adapted from a light to D65: its white becomes a neutral of the same
    luminance (von Kries 1902).

    Parameters
    ----------
    xyz : (..., 3), any scale; negative estimates stay.
    white_xyz : (3,) XYZ of a white in the scene's light, any scale, such as a picture's attribute
        `white_xyz`, or `grey_world`.

    Raises
    ------
    UnitError : a white without light, or outside what cones can see.
    """
    white = np.asarray(white_xyz, float)
    if white.shape != (3,) or not np.all(np.isfinite(white)) or not white[1] > 0:
        raise UnitError(
            f"white_xyz is {white_xyz!r}; expected XYZ of a white with Y above 0, such as"
            " picture.attrs['white_xyz']"
        )
    seen, meant = CONES @ (white / white[1]), CONES @ D65_XYZ
    if not np.all(seen > 0):
        raise UnitError(
            f"white_xyz {white_xyz!r} is no colour of light: its cone responses are {seen};"
            " expected all above 0"
        )
    return np.asarray(xyz, float) @ (np.linalg.inv(CONES) @ np.diag(meant / seen) @ CONES).T


def grey_world(picture, lamps=None) -> np.ndarray:
    """Return XYZ with Y = 1 of the scene's light, taken to be the mean of what it falls on
    (Buchsbaum 1980).

    Every valid pixel counts alike whatever its brightness is worth; lamps, brighter than 100 times
    the 95th percentile, do not.

    Parameters
    ----------
    picture : picture Dataset.
    lamps : (y, x) bool, pixels that are lamps; None takes `view.lamp_mask`.
    """
    from .display_view import lamp_mask, luminance

    use = picture["valid"].values & ~(
        lamp_mask(luminance(picture)) if lamps is None else np.asarray(lamps, bool)
    )
    if not use.any():
        raise UnitError(
            "no valid pixel shows the scene's light; expected some that are neither saturated nor"
            " lamps"
        )
    mean = picture["xyz"].values[use].mean(0)
    if not mean[1] > 0:
        raise UnitError(
            f"the picture's mean luminance is {mean[1]:g} cd/m2; expected light to take the white"
            " from"
        )
    return mean / mean[1]
