"""Log luminance error: difference of luminance from the reference picture, in decades."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from isethdr_core.data.derived_once import once
from isethdr_core.data.scores import Score
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Luminance
from ..regions import luminances, mean_of, means_of_parts, regions_of

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand


@dataclass(frozen=True)
class LogLuminanceError:
    """Rms of log10 (luminance / true luminance), for the frame and for each object."""

    THREAD_SAFE: ClassVar[bool] = True

    # the score is nearly the mean of the scores of parts of the picture, which
    # isethdr_core.uncertainty.score_errors uses
    MEAN_OF_PARTS: ClassVar[bool] = True

    # lower luminances are raised to this value, because an estimate of 0 or less has no logarithm
    floor_cd_m2: Luminance = 1e-3

    def __post_init__(self) -> None:
        check_ranges(self)

    def narrow(self, demand: Demand) -> Demand:
        """Ask for the instance labels."""
        return demand.with_labels("instance")

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Score]:
        """Return one score per region, in log10 units (0.3 is a factor of two).

        A saturated pixel counts with its luminance in the picture, the highest that it can measure.
        """
        square = self._square(picture, truth)
        return [
            Score("log_luminance_error", value, "log10", region.name, low, high)
            for region in regions_of(square.shape, labels)
            for value, low, high in [np.sqrt(mean_of(square, region)).tolist()]
        ]

    def of_parts(
        self, picture: xr.Dataset, truth: xr.Dataset, part: np.ndarray
    ) -> list[list[Score]]:
        """Return the score of each part of the frame.

        Parameters
        ----------
        picture, truth : picture and reference picture on one grid (y, x).
        part : (y, x), number of the part of each pixel, from 0.
        """
        values = np.sqrt(means_of_parts(self._square(picture, truth), part))
        return [[Score("log_luminance_error", float(value), "log10")] for value in values]

    def _square(self, picture: xr.Dataset, truth: xr.Dataset) -> np.ndarray:
        y, true, _ = luminances(picture, truth)
        floor = self.floor_cd_m2
        true_log = once(("log", floor), (truth,), lambda: np.log10(np.maximum(true, floor)))
        square: np.ndarray = (np.log10(np.fmax(y, floor)) - true_log) ** 2
        return square
