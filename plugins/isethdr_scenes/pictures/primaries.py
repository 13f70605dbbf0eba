"""RGB of other primaries, and XYZ, as linear sRGB with its white at (1, 1, 1)."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from isethdr_core.physics.colour.colour_spaces import XYZ_TO_SRGB

from .content import LUMINANCE_CHANNELS, RGB_CHANNELS, XYZ_CHANNELS

Primaries = Literal["srgb", "display_p3", "rec2020", "xyz"]
# (x, y) of red, green, blue and white: IEC 61966-2-1, SMPTE EG 432-1 with D65, ITU-R BT.2020
CHROMATICITIES = {
    "srgb": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290),
    "display_p3": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290),
    "rec2020": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
}
SAME = 2e-3  # largest difference of equal chromaticities; files round theirs to three digits


def to_xyz(chromaticities: tuple[float, ...]) -> np.ndarray:
    """Return the matrix (3, 3) from linear RGB to XYZ, Y = 1 for (1, 1, 1) (SMPTE RP 177-1993).

    Parameters
    ----------
    chromaticities : (x, y) of red, green, blue and white.
    """
    xy = np.asarray(chromaticities, float).reshape(4, 2)
    columns = np.stack([xy[:, 0] / xy[:, 1], np.ones(4), (1 - xy.sum(1)) / xy[:, 1]])
    return columns[:, :3] * np.linalg.solve(columns[:, :3], columns[:, 3])


class InGamut(NamedTuple):
    """Linear sRGB without negative values, and the change that this needed."""

    rgb: np.ndarray  # (3, ...)
    moved: int  # pixels whose colour was mixed with white of the same luminance
    most: float  # largest share of white in the mixture


def linear_srgb(values: np.ndarray, primaries: Primaries) -> InGamut:
    """Return linear sRGB (3, ...) of RGB or XYZ (3, ...) of other primaries.

    A colour beyond the gamut of sRGB is mixed with white of the same luminance until no value is
    negative. This keeps its luminance and the direction of its hue, and reduces its saturation.
    """
    values = np.asarray(values, float)
    if primaries == "srgb":
        return InGamut(values, 0, 0.0)
    matrix = XYZ_TO_SRGB
    if primaries != "xyz":
        matrix = XYZ_TO_SRGB @ to_xyz(CHROMATICITIES[primaries])
        # The standard states four digits. Scaling the rows keeps white at exactly (1, 1, 1).
        matrix = matrix / matrix.sum(1)[:, None]
    rgb = np.tensordot(matrix, values, 1)
    grey = luminance_of(rgb, RGB_CHANNELS, "srgb")
    least = rgb.min(0)
    outside = least < -1e-6 * np.abs(grey)  # rounding errors do not count
    with np.errstate(invalid="ignore", divide="ignore"):
        white = np.where(least < 0, -least / (grey - least), 0.0)
    white = np.where(grey > 0, white, 1.0 * (least < 0))
    moved_to_white = np.maximum((1 - white) * rgb + white * grey, 0.0)
    return InGamut(moved_to_white, int(outside.sum()), float(white.max(initial=0.0)))


def luminance_of(values: np.ndarray, channels: tuple[str, ...], primaries: Primaries) -> np.ndarray:
    """Return the luminance (...) of colours (channel, ...), in the unit of the colours.

    Parameters
    ----------
    values : (channel, ...) linear colours, in any unit.
    channels : Y, or R, G, B, or X, Y, Z.
    primaries : primaries of RGB; the luminance of (1, 1, 1) is 1.
    """
    if channels == LUMINANCE_CHANNELS:
        return values[0]
    if channels == XYZ_CHANNELS:
        return values[1]
    return np.tensordot(to_xyz(CHROMATICITIES[primaries])[1], values, 1)


def named(chromaticities: tuple[float, ...]) -> str | None:
    """Return the name of the primaries with these chromaticities; None: they have no name here."""
    chromaticities_given = np.asarray(chromaticities, float)
    for name, standard in CHROMATICITIES.items():
        if (
            chromaticities_given.shape == (8,)
            and np.abs(chromaticities_given - standard).max() <= SAME
        ):
            return name
    return None
