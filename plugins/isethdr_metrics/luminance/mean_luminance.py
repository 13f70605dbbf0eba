"""Mean luminance: the simplest score, which shows an error of the level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.scores import Score

from ..regions import NAN, frame_and_objects, luminance_variance, luminances

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand


@dataclass(frozen=True)
class MeanLuminance:
    """Mean luminance of the valid pixels, in cd/m2, for the frame and for each object."""

    THREAD_SAFE: ClassVar[bool] = True

    def narrow(self, demand: Demand) -> Demand:
        """Ask for the instance labels."""
        return demand.with_labels("instance")

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Any]:
        """Return one score per region with valid pixels. The interval follows from the stated
        variance.
        """
        y, _, valid = luminances(picture, truth)
        variance = luminance_variance(picture)
        out = []
        for name, region in frame_and_objects(y.shape, labels):
            use = region & valid
            if not use.any():
                ledger.left_out(
                    f"luminance of {name or 'the frame'}", "no pixel is valid", NAN, "cd m-2"
                )
                continue
            value = float(y[use].mean())
            # A demosaic makes neighbours dependent. The factor 3 treats the noise of 3 x 3 pixels
            # as the same, which is an upper bound for the bilinear demosaic.
            half = 1.96 * 3 * float(np.sqrt(variance[use].sum())) / use.sum()
            out.append(Score("luminance", value, "cd m-2", name, value - half, value + half))
        return out
