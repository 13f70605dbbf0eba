"""Slanted edge: spatial frequency response as in ISO 12233, with an interval from resampled
segments of the edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.special import stdtrit

from isethdr_core import ledger
from isethdr_core.data.scores import Score
from isethdr_core.plugins.ranges import check_ranges

from ..limits import HalfWidth
from ..regions import NAN, luminances

if TYPE_CHECKING:
    import xarray as xr

OVERSAMPLING = 4  # number of samples per pixel across the edge, as in ISO 12233
# Number of rows of a segment. At 5 degrees, the edge crosses one pixel in 12 rows, so that a
# segment contains all phases.
SEGMENT = 12
RESAMPLES = 200  # number of resamples of the segments
FEWEST_ROWS = 24  # smallest number of rows of an edge
# largest deviation of the edge in the reference picture from a straight line, pixels rms
STRAIGHT = 0.35
FREQUENCIES = 101  # number of frequencies, 0..1 cycles per pixel


@dataclass(frozen=True)
class SlantedEdgeResponse:
    """Spatial frequency response of the luminance across a slanted edge (ISO 12233 e-SFR): MTF50
    and the value at Nyquist.
    """

    THREAD_SAFE: ClassVar[bool] = True

    half_width: HalfWidth = 32  # pixels on each side of the edge that are used

    def __post_init__(self) -> None:
        check_ranges(self)

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Score]:
        """Return slanted_edge_mtf50 (cycles per pixel) and slanted_edge_nyquist, with 95 %
        intervals, and the number of rows used.

        Without a straight, slanted edge across the frame and valid pixels beside it there is no
        response, and the number of rows is 0.
        """
        curve = self.curve(picture, truth)
        if not curve:
            ledger.left_out(
                "slanted_edge",
                "the reference picture has no straight slanted edge across the frame, or too few"
                " pixels beside it are valid",
                NAN,
                "cycles per pixel",
            )
            ledger.error(0.0, "rows", "bound", "no row was used")
            return [Score("slanted_edge_rows", 0.0, "rows")]
        half = [
            _falls_to_half(curve["cycles_per_pixel"], m)
            for m in (curve["response"], *curve["resampled"])
        ]
        nyquist = [
            float(np.interp(0.5, curve["cycles_per_pixel"], m))
            for m in (curve["response"], *curve["resampled"])
        ]
        scores = []
        segments = curve["segments"]
        for name, unit, values in (("mtf50", "cycles per pixel", half), ("nyquist", "", nyquist)):
            # factor of Student's distribution, and correction n / (n - 1) for the variance from
            # resampling n segments
            spread = (
                np.std(values[1:])
                * np.sqrt(segments / (segments - 1))
                * stdtrit(segments - 1, 0.975)
                if segments > 1
                else NAN
            )
            scores.append(
                Score(
                    f"slanted_edge_{name}",
                    values[0],
                    unit,
                    "",
                    float(values[0] - spread),
                    float(values[0] + spread),
                )
            )
        return [*scores, Score("slanted_edge_rows", float(curve["rows"]), "rows")]

    def curve(self, picture: xr.Dataset, truth: xr.Dataset) -> dict:
        """Return the dict of cycles_per_pixel, response, resampled (draw, frequency), angle_deg,
        rows and segments; empty without an edge.

        The line of the edge is found in the reference picture, which has no noise, so that the
        response is also correct in the dark. Values are sorted by their distance from the line into
        bins of a quarter pixel; the position of a bin is the mean of its distances. The difference
        of neighbouring bins is windowed and transformed. The window is a Tukey window with a flat
        half, because a Hamming window would cut off twice as much of the long wings of diffraction.
        Binning and differencing each reduce the response by a sinc of a quarter pixel, which is
        corrected.
        """
        y, true, valid = luminances(picture, truth)
        sides = [(_line(t), t, v, w) for t, v, w in ((true, y, valid), (true.T, y.T, valid.T))]
        sides = [side for side in sides if side[0] is not None]
        if not sides:
            return {}
        (slope, offset), _, values, use = sides[0]
        rows, columns = np.indices(values.shape)
        distance = (columns - offset - slope * rows) / np.hypot(1, slope)
        reach = min(self.half_width, _room(slope, offset, values.shape))
        if reach < 4:
            return {}
        use = use & (np.abs(distance) < reach)
        bins = 2 * reach * OVERSAMPLING
        across = (distance[use] + reach) * OVERSAMPLING
        place = np.floor(across).astype(int).clip(0, bins - 1)
        segment = rows[use] // SEGMENT
        segments = segment.max() + 1 if segment.size else 0
        sums = np.stack(
            [
                np.bincount(segment * bins + place, weight, minlength=segments * bins).reshape(
                    segments, bins
                )
                for weight in (np.ones(len(place)), across, values[use])
            ]
        )
        sums = sums[:, sums[0].sum(1) > 0]
        segments = sums.shape[1]
        if segments * SEGMENT < FEWEST_ROWS:
            return {}
        frequency = np.linspace(0, 1, FREQUENCIES)
        # resampling is part of the score's definition, so its seed is fixed
        picks = np.random.default_rng(0).multinomial(
            segments, np.full(segments, 1 / segments), RESAMPLES
        )
        lines = [
            _line_spread(*np.tensordot(sums, weight, axes=(1, 0)))
            for weight in (np.ones(segments), *picks)
        ]
        if lines[0].sum() == 0:
            return {}
        lines = np.array([line for line in lines if line.sum() != 0])
        turn = np.exp(-2j * np.pi * np.outer(np.arange(lines.shape[1]) / OVERSAMPLING, frequency))
        responses = (
            np.abs(lines @ turn)
            / np.abs(lines.sum(1, keepdims=True))
            / np.sinc(frequency / OVERSAMPLING) ** 2
        )
        return {
            "cycles_per_pixel": frequency,
            "response": responses[0],
            "resampled": responses[1:],
            "angle_deg": float(np.degrees(np.arctan(slope))),
            "rows": int(np.unique(rows[use]).size),
            "segments": segments,
        }


def _line(true: np.ndarray) -> tuple[float, float] | None:
    """Return (slope, offset) of the line column = offset + slope * row along the only nearly
    vertical edge of `true`, or None if there is no such edge.
    """
    step = np.diff(true, axis=1)
    sign = np.sign(step.sum())
    strength = np.maximum(sign * step, 0.0)
    sums = strength.sum(1)
    # the edge must be in every row, and account for most of the change
    if sign == 0 or np.any(sums <= 0) or np.abs(step).sum() > 1.2 * sums.sum():
        return None
    columns = np.arange(step.shape[1]) + 0.5
    centre = strength @ columns / sums
    spread = np.sqrt(np.maximum(strength @ columns**2 / sums - centre**2, 0.0))
    rows = np.arange(len(true))
    slope, offset = np.polyfit(rows, centre, 1)
    residual = np.sqrt(np.mean((centre - offset - slope * rows) ** 2))
    if (
        residual > STRAIGHT
        or np.median(spread) > 1.5
        or not 0.01 < abs(slope) < 1
        or len(rows) < FEWEST_ROWS
    ):
        return None
    return slope, offset


def _room(slope: float, offset: float, shape: tuple[int, int]) -> int:
    """Return the smallest number of pixels between the edge and the border, over both sides and all
    rows.
    """
    ends = offset, offset + slope * (shape[0] - 1)
    return int(min(min(ends), shape[1] - 1 - max(ends)))


def _line_spread(count: np.ndarray, across: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Return the windowed line spread function from the sums of one resample of segments.

    Parameters
    ----------
    count, across, total : (bin,) number of samples, sum of their positions in bins, and sum of
        their values.
    """
    filled = count > 0
    # samples do not fill a bin evenly, so the position of a bin is their mean position
    profile = np.interp(
        np.arange(len(total)) + 0.5, across[filled] / count[filled], total[filled] / count[filled]
    )
    line = np.diff(profile)
    return line * _window(len(line))


def _window(count: int) -> np.ndarray:
    """Return a Tukey window: flat over the middle half, a cosine at both ends."""
    edge = np.minimum(np.arange(count), np.arange(count)[::-1]) / (count - 1)
    return np.where(edge < 0.25, 0.5 - 0.5 * np.cos(4 * np.pi * edge), 1.0)


def _falls_to_half(frequency: np.ndarray, response: np.ndarray) -> float:
    """Return the frequency at which the response first falls below a half, cycles per pixel, or the
    last frequency if it never does.
    """
    below = np.flatnonzero(response < 0.5)
    if not len(below) or below[0] == 0:
        return float(frequency[-1])
    k = below[0]
    return float(np.interp(-0.5, [-response[k - 1], -response[k]], frequency[k - 1 : k + 1]))
