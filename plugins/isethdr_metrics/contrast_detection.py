"""Contrast detection: how likely it is that a contrast of the scene is still about the same contrast in the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

PAIRS = 4000   # drawn per object: the median is then known to about 0.01
SMOOTH = 7     # pixels: a window over which the picture's difference from the truth is taken as its mean
PIECE = 8192   # pairs looked at together: what is worked out on the way stays in the processor's memory
FAR_SD = 5.0   # a mean this many deviations above 0 is never measured below it


@dataclass(frozen=True)
class ContrastDetection:
    """Contrast detection probability (IEEE 2020): median over pixel pairs of each object and its surround, and of the frame."""

    MEAN_OF_PARTS: ClassVar[bool] = True  # of the picture, nearly: isethdr_core.score_errors may ask for some of it

    lowest_contrast_percent: float = 5.0  # Michelson contrast of the truth that a pair needs to count
    interval_percent: float = 50.0  # the measured contrast may differ from the true one by this share of it
    reach: int = 10  # pixels between the two pixels of a pair, at most

    def narrow(self, demand):
        """Ask for the instance labels."""
        return demand.with_labels("instance")

    def __call__(self, picture, truth, labels=None):
        """Return the median probability for the frame and for each object.

        A pair of an object is one of its pixels and one outside it within `reach`. Pairs with a pixel that is not valid
        count as not detected: what is saturated shows no contrast. The interval is that of a median, as if one pixel in
        `SMOOTH` x `SMOOTH` were independent: the picture's mean is taken over such windows.
        """
        import numpy as np

        from isethdr_core import ledger
        from isethdr_core.errors import ConfigError
        from isethdr_core.scores import Score

        from .regions import NAN, frame_and_objects, median_interval

        for name in ("lowest_contrast_percent", "interval_percent"):
            if not 0 < getattr(self, name) < 100:
                raise ConfigError(f"metric {name} is {getattr(self, name)!r}; expected percent, above 0 and below 100")
        if self.reach < 1:
            raise ConfigError(f"metric reach is {self.reach!r}; expected at least 1 pixel")
        model = self._model(picture, truth)
        seen = self._map(model)
        held = seen[np.isfinite(seen)]
        # a scene without any contrast has none that could be lost
        value, low, high = median_interval(held, held.size // SMOOTH**2) if held.size else (1.0, 1.0, 1.0)
        scores = [Score("contrast_detection", value, "", "", low, high)]
        if not held.size:
            ledger.left_out("contrast_detection", "no two pixels of the truth differ by the lowest contrast", NAN, "probability")
        for name, mask in list(frame_and_objects(seen.shape, labels))[1:]:
            found = self._pairs(model, *draw_pairs(mask, self.reach))
            if found.size:
                value, low, high = median_interval(found, min(found.size, int(mask.sum())) // SMOOTH**2)
                scores.append(Score("contrast_detection", value, "", name, low, high))
            else:
                ledger.left_out(f"contrast_detection of {name}", "it has no contrast with what is around it", NAN, "probability")
        return scores

    def map(self, picture, truth):
        """Return (y, x) the mean probability of each pixel's pairs with the pixels `reach` away; NaN where none counts."""
        return self._map(self._model(picture, truth))

    def _model(self, picture, truth):
        """Return (true, mean, variance, valid), each (y, x): what the camera makes of each pixel, apart from this one draw.

        The picture is one draw. Flare and blur are smooth: their mean is the truth plus the local mean of the difference.
        """
        import numpy as np
        from scipy.ndimage import uniform_filter

        from .regions import luminances

        y, true, valid = luminances(picture, truth)
        variance = picture["variance"].values[..., 1]
        share = uniform_filter(valid.astype(float), SMOOTH, mode="nearest")

        def local(values):
            total = uniform_filter(np.where(valid, values, 0.0), SMOOTH, mode="nearest")
            return np.where(share > 1e-9, total / np.maximum(share, 1e-9), values)

        return true, true + local(y - true), np.maximum(local(variance), 0.0), valid

    def _map(self, model):
        import numpy as np

        (height, width), r = model[0].shape, self.reach
        total, count = np.zeros(height * width), np.zeros(height * width)
        for dy, dx in ((0, r), (r, 0), (r, r), (r, -r)):
            firsts = self._with_contrast(model[0], dy, dx)
            for start in range(0, firsts.size, PIECE):
                first = firsts[start : start + PIECE]
                value, first, second = self._probability(model, first, first + dy * width + dx)
                for of in (first, second):  # every pixel is first once and second once
                    total[of] += value
                    count[of] += 1
        return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(height, width)

    def _with_contrast(self, true, dy: int, dx: int):
        """Return the pixels, as indices of the flat picture, that have about the lowest contrast or more with the one `dy` rows and `dx` columns on."""
        import numpy as np

        (height, width), left = true.shape, max(-dx, 0)
        across, rows = max(width - abs(dx), 0), max(PIECE // width, 1)
        least, found = self.lowest_contrast_percent / 100 * (1 - 1e-9), [np.zeros(0, int)]    # rounding: decided when the contrast is worked out
        for top in range(0, height - dy, rows):
            a = true[top : min(top + rows, height - dy), left : left + across]
            b = true[top + dy : top + dy + len(a), left + dx : left + dx + across]
            row, column = np.nonzero(np.abs(a - b) > least * (a + b))
            found.append((top + row) * width + left + column)
        return np.concatenate(found)

    def _pairs(self, model, first, second):
        import numpy as np

        return self._probability(model, *(np.ravel_multi_index(at, model[0].shape) for at in (first, second)))[0]

    def _probability(self, model, first, second):
        """Return the probabilities of the pairs that have contrast, and these pairs; `first` and `second` are indices of the flat picture."""
        import numpy as np

        true, mean, variance, valid = (values.ravel() for values in model)
        a, b = true[first], true[second]
        sums = a + b
        contrast = np.abs(a - b) / np.where(sums > 0, sums, 1.0)
        counts = np.flatnonzero((contrast > self.lowest_contrast_percent / 100) & (sums > 0))
        first, second, swap = first[counts], second[counts], a[counts] < b[counts]
        bright, dark = np.where(swap, second, first), np.where(swap, first, second)
        value = pair_probability(mean[bright], variance[bright], mean[dark], variance[dark], contrast[counts], self.interval_percent / 100)
        return np.where(valid[first] & valid[second], value, 0.0), first, second


def pair_probability(bright, bright_variance, dark, dark_variance, contrast, interval: float = 0.5):
    """Return the probability that the Michelson contrast of two noisy values lies within `contrast` (1 +- `interval`).

    Parameters
    ----------
    bright, dark : means of the pixel that is truly brighter and of the other, any unit.
    bright_variance, dark_variance : of the two, normal and independent.
    contrast : true Michelson contrast, above 0.
    interval : share of the contrast, below 1.

    Notes
    -----
    (b - d) / (b + d) >= c is (1 - c) b - (1 + c) d >= 0 where b + d > 0, so the interval is a wedge with its tip at the
    origin: the probability of two correlated normals having their signs, exact by Owen's T function (Owen 1956). The
    definition follows Geese, Seger, Paolillo 2018 and IEEE Std 2020-2024; the order of bright and dark has to be kept.
    """
    import numpy as np
    from scipy.special import ndtr

    low, high = contrast * (1 - interval), contrast * (1 + interval)
    mean, sd = [], []
    for c in (low, high):
        mean.append((1 - c) * bright - (1 + c) * dark)
        sd.append(np.sqrt((1 - c) ** 2 * bright_variance + (1 + c) ** 2 * dark_variance))
    noise_free = (sd[0] <= 0) | (sd[1] <= 0)
    safe = [np.where(noise_free, 1.0, s) for s in sd]
    h, k = mean[0] / safe[0], -mean[1] / safe[1]   # both have to be positive: above the lower and below the upper end
    out = ndtr(h) + ndtr(k) - 1                    # exact but for pairs that are measured negative
    close = (np.minimum(bright, dark) < FAR_SD * np.sqrt(bright_variance + dark_variance)) & ~noise_free
    if np.any(close):
        together = (1 - low) * (1 - high) * bright_variance + (1 + low) * (1 + high) * dark_variance
        rho = -(together / (safe[0] * safe[1]))[close]
        out[close] = both_positive(h[close], k[close], rho)
    exact = ((mean[0] >= 0) & (mean[1] <= 0)).astype(float)
    return np.clip(np.where(noise_free, exact, out), 0.0, 1.0)


def both_positive(h, k, rho):
    """Return P(h + u > 0 and k + v > 0) of standard normals with correlation `rho` (Owen 1956, eq. 2.1)."""
    import numpy as np
    from scipy.special import ndtr, owens_t

    tiny = 1e-12
    h, k = (np.where(np.abs(v) < tiny, tiny, v) for v in (h, k))
    root = np.sqrt(np.maximum(1 - rho**2, 1e-24))
    apart = np.where(h * k < 0, 0.5, 0.0)
    return (ndtr(h) + ndtr(k)) / 2 - owens_t(h, (k / h - rho) / root) - owens_t(k, (h / k - rho) / root) - apart


def draw_pairs(mask, reach: int):
    """Return (first, second) index pairs: pixels of `mask` and pixels outside it at most `reach` away."""
    import numpy as np

    rng = np.random.default_rng(0)  # the draw is part of the score's definition: the same picture, the same score
    rows, columns = np.nonzero(mask)
    window = tuple(slice(max(i.min() - 1, 0), i.max() + 2) for i in (rows, columns))
    from scipy.ndimage import distance_transform_edt

    near = distance_transform_edt(np.pad(mask[window], 1)[1:-1, 1:-1]) <= reach
    inside = np.argwhere(near & mask[window]) + [window[0].start, window[1].start]
    pick = inside[rng.integers(len(inside), size=8 * PAIRS)]
    offsets = np.argwhere(np.hypot(*np.indices((2 * reach + 1,) * 2) - reach) <= reach) - reach
    other = pick + offsets[rng.integers(len(offsets), size=len(pick))]
    held = np.all((other >= 0) & (other < mask.shape), axis=1)
    held[held] = ~mask[tuple(other[held].T)]
    pick, other = pick[held][:PAIRS], other[held][:PAIRS]
    return tuple(pick.T), tuple(other.T)
