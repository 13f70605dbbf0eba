"""Colour difference between a picture and its reference picture, relative to the same white:
CIEDE2000, and the older CIE 94 and CIE 76.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.derived_once import once
from isethdr_core.data.scores import Score
from isethdr_core.display.display_view import white_cd_m2
from isethdr_core.physics.colour import colour_spaces
from isethdr_core.plugins.ranges import check_ranges

from ..limits import White
from ..regions import luminances, mean_of, means_of_parts, regions_of

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand

Formula: TypeAlias = tuple[str, Callable[[np.ndarray, np.ndarray], np.ndarray], str]


# Luminances that differ from the white by this share equal it. A white patch has the luminance of
# the white itself, apart from rounding, and stored values are rounded by up to half of this.
EQUAL = 2.0**-16


def up_to_white(picture: xr.Dataset, truth: xr.Dataset, white: float) -> np.ndarray:
    """Return which pixels (bool, (y, x)) are not brighter than the white in the reference picture.

    Parameters
    ----------
    picture, truth : picture and reference picture.
    white : luminance of the white, cd/m2.
    """
    up_to: np.ndarray = luminances(picture, truth)[1] <= white * (1 + EQUAL)
    return up_to


@dataclass(frozen=True)
class Ciede2000:
    """Mean CIEDE2000 of pixels up to the white, for the frame and for each object."""

    THREAD_SAFE: ClassVar[bool] = True

    # the score is nearly the mean of the scores of parts of the picture, which
    # isethdr_core.uncertainty.score_errors uses
    MEAN_OF_PARTS: ClassVar[bool] = True

    WHITE_SCORE: ClassVar[str] = "ciede2000_white"

    # name of the score, colour difference of two arrays of CIELAB, unit
    formula: ClassVar[Formula] = ("ciede2000", colour_spaces.de2000, "dE00")

    # luminance of the white (D65) of both pictures; 0 takes the 99th percentile of the reference
    # picture without lamps
    white_cd_m2: White = 0.0

    def __post_init__(self) -> None:
        check_ranges(self)

    def narrow(self, demand: Demand) -> Demand:
        """Add the instance labels to the demand."""
        return demand.with_labels("instance")

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Score]:
        """Return the colour difference of each region, and the white that was used.

        Pixels that are brighter than the white in the reference picture are left out, because
        CIELAB is defined for surfaces and not for lamps. A pixel that is not valid counts as white,
        as `display_view.display` shows it.
        """
        white = self.white_cd_m2 or once("white", (truth,), lambda: white_cd_m2(truth))
        difference = self._map(picture, truth, white)
        use = up_to_white(picture, truth, white)
        share = 1 - use.mean()
        if share > 0:
            why = "CIELAB is defined for surfaces, not for lamps"
            ledger.left_out("pixels above the white", why, share, "share of the frame")
        score, _, unit = self.formula
        scores = []
        for region in regions_of(use.shape, labels):
            if region.of(use).any():
                value, low, high = mean_of(difference, region, use)
                scores.append(Score(score, value, unit, region.name, low, high))
        return [*scores, Score(self.WHITE_SCORE, float(white), "cd m-2")]

    def of_parts(
        self, picture: xr.Dataset, truth: xr.Dataset, part: np.ndarray
    ) -> list[list[Score]]:
        """Return the colour difference of each part of the frame.

        Parameters
        ----------
        picture, truth : picture and reference picture on one grid (y, x).
        part : (y, x), number of the part of each pixel, from 0.
        """
        white = self.white_cd_m2 or once("white", (truth,), lambda: white_cd_m2(truth))
        use = up_to_white(picture, truth, white)
        score, _, unit = self.formula
        values = means_of_parts(self._map(picture, truth, white), part, use)
        return [[Score(score, float(value), unit)] for value in values]

    def _map(self, picture: xr.Dataset, truth: xr.Dataset, white: float) -> np.ndarray:
        """Return the colour difference (y, x) of each pixel. The array must not be changed."""
        key = "colour difference", self.formula, float(white)
        return once(key, (picture, truth), lambda: self._differences(picture, truth, white))

    def _differences(self, picture: xr.Dataset, truth: xr.Dataset, white: float) -> np.ndarray:
        _, _, valid = luminances(picture, truth)
        white_xyz = white * colour_spaces.D65_XYZ
        shown_xyz = np.where(valid[..., None], picture["xyz"].values, white_xyz)
        true_lab = once(
            ("lab", float(white)),
            (truth,),
            lambda: colour_spaces.lab(truth["xyz"].values, white_xyz),
        )
        difference: np.ndarray = self.formula[1](true_lab, colour_spaces.lab(shown_xyz, white_xyz))
        return difference


@dataclass(frozen=True)
class Cie94(Ciede2000):
    """Mean CIE 1994 difference (graphic arts) of pixels up to the white, weighted by the chroma of
    the reference picture.
    """

    WHITE_SCORE: ClassVar[str] = "cie94_white"
    formula: ClassVar[Formula] = ("cie94", colour_spaces.de94, "dE94")


@dataclass(frozen=True)
class Cie76(Ciede2000):
    """Mean CIE 1976 difference of pixels up to the white: the Euclidean distance in CIELAB."""

    WHITE_SCORE: ClassVar[str] = "cie76_white"
    formula: ClassVar[Formula] = ("cie76", colour_spaces.de76, "dE76")
