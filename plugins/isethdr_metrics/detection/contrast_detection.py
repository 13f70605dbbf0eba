"""Contrast detection: the probability that a contrast of the scene is preserved in the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.derived_once import intervals_wanted, once, with_intervals
from isethdr_core.data.scores import Score
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Percent, Reach
from ..luminance.noise_line import noise_line
from ..regions import (
    NAN,
    Region,
    luminance_variance,
    luminances,
    median_interval,
    median_shares,
    regions_of,
    undenoised,
    variance_stated,
)
from .photon_counts import Estimate, Signal, estimated, of_signals

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand

PAIRS = 4000  # drawn per object: the median is then known to about 0.01
FRAME_PIXELS = 4000  # drawn for the frame's score, for the same reason
SMEARED_E = 0.3  # read noise that every picture is taken to have at least, in steps
# pixels: a window over which the picture's difference from the truth is taken as its mean
SMOOTH = 7
TIE = 1e-9  # probabilities this close count as equal
# pairs looked at together: what is worked out on the way stays in the processor's memory
PIECE = 8192
NEXT = 32  # pairs next to each median of a further realisation that are worked out


class Pairs(NamedTuple):
    """Pairs of pixels of a region with contrast in the truth, as indices of the flat picture."""

    first: np.ndarray
    second: np.ndarray
    bright: np.ndarray  # the one that is truly brighter
    dark: np.ndarray
    contrast: np.ndarray  # of the truth

    def some(self, at: np.ndarray) -> Pairs:
        """Return some of the pairs."""
        return Pairs(*(values[at] for values in self))


class Question(NamedTuple):
    """What contrast detection looks at in one region; all of it follows from truth and labels."""

    name: str
    pairs: Pairs
    pixels: int  # of the region; of the frame those that have contrast
    # of each pair's first pixel among the pixels that are asked; None: each pair counts
    place: np.ndarray | None

    def of_asked(self, values: np.ndarray) -> np.ndarray:
        """Return the values of pairs as those of what is asked: pairs, or means over pixels."""
        if self.place is None:
            return values
        return np.bincount(self.place, values) / np.bincount(self.place)

    def of_pairs(self, asked: np.ndarray) -> np.ndarray:
        """Return what holds for each pair or pixel that is asked, for every pair."""
        return asked if self.place is None else asked[self.place]

    def independent(self, count: int) -> int:
        """Return how many of `count` pairs, or pixels, have noise of their own."""
        return min(count, self.pixels // SMOOTH**2)


class Expected(NamedTuple):
    """What the camera makes of each pixel (y, x) apart from this noise realisation, in cd/m2."""

    true: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    step: np.ndarray  # luminance of one electron
    valid: np.ndarray  # bool


class Answer(NamedTuple):
    """The probabilities of all pairs in one noise realisation."""

    regions: list[Question]
    pairs: Pairs  # of all regions, one after the other
    value: np.ndarray  # of each pair, right where it may decide a median or an end of its interval
    estimate: np.ndarray  # of each pair, `photon_counts.estimated`

    def starts(self) -> np.ndarray:
        """Return where the pairs of each region start."""
        sizes = [region.pairs.first.size for region in self.regions]
        return np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(int)

    def by_region(self, values: np.ndarray) -> list[np.ndarray]:
        """Return the values of the pairs of each region."""
        return np.split(values, self.starts()[1:])


@dataclass(frozen=True)
class ContrastDetection:
    """Contrast detection probability (IEEE 2020): median over pixel pairs of each object and its
    surround, and of the frame.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # of the picture, nearly: isethdr_core.uncertainty.score_errors may ask for some of it
    MEAN_OF_PARTS: ClassVar[bool] = True

    # least Michelson contrast in the reference picture of a pair that counts
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

        A pair of an object is one of its pixels and one outside it within `reach`. Pairs with a
        pixel that is not valid count as not detected, because saturated pixels show no contrast.
        The interval is that of a median. It counts one pixel in `SMOOTH` x `SMOOTH` as independent,
        because the mean of the picture is taken over such windows.
        """
        if not variance_stated(undenoised(picture), "contrast_detection", "probability"):
            return []
        answer = self._answer(picture, truth, labels)
        return _medians(answer)

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

        Notes
        -----
        The probability of a pair is that in the first realisation plus the change of its estimate,
        whose error mostly cancels. The rest of the error is found from a few pairs next to each
        median, whose probabilities are worked out, and is taken off the median.
        """
        if not variance_stated(undenoised(picture), "contrast_detection", "probability"):
            return []
        with with_intervals():
            answer = self._answer(first, truth, labels)
        model = self._model(undenoised(picture), truth)
        changed = self._estimated(model, answer.pairs).value
        values = answer.by_region(answer.value + changed - answer.estimate)
        next_to = [_next_to_median(*both) for both in zip(answer.regions, values, strict=True)]
        places = np.concatenate([at + k for at, k in zip(next_to, answer.starts(), strict=True)])
        right = self._probability(model, answer.pairs.some(places))
        rights = np.split(right, np.cumsum([at.size for at in next_to])[:-1])
        return [
            Score(
                "contrast_detection", _median(region, of_region, at, right_there), "", region.name
            )
            for region, of_region, at, right_there in zip(
                answer.regions, values, next_to, rights, strict=True
            )
            if of_region.size
        ]

    def of_parts(
        self, picture: xr.Dataset, truth: xr.Dataset, part: np.ndarray
    ) -> list[list[Score]]:
        """Return the median over the frame's pixels of each part of the frame.

        Parameters
        ----------
        picture, truth : picture and reference picture on one grid (y, x).
        part : (y, x), number of the part of each pixel, from 0.
        """
        shown = undenoised(picture)
        count = int(part.max()) + 1
        if not variance_stated(shown, "contrast_detection", "probability"):
            return [[] for _ in range(count)]
        model = self._model(shown, truth)
        frame = self._of_frame(model.true)
        number = part.ravel()[frame.pairs.first]
        order = np.argsort(number, kind="stable")
        places = np.split(order, np.searchsorted(number[order], np.arange(1, count)))
        questions = []
        for at in places:
            pixels, place = np.unique(frame.place[at], return_inverse=True)
            own = frame.pairs.some(at)
            questions.append(Question("", own, pixels.size, place))
        answer = self._right_near_medians(model, frame.pairs.some(order), questions)
        return [
            [Score("contrast_detection", float(np.median(question.of_asked(values))), "")]
            if values.size
            else []
            for question, values in zip(questions, answer.by_region(answer.value), strict=True)
        ]

    def _answer(self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None) -> Answer:
        """Return the probabilities of the pairs of all regions."""
        key = "contrast answer", self, intervals_wanted()
        return once(key, (picture, truth, labels), lambda: self._found(picture, truth, labels))

    def _found(self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None) -> Answer:
        model = self._model(undenoised(picture), truth)
        regions = once(
            ("contrast", self.lowest_contrast_percent, self.reach),
            (truth, labels),
            lambda: self._asked(model.true, labels),
        )
        # all regions at once: many small calls would take several times as long
        pairs = Pairs(
            *(np.concatenate(parts) for parts in zip(*(region.pairs for region in regions)))
        )
        return self._right_near_medians(model, pairs, regions)

    def map(self, picture: xr.Dataset, truth: xr.Dataset) -> np.ndarray:
        """Return (y, x) the mean probability of each pixel's pairs with the pixels `reach` away;
        NaN where none counts.
        """
        return self._map(self._model(picture, truth))

    def _model(self, picture: xr.Dataset, truth: xr.Dataset) -> Expected:
        """Return what the camera makes of each pixel, apart from this one noise realisation.

        Notes
        -----
        Flare adds light and a loss multiplies it, both smoothly. The mean is therefore the true
        luminance plus the local surplus of the picture, or the true luminance times the local
        ratio where the picture is darker. The variance is the shot noise of that mean plus the
        local mean of the other noise.
        """
        return once("contrast model", (picture, truth), lambda: self._modelled(picture, truth))

    def _modelled(self, picture: xr.Dataset, truth: xr.Dataset) -> Expected:
        from scipy.ndimage import uniform_filter

        y, true, valid = luminances(picture, truth)
        share = uniform_filter(valid.astype(float), SMOOTH, mode="nearest")

        def local(values: np.ndarray) -> np.ndarray:
            total = uniform_filter(np.where(valid, values, 0.0), SMOOTH, mode="nearest")
            return np.where(share > 1e-9, total / np.maximum(share, 1e-9), values)

        local_y = local(y)
        local_true = once(("local", valid.tobytes()), (truth,), lambda: local(true))
        loss = np.divide(local_y, local_true, out=np.ones_like(y), where=local_true > 0)
        mean = true * np.clip(loss, 0.0, 1.0) + np.maximum(local_y - local_true, 0.0)
        variance = luminance_variance(picture)
        # Local means on both sides. The true luminance is free of noise, which would flatten the
        # line. The mean of the variances has no bias where electrons are few; their median has.
        shot_noise = local(picture["variance"].values[..., 1])
        _, step = noise_line(local_true[valid], shot_noise[valid])
        local_variance = local(variance)
        other = local_variance - step * local_y
        # a picture is a sum of several counts, which never leaves the gaps of a single one
        read = max(float(np.median(other[valid])) if valid.any() else 0.0, (SMEARED_E * step) ** 2)
        variance = np.maximum(np.where(other >= 0, step * mean + other, local_variance), 0.0)
        shot = np.divide(variance - read, mean, out=np.zeros_like(y), where=mean > 0)
        return Expected(true, mean, variance, np.clip(shot, 0.0, step), valid)

    def _asked(self, true: np.ndarray, labels: xr.Dataset | None) -> list[Question]:
        """Return what is looked at in the frame and in each object."""
        frame, *objects = regions_of(true.shape, labels)
        out = [self._of_frame(true)]
        for region in objects:
            drawn = once(
                ("pairs", self.reach, region.name),
                (labels,),
                lambda r=region: draw_pairs_of(r, self.reach),
            )
            places = (np.ravel_multi_index(at, true.shape) for at in drawn)
            pairs, _ = self._with_their_contrast(true, *places)
            out.append(Question(region.name, pairs, int(region.mask.sum()), None))
        return out

    def _of_frame(self, true: np.ndarray) -> Question:
        """Return the pairs of some pixels with contrast, each with the pixels `reach` away."""
        height, width = true.shape
        r = self.reach
        steps = [(dy, dx) for dy in (-r, 0, r) for dx in (-r, 0, r) if dy or dx]
        taken_pixels = np.zeros(height * width, bool)
        for dy, dx in steps[4:]:
            firsts = self._with_contrast(true, dy, dx)
            taken_pixels[firsts] = taken_pixels[firsts + dy * width + dx] = True
        pixels = np.flatnonzero(taken_pixels)
        # the choice is part of the score's definition: the same picture has the same score
        chosen = pixels
        if pixels.size > FRAME_PIXELS:
            chosen = np.random.default_rng(0).choice(pixels, FRAME_PIXELS, replace=False)
        row, column = np.divmod(chosen, width)
        places = []
        counted = []
        for dy, dx in steps:
            inside = (0 <= row + dy) & (row + dy < height)
            inside &= (0 <= column + dx) & (column + dx < width)
            place = np.flatnonzero(inside)
            first = chosen[place]
            pairs, counts = self._with_their_contrast(true, first, first + dy * width + dx)
            places.append(place[counts])
            counted.append(pairs)
        pairs = Pairs(*(np.concatenate(parts) for parts in zip(*counted)))
        # pixels without any pair that counts are none of the frame's
        _, place = np.unique(np.concatenate(places), return_inverse=True)
        return Question("", pairs, pixels.size, place)

    def _map(self, model: Expected) -> np.ndarray:
        height, width = model.true.shape
        r = self.reach
        total = np.zeros(height * width)
        count = np.zeros(height * width)
        for dy, dx in ((0, r), (r, 0), (r, r), (r, -r)):
            firsts = self._with_contrast(model.true, dy, dx)
            for start in range(0, firsts.size, PIECE):
                first = firsts[start : start + PIECE]
                pairs, _ = self._with_their_contrast(model.true, first, first + dy * width + dx)
                value = self._probability(model, pairs)
                for of in (pairs.first, pairs.second):  # every pixel is first once and second once
                    total[of] += value
                    count[of] += 1
        return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(height, width)

    def _with_contrast(self, true: np.ndarray, dy: int, dx: int) -> np.ndarray:
        """Return the pixels, as indices of the flat picture, that have about the lowest contrast or
        more with the one `dy` rows and `dx` columns on.
        """
        height, width = true.shape
        left = max(-dx, 0)
        across = max(width - abs(dx), 0)
        rows = max(PIECE // width, 1)
        # less by rounding: decided when the contrast is worked out
        least = self.lowest_contrast_percent / 100 * (1 - 1e-9)
        pixels = [np.zeros(0, int)]
        for top in range(0, height - dy, rows):
            a = true[top : min(top + rows, height - dy), left : left + across]
            b = true[top + dy : top + dy + len(a), left + dx : left + dx + across]
            row, column = np.nonzero(np.abs(a - b) > least * (a + b))
            pixels.append((top + row) * width + left + column)
        return np.concatenate(pixels)

    def _with_their_contrast(
        self, true: np.ndarray, first: np.ndarray, second: np.ndarray
    ) -> tuple[Pairs, np.ndarray]:
        """Return the pairs that have contrast, and which they are.

        Parameters
        ----------
        true : luminance (y, x). `first`, `second` : indices of the flat picture.
        """
        true = true.ravel()
        a = true[first]
        b = true[second]
        sums = a + b
        contrast = np.abs(a - b) / np.where(sums > 0, sums, 1.0)
        counts = np.flatnonzero((contrast > self.lowest_contrast_percent / 100) & (sums > 0))
        first = first[counts]
        second = second[counts]
        swap = a[counts] < b[counts]
        bright = np.where(swap, second, first)
        dark = np.where(swap, first, second)
        return Pairs(first, second, bright, dark, contrast[counts]), counts

    def _probability(self, model: Expected, pairs: Pairs) -> np.ndarray:
        """Return the probability of each pair."""
        value = of_signals(*_signals(model, pairs), pairs.contrast, self.interval_percent / 100)
        return np.where(_both_valid(model, pairs), value, 0.0)

    def _estimated(self, model: Expected, pairs: Pairs) -> Estimate:
        """Return the estimated probability of each pair, and the bound on its error."""
        interval = self.interval_percent / 100
        found = estimated(*_signals(model, pairs), pairs.contrast, interval)
        valid = _both_valid(model, pairs)
        return Estimate(*(np.where(valid, values, 0.0) for values in found))

    def _right_near_medians(self, model: Expected, pairs: Pairs, regions: list[Question]) -> Answer:
        """Return the probability of each pair; only those that may decide the median of their
        region, or the ends of its interval where that is wanted, are worked out.

        Parameters
        ----------
        model : what the camera makes of each pixel.
        pairs : of all regions, one after the other.
        regions : what is looked at in each.

        Notes
        -----
        All others have an estimate and a bound on its error. Those that may be the estimated median
        are worked out first. The median of the region then lies between the medians of what its
        pairs, or means of pairs, are at least and at most. One that is certainly on one side of it
        keeps its estimate. The ends of the interval are other quantiles, found in the same way.
        """
        bright, dark = _signals(model, pairs)
        interval = self.interval_percent / 100
        estimate, bound = self._estimated(model, pairs)
        value = estimate.copy()
        for first_guess in (True, False):
            uncertain = np.flatnonzero(_may_be_median(value, bound, regions, first_guess))
            signals = (Signal(*(values[uncertain] for values in of)) for of in (bright, dark))
            value[uncertain] = of_signals(*signals, pairs.contrast[uncertain], interval)
            bound[uncertain] = 0.0
        return Answer(regions, pairs, value, estimate)


def _medians(answer: Answer) -> list[Score]:
    """Return the score of each region."""
    scores = []
    for region, values in zip(answer.regions, answer.by_region(answer.value), strict=True):
        if not values.size:
            title = f"contrast_detection of {region.name}" if region.name else "contrast_detection"
            why = "no two pixels of the reference picture differ by the lowest contrast"
            ledger.left_out(title, why, NAN, "probability")
            continue
        asked = region.of_asked(values)
        median, low, high = median_interval(asked, region.independent(asked.size))
        scores.append(Score("contrast_detection", median, "", region.name, low, high))
    return scores


def _next_to_median(region: Question, values: np.ndarray) -> np.ndarray:
    """Return `NEXT` pairs of a region, as indices, that are next to its median, or the pairs of a
    few pixels that are.
    """
    if not values.size:
        return np.zeros(0, int)
    asked = region.of_asked(values)
    distance = np.abs(asked - np.median(asked))
    count = max(NEXT * asked.size // values.size, 1)
    next_to = np.zeros(asked.size, bool)
    next_to[np.argsort(distance)[:count]] = True
    return np.flatnonzero(region.of_pairs(next_to))


def _median(region: Question, values: np.ndarray, at: np.ndarray, right: np.ndarray) -> float:
    """Return the median of a region, less the error of the values next to it.

    Parameters
    ----------
    region : whose median it is. `values` : of its pairs.
    at : pairs next to the median, as indices. `right` : their probabilities.
    """
    median = float(np.median(region.of_asked(values)) + np.mean(right - values[at]))
    return min(max(median, 0.0), 1.0)


def _may_be_median(
    value: np.ndarray, bound: np.ndarray, regions: list[Question], first_guess: bool
) -> np.ndarray:
    """Return which pairs (bool) are uncertain and may decide the median of their region, or the
    ends of its interval where that is wanted.

    Parameters
    ----------
    value, bound : probability of each pair of all regions, and what it is wrong by at most.
    regions : what is looked at in each.
    first_guess : the medians are taken to be where they are estimated.
    """
    uncertain = bound > 0
    end = 0
    for region in regions:
        start = end
        end = end + region.pairs.first.size
        some = slice(start, end)
        if start == end:
            continue
        least = region.of_asked(value[some] - bound[some])
        most = region.of_asked(value[some] + bound[some])
        middle = region.of_asked(value[some])
        low, high = (middle, middle) if first_guess else (least, most)
        shares = median_shares(region.independent(len(middle)))
        # a little wider: sums in another order are rounded differently
        from_below = _around(low, shares)[0] - TIE
        to_above = _around(high, shares)[1] + TIE
        near = np.zeros(len(middle), bool)
        for at_least, at_most in zip(from_below, to_above, strict=True):
            near |= (most >= at_least) & (least <= at_most)
        uncertain[some] &= region.of_pairs(near)
    return uncertain


def _signals(model: Expected, pairs: Pairs) -> tuple[Signal, Signal]:
    """Return the signals of the brighter and of the darker pixel of each pair."""
    _, mean, variance, step, _ = (values.ravel() for values in model)
    bright, dark = (Signal(mean[at], variance[at], step[at]) for at in (pairs.bright, pairs.dark))
    return bright, dark


def _both_valid(model: Expected, pairs: Pairs) -> np.ndarray:
    valid = model.valid.ravel()
    return valid[pairs.first] & valid[pairs.second]


def _around(values: np.ndarray, shares: Sequence[float]) -> np.ndarray:
    """Return the two values (2, share) that the quantile at each of `shares` lies between."""
    place = np.asarray(shares) * (len(values) - 1)
    places = np.stack([np.floor(place), np.ceil(place)]).astype(int)
    return np.partition(values, np.unique(places))[places]


def pair_probability(  # noqa: PLR0913 - means and variances of two pixels, each an array
    bright: float | np.ndarray,
    bright_variance: float | np.ndarray,
    dark: float | np.ndarray,
    dark_variance: float | np.ndarray,
    contrast: float | np.ndarray,
    interval: float = 0.5,
    step: float | None = None,
) -> float | np.ndarray:
    """Return the probability that the measured contrast is within `contrast` (1 +- `interval`).

    Parameters
    ----------
    bright, dark : numbers or arrays, means of the truly brighter pixel and of the other, any unit.
    bright_variance, dark_variance : variances of the two independent pixels, that unit squared.
    contrast : true Michelson contrast, above 0.
    interval : share of the contrast, below 1.
    step : signal of one electron, in the unit of the means. None takes the growth of the variance
        with the mean between the two pixels, which is that step where both have one read noise.

    Returns
    -------
    float for numbers, else an array of their broadcast shape.

    Notes
    -----
    A pixel is a Poisson count times `step`, plus normal noise with the rest of its variance. The
    sum over both counts is exact; where counts are many or read noise covers the steps, normal
    distributions replace the counts with an error below 0.005 (`photon_counts.representation`). A
    pair without any signal, 0 and 0, has no contrast and counts as not detected. The definition
    follows Geese, Seger, Paolillo 2018 and IEEE Std 2020-2024; the order of bright and dark has to
    be kept.
    """
    values = np.broadcast_arrays(bright, bright_variance, dark, dark_variance, contrast)
    b, b_variance, d, d_variance, k = (np.asarray(v, float).ravel() for v in values)
    if step is None:
        one_electron = _growth(b, b_variance, d, d_variance)
    else:
        one_electron = np.broadcast_to(np.asarray(step, float), values[0].shape).ravel()
    probability = of_signals(
        Signal(b, b_variance, one_electron), Signal(d, d_variance, one_electron), k, interval
    )
    if values[0].ndim == 0:
        return float(probability[0])
    return probability.reshape(values[0].shape)


def _growth(
    bright: np.ndarray, bright_variance: np.ndarray, dark: np.ndarray, dark_variance: np.ndarray
) -> np.ndarray:
    """Return how much the variance grows per unit of the mean, 0 where it does not grow."""
    apart = bright - dark
    slope = (bright_variance - dark_variance) / np.where(apart > 0, apart, 1.0)
    return np.where(apart > 0, np.maximum(slope, 0.0), 0.0)


def draw_pairs(
    mask: np.ndarray, reach: int
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return (first, second) index pairs: pixels of `mask` and pixels outside it at most `reach`
    away.
    """
    rows, columns = np.nonzero(mask)
    window = tuple(slice(i.min(), i.max() + 1) for i in (rows, columns))
    return draw_pairs_of(Region("", window, mask[window], mask.shape), reach)


def draw_pairs_of(
    region: Region, reach: int
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return the `draw_pairs` of a region (`regions.Region`)."""
    from scipy.ndimage import distance_transform_edt

    # one pixel more on each side, but for what is beyond the frame: that is not beside the object
    window = tuple(
        slice(max(cut.start - 1, 0), min(cut.stop + 1, size))
        for cut, size in zip(region.window, region.shape, strict=True)
    )
    start = np.array([cut.start for cut in window])
    mask = np.zeros([cut.stop - cut.start for cut in window], bool)
    mask[tuple(slice(c.start - b, c.stop - b) for c, b in zip(region.window, start))] = region.mask
    inside = np.argwhere((distance_transform_edt(mask) <= reach) & mask) + start
    if region.mask.size == np.prod(region.shape) and region.mask.all() or not len(inside):
        none = np.zeros(0, int)  # an object that fills the frame has nothing beside it
        return (none, none), (none, none)
    # the draw is part of the score's definition: the same picture, the same score
    rng = np.random.default_rng(0)
    pick = inside[rng.integers(len(inside), size=8 * PAIRS)]
    offsets = np.argwhere(np.hypot(*np.indices((2 * reach + 1,) * 2) - reach) <= reach) - reach
    other = pick + offsets[rng.integers(len(offsets), size=len(pick))]
    in_frame = np.all((other >= 0) & (other < region.shape), axis=1)
    place = other - start
    within = in_frame & np.all((place >= 0) & (place < mask.shape), axis=1)
    in_frame[within] = ~mask[tuple(place[within].T)]
    pick = pick[in_frame][:PAIRS]
    other = other[in_frame][:PAIRS]
    return tuple(pick.T), tuple(other.T)
