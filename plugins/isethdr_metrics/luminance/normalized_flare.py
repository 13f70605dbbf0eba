"""Normalised flare: stray light away from the sources, as a share of the brightest source."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.scores import Score
from isethdr_core.display.display_view import lamp_mask
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Guard
from ..regions import NAN, luminances, mean_interval

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class NormalizedFlare:
    """Luminance above that of the reference picture, away from sources, divided by the brightest
    true luminance (IEEE 2020).
    """

    THREAD_SAFE: ClassVar[bool] = True

    # width of the border around a source, in pixels, that is not counted as flare, because it
    # contains the blur of the source
    guard: Guard = 5

    def __post_init__(self) -> None:
        check_ranges(self)

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Any]:
        """Return the mean and the 99th percentile over the valid pixels beyond the guard, and the
        brightest true luminance.

        IEEE Std 2020-2024 divides a picture of one lamp in the dark by the level of the lamp in a
        picture that is not saturated. Here the scene need not be dark, because the reference
        picture is subtracted: (Y - true Y) / brightest true Y. Sources are pixels above half of the
        brightest true Y, and lamps (`display_view.lamp_mask`). Noise has a mean of 0, so the mean
        has no bias; the percentile contains the noise of single pixels.
        """
        from scipy.ndimage import distance_transform_edt

        y, true, valid = luminances(picture, truth)
        source = float(true.max())
        if not source > 0:
            ledger.left_out("normalized_flare", "the scene has no light", NAN, "")
            return []
        bright = (true >= source / 2) | lamp_mask(true)
        use = valid & (distance_transform_edt(~bright) > self.guard)
        if not use.any():
            ledger.left_out(
                "guard around sources",
                "it would cover the whole frame, so pixels right beside sources are counted",
                NAN,
                "",
            )
            use = valid & ~bright
        if not use.any():
            ledger.left_out("normalized_flare", "no pixel beside the sources is valid", NAN, "")
            return []
        ratio = (y - true) / source
        value, low, high = mean_interval(ratio, use)
        return [
            Score("normalized_flare", value, "", "", low, high),
            Score("normalized_flare_99", float(np.percentile(ratio[use], 99)), ""),
            Score("normalized_flare_source", source, "cd m-2"),
        ]
