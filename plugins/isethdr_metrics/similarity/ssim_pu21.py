"""SSIM on PU21: structural similarity of absolute luminances in a perceptually uniform encoding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from isethdr_core.data.scores import Score

from ..regions import frame_and_objects, luminances, mean_interval
from .structural_similarity import similarity, window_fits

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand

# lowest and highest luminance for which PU21 was fitted
LOWEST_CD_M2 = 0.005
HIGHEST_CD_M2 = 10000.0
# coefficients of Mantiuk, Azimi 2021, "PU21: a novel perceptually uniform encoding", for its
# default fit "banding_glare"
P = (
    0.353487901,
    0.3734658629,
    8.277049286e-05,
    0.9062562627,
    0.09150303166,
    0.9099517204,
    596.3148142,
)


@dataclass(frozen=True)
class SsimPu21:
    """Mean SSIM of the PU21-encoded luminances of picture and reference picture, without a tone
    map.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # the score is nearly the mean of the scores of parts of the picture, which
    # isethdr_core.uncertainty.score_errors uses
    MEAN_OF_PARTS: ClassVar[bool] = True

    def narrow(self, demand: Demand) -> Demand:
        """Add the instance labels to the demand."""
        return demand.with_labels("instance")

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Score]:
        """Return the mean of the similarity map per region, and the share of the frame with
        luminances outside the range of PU21.

        Window and constants are those of `ssim`, with a range of 256, the PU21 code of 100 cd/m2.
        The similarity of a pixel that is not valid is 0, unless the reference picture is at or
        above the upper end of the range of PU21 there. There is no score if the window is larger
        than the picture.
        """
        y, true, valid = luminances(picture, truth)
        if not window_fits(y.shape, "ssim_pu21"):
            return []
        similarities = similarity(pu21(true), pu21(y), data_range=256.0)
        similarities[~valid & (true < HIGHEST_CD_M2)] = 0.0
        clamped = [np.mean((v < LOWEST_CD_M2) | (v > HIGHEST_CD_M2)) for v in (y, true)]
        scores = [
            Score("ssim_pu21", value, "", name, low, high)
            for name, region in frame_and_objects(y.shape, labels)
            for value, low, high in [mean_interval(similarities, region)]
        ]
        return [*scores, Score("ssim_pu21_clamped", float(max(clamped)), "share of the frame")]


def pu21(luminance_cd_m2: float | np.ndarray) -> float | np.ndarray:
    """Return the PU21 codes of luminances, cd/m2, clamped to 0.005..10 000. The code of 100 cd/m2
    is 256.
    """
    y = np.clip(luminance_cd_m2, LOWEST_CD_M2, HIGHEST_CD_M2) ** P[3]
    return np.maximum(P[6] * (((P[0] + P[1] * y) / (1 + P[2] * y)) ** P[4] - P[5]), 0.0)
