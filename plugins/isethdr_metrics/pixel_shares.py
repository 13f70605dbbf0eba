"""Pixel shares: the shares of valid and of saturated pixels, of the frame and of each object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from isethdr_core.data.saturation import saturated
from isethdr_core.data.scores import Score

from .regions import luminances, regions_of

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand


@dataclass(frozen=True)
class PixelShares:
    """Shares of valid pixels and of pixels saturated in every capture, for the frame and each
    object.
    """

    THREAD_SAFE: ClassVar[bool] = True

    def narrow(self, demand: Demand) -> Demand:
        """Add the instance labels to the demand."""
        return demand.with_labels("instance")

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Score]:
        """Return `valid_share` and `saturated_share` per region; both are exact counts.

        A picture without the variable `saturated` (`isethdr_core.data.saturation`) counts every
        pixel that is not valid as saturated.
        """
        _, _, valid = luminances(picture, truth)
        shares = (("valid_share", valid), ("saturated_share", saturated(picture)))
        scores = []
        for region in regions_of(valid.shape, labels):
            for score, flags in shares:
                share = float(np.mean(region.of(flags)))
                scores.append(Score(score, share, "", region.name, share, share))
        return scores
