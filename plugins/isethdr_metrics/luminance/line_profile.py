"""Line profile: luminance along one row, which shows flare."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from isethdr_core.data.scores import Score
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Luminance, Row
from ..regions import luminance_variance, luminances, mean_interval

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class LineProfile:
    """Difference of log luminance of picture and reference picture along a row, by default through
    the brightest lamp.
    """

    THREAD_SAFE: ClassVar[bool] = True

    row: Row = -1  # pixel row; -1 takes the row of the brightest pixel of the reference picture
    floor_cd_m2: Luminance = 1e-3  # lower luminances are raised to this value

    def __post_init__(self) -> None:
        check_ranges(self)

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Score]:
        """Return the rms difference of the two log10 profiles over the row. Its 95 % interval
        follows from resampling twelfths of the row.
        """
        line = self.profile(picture, truth)
        square = (line["log10_picture"] - line["log10_truth"]) ** 2
        value, low, high = np.sqrt(
            mean_interval(square[None], np.ones((1, square.size), bool))
        ).tolist()
        return [Score("line_profile_error", value, "log10", "", low, high)]

    def profile(self, picture: xr.Dataset, truth: xr.Dataset) -> dict:
        """Return the dict of row, x_m, log10_picture, log10_truth, log10_low, log10_high and valid.

        The profiles are log10 of cd/m2; log10_low and log10_high are the limits of 95 % of the
        noise, NaN if the picture states no variance.
        """
        y, true, valid = luminances(picture, truth)
        if not -1 <= self.row < len(y):
            raise ConfigError(
                f"line_profile has row={self.row}; expected a row of the picture, 0 to"
                f" {len(y) - 1}, or -1 for that of the brightest light; type for example"
                " metric.NAME.row=-1"
            )
        row = self.row if self.row >= 0 else int(np.unravel_index(np.argmax(true), true.shape)[0])
        spread = 1.96 * np.sqrt(luminance_variance(picture)[row])

        def log(values: np.ndarray) -> np.ndarray:
            return np.log10(np.fmax(values, self.floor_cd_m2))

        # unlike the maximum in `log`, this one keeps the NaN of an unknown variance
        low, high = (
            np.log10(np.maximum(y[row] + side * spread, self.floor_cd_m2)) for side in (-1, 1)
        )
        return {
            "row": row,
            "x_m": picture.x.values,
            "log10_picture": log(y[row]),
            "log10_truth": log(true[row]),
            "log10_low": low,
            "log10_high": high,
            "valid": valid[row],
        }
