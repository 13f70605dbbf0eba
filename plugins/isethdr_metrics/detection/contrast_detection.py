"""Contrast detection: the probability that a contrast of the scene is preserved in the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from isethdr_core.data.derived_once import intervals_wanted, once, with_intervals
from isethdr_core.data.scores import Score
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Percent, Reach
from ..regions import undenoised, variance_stated
from .expected_picture import expected
from .pair_medians import (
    SCORE,
    Probabilities,
    probability,
    right_near_medians,
    scores_of,
    scores_of_further,
)
from .pixel_pairs import PairChoice, RegionPairs, joined

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand


@dataclass(frozen=True)
class ContrastDetection:
    """Contrast detection probability (IEEE 2020): median over pixel pairs of each object and its
    surround, and of the frame.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # the score is nearly the mean of the scores of parts of the picture, which
    # isethdr_core.uncertainty.score_errors uses
    MEAN_OF_PARTS: ClassVar[bool] = True

    # smallest Michelson contrast, in the reference picture, of a pair that counts
    lowest_contrast_percent: Percent = 5.0
    # largest accepted deviation of the measured contrast, as a share of the true contrast
    interval_percent: Percent = 50.0
    reach: Reach = 10  # largest distance of the two pixels of a pair, in pixels

    def __post_init__(self) -> None:
        check_ranges(self)

    def narrow(self, demand: Demand) -> Demand:
        """Ask for the instance labels."""
        return demand.with_labels("instance")

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Any]:
        """Return the median probability for the frame and for each object.

        A pair of an object is one of its pixels and one pixel outside it, at most `reach` away.
        Pairs with a pixel that is not valid count as not detected, because saturated pixels show no
        contrast. The interval is that of a median over independent pixels (`pair_medians`).
        """
        if not _has_variance(picture):
            return []
        return scores_of(self._probabilities(picture, truth, labels))

    def further(
        self,
        picture: xr.Dataset,
        first: xr.Dataset,
        truth: xr.Dataset,
        labels: xr.Dataset | None = None,
    ) -> list[Score]:
        """Return the medians of a further noise realisation of the picture `first`.

        Parameters
        ----------
        picture, first, truth : both realisations and the reference picture on one grid (y, x).
        labels : labels on that grid, or None.
        """
        if not _has_variance(picture):
            return []
        with with_intervals():
            of_first = self._probabilities(first, truth, labels)
        return scores_of_further(of_first, expected(undenoised(picture), truth), self._interval)

    def of_parts(
        self, picture: xr.Dataset, truth: xr.Dataset, part: np.ndarray
    ) -> list[list[Score]]:
        """Return the median over the frame's pixels of each part of the frame.

        Parameters
        ----------
        picture, truth : picture and reference picture on one grid (y, x).
        part : (y, x), number of the part of each pixel, from 0.
        """
        count = int(part.max()) + 1
        if not _has_variance(picture):
            return [[] for _ in range(count)]
        model = expected(undenoised(picture), truth)
        frame = self._choice.of_frame(model.true)
        number = part.ravel()[frame.pairs.first]
        order = np.argsort(number, kind="stable")
        regions = []
        for at in np.split(order, np.searchsorted(number[order], np.arange(1, count))):
            pixels, member = np.unique(frame.member[at], return_inverse=True)
            regions.append(RegionPairs("", frame.pairs.some(at), pixels.size, member))
        found = right_near_medians(model, frame.pairs.some(order), regions, self._interval)
        return [
            [Score(SCORE, float(np.median(region.of_members(values))), "")] if values.size else []
            for region, values in zip(regions, found.by_region(found.value), strict=True)
        ]

    def map(self, picture: xr.Dataset, truth: xr.Dataset) -> np.ndarray:
        """Return the mean probability (y, x) of the pairs of each pixel with the pixels `reach`
        away; NaN if none of them counts.

        Parameters
        ----------
        picture, truth : picture before denoising, and reference picture, on one grid (y, x).
        """
        model = expected(picture, truth)
        total = np.zeros(model.true.size)
        count = np.zeros(model.true.size)
        r = self.reach
        for dy, dx in ((0, r), (r, 0), (r, r), (r, -r)):
            for pairs in self._choice.at_offset(model.true, dy, dx):
                value = probability(model, pairs, self._interval)
                # each pixel occurs at most once among the first pixels, and among the second ones
                for pixel in (pairs.first, pairs.second):
                    total[pixel] += value
                    count[pixel] += 1
        mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
        return mean.reshape(model.true.shape)

    @property
    def _choice(self) -> PairChoice:
        return PairChoice(self.lowest_contrast_percent / 100, self.reach)

    @property
    def _interval(self) -> float:
        return self.interval_percent / 100

    def _probabilities(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None
    ) -> Probabilities:
        """Return the probabilities of the pairs of all regions."""
        key = "contrast probabilities", self, intervals_wanted()
        return once(key, (picture, truth, labels), lambda: self._found(picture, truth, labels))

    def _found(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None
    ) -> Probabilities:
        model = expected(undenoised(picture), truth)
        choice = self._choice
        regions = once(
            ("contrast", choice), (truth, labels), lambda: choice.of_regions(model.true, labels)
        )
        # all regions at once, because many small calls would take several times as long
        pairs = joined([region.pairs for region in regions])
        return right_near_medians(model, pairs, regions, self._interval)


def _has_variance(picture: xr.Dataset) -> bool:
    """Return whether the picture states its variance before denoising."""
    return variance_stated(undenoised(picture), SCORE, "probability")
