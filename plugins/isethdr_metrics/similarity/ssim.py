"""SSIM: structural similarity of picture and reference picture as displayed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from isethdr_core.data.derived_once import once
from isethdr_core.data.scores import Score
from isethdr_core.display.display_view import display, white_cd_m2
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Compression, White
from ..regions import luminances, mean_of, means_of_parts, regions_of
from .structural_similarity import Reference, reference, similarity_to, window_fits

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand

CODES = 255.0  # difference between the largest and the smallest code of a display


@dataclass(frozen=True)
class Ssim:
    """Mean structural similarity (Wang et al. 2004) of picture and reference picture, after the
    same display rendering.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # the score is nearly the mean of the scores of parts of the picture, which
    # isethdr_core.uncertainty.score_errors uses
    MEAN_OF_PARTS: ClassVar[bool] = True

    WHITE_SCORE: ClassVar[str] = "ssim_white"

    # luminance that is displayed as white; 0 takes the 99th percentile of the reference picture
    # without lamps
    white_cd_m2: White = 0.0
    # strength of the tone map of isethdr_core.display.display_view; 0 is linear
    compression: Compression = 100.0

    def __post_init__(self) -> None:
        check_ranges(self)

    def narrow(self, demand: Demand) -> Demand:
        """Add the instance labels to the demand."""
        return demand.with_labels("instance")

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Score]:
        """Return the mean of the similarity map per region and the white that was used.

        The window is a Gaussian with a standard deviation of 1.5 pixels, 11 pixels wide, as in the
        paper. The three display channels are averaged. The similarity of a pixel that is not valid
        is 0, unless the reference picture is at or above the white there, because a display then
        shows both as white. There is no score if the window is larger than the picture.
        """
        if not window_fits(luminances(picture, truth)[2].shape, "ssim"):
            return []
        white = self.white_cd_m2 or once("white", (truth,), lambda: white_cd_m2(truth))
        similarities = self._map(picture, truth, white)
        scores = [
            Score("ssim", value, "", region.name, low, high)
            for region in regions_of(similarities.shape, labels)
            for value, low, high in [mean_of(similarities, region)]
        ]
        return [*scores, Score(self.WHITE_SCORE, float(white), "cd m-2")]

    def of_parts(
        self, picture: xr.Dataset, truth: xr.Dataset, part: np.ndarray
    ) -> list[list[Score]]:
        """Return the score of each part of the frame.

        Parameters
        ----------
        picture, truth : picture and reference picture on one grid (y, x).
        part : (y, x), number of the part of each pixel, from 0.
        """
        white = self.white_cd_m2 or once("white", (truth,), lambda: white_cd_m2(truth))
        values = means_of_parts(self._map(picture, truth, white), part)
        return [[Score("ssim", float(value), "")] for value in values]

    def _map(self, picture: xr.Dataset, truth: xr.Dataset, white: float) -> np.ndarray:
        """Return the similarity (y, x) of each pixel. The array must not be changed."""
        key = "ssim", float(white), self.compression
        return once(key, (picture, truth), lambda: self._similarities(picture, truth, white))

    def _similarities(self, picture: xr.Dataset, truth: xr.Dataset, white: float) -> np.ndarray:
        _, true, valid = luminances(picture, truth)
        key = "windowed display", float(white), self.compression
        references = once(key, (truth,), lambda: self._references(truth, white))
        shown = display(picture, white, self.compression)
        similarities: np.ndarray = (
            sum(
                similarity_to(of_truth, shown[..., k].astype(np.float32), CODES)
                for k, of_truth in enumerate(references)
            )
            / 3
        )
        similarities[~valid & (true < white)] = 0.0
        return similarities

    def _references(self, truth: xr.Dataset, white: float) -> list[Reference]:
        """Return the three display channels of the reference picture, prepared for comparison.

        float32 halves the time. The rounding error of the windowed squares is 2e-3, much less than
        the smallest stabilising constant, 6.5.
        """
        shown = display(truth, white, self.compression)
        return [reference(shown[..., k].astype(np.float32), CODES) for k in range(3)]
