"""SNR curve: signal-to-noise ratio over luminance, from the stated variance and from the difference
to the reference picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.derived_once import once
from isethdr_core.data.scores import Score
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Bins, Luminance
from ..regions import (
    block_of_picture,
    check_pair,
    luminances,
    median_interval,
    noise_of_blocks,
    undenoised,
    variance_stated,
)

if TYPE_CHECKING:
    import xarray as xr

# least pixels per independent value; a demosaic correlates neighbours, so one pixel in 3 x 3 counts
PIXELS_PER_INDEPENDENT = 9
# Smallest number of independent values of a bin that a score may use. A median lies outside the
# smallest and the largest of n values with the probability 2 * 0.5**n, so an interval of 95 % needs
# 6 values.
FEWEST_INDEPENDENT = 6


@dataclass(frozen=True)
class SnrCurve:
    """SNR in dB at given luminances, from the variance that the picture states; `curve` returns the
    whole table.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # luminances to score; luminances that the scene does not contain get no score
    luminances_cd_m2: tuple[Luminance, ...] = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)
    bins_per_decade: Bins = 6  # number of bins of true luminance per decade

    def __post_init__(self) -> None:
        check_ranges(self)

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Any]:
        """Return one score per luminance with enough pixels near it, named snr_at_<cd/m2>.

        A bin of true luminance is used if it has at least `FEWEST_INDEPENDENT` independent values.
        The median luminance of one such bin must be at most one width of a bin away from the
        luminance of the score.
        """
        picture = undenoised(picture)
        check_pair(picture, truth)
        if not variance_stated(picture, "SNR", "dB"):
            return []
        fewest = FEWEST_INDEPENDENT * pixels_per_independent(picture)
        rows = _rows_with_enough_pixels(self.curve(picture, truth), fewest)
        scores = []
        for level in self.luminances_cd_m2:
            distance = np.abs(np.log10(rows["luminance_cd_m2"] / level))
            if distance.min(initial=np.inf) > 1 / self.bins_per_decade:
                why = (
                    f"each bin near this luminance has fewer than {fewest} valid pixels in even"
                    " surroundings"
                )
                ledger.left_out(f"SNR at {level:g} cd/m2", why, np.nan, "dB")
                continue
            nearest = int(distance.argmin())
            value = self._at(rows, nearest, level)
            low, high = rows["snr_interval_db"][nearest]
            if not np.isfinite(value):
                ledger.left_out(
                    f"SNR at {level:g} cd/m2", "the picture states no noise there", np.nan, "dB"
                )
                continue
            scores.append(Score(f"snr_at_{level:g}", value, "dB", "", value + low, value + high))
        return scores

    def _at(self, rows: dict[str, np.ndarray], nearest: int, level: float) -> float:
        """Return the SNR in dB at `level` cd/m2, on the line through the two nearest rows of the
        table.

        The second row is the next one on the other side of the level. If there is none within two
        bins, it is the next one on the same side. With a single row, the slope is that of shot
        noise.
        """
        x = np.log10(rows["luminance_cd_m2"] / level)
        snr = rows["snr_db"]
        across = 1 if x[nearest] < 0 else -1
        for second in (nearest + across, nearest - across):
            if not (0 <= second < len(x) and abs(x[second]) <= 2 / self.bins_per_decade):
                continue
            if np.isfinite(snr[[nearest, second]]).all():
                slope = (snr[second] - snr[nearest]) / (x[second] - x[nearest])
                break
        else:
            slope = 10.0  # dB per decade
        return float(snr[nearest] - slope * x[nearest])

    def curve(self, picture: xr.Dataset, truth: xr.Dataset) -> dict:
        """Return the table, with one row per bin of true luminance that contains a valid pixel.

        True luminance and variance are means over cells of the colour filter array, so that all
        filters count equally. A pixel whose luminance differs from that of its cell by more than a
        factor of 2, such as one at the border of a lamp, does not count.

        Returns
        -------
        dict of arrays (bin,):
            luminance_cd_m2 : median true luminance of the bin.
            low_cd_m2, high_cd_m2 : borders of the bin.
            snr_db : 20 log10 of the luminance / root of the median stated variance. The median is
                not changed by a few pixels with flare.
            snr_measured_db : 20 log10 of the luminance / rms difference from the reference picture.
                Blur, demosaic and flare count as noise here.
            pixels : number of pixels that count.
            snr_interval_db : (bin, 2) ends of the 95 % interval minus snr_db. One pixel in 9, or
                one in a larger cell of the array, counts as independent.
        """
        y, true, valid = luminances(picture, truth)
        blocks = noise_of_blocks(picture, truth)
        light = blocks.light
        use = blocks.even & (light > 0)
        per_independent = pixels_per_independent(picture)

        def bins() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
            bin_of = np.floor(np.log10(light[use]) * self.bins_per_decade + 1e-9).astype(int)
            lowest = bin_of.min(initial=0)
            counts = np.bincount(bin_of - lowest)
            index = (np.cumsum(counts > 0) - 1).astype(np.uint16)[bin_of - lowest]
            order = np.argsort(index, kind="stable")  # radix sort for two bytes
            return np.flatnonzero(counts) + lowest, counts[counts > 0], index, order

        block = block_of_picture(picture)
        key = "bins", self.bins_per_decade, block, valid.tobytes()
        present, count, index, order = once(key, (truth,), bins)

        def mean(values: np.ndarray) -> np.ndarray:
            return np.bincount(index, values[use], minlength=len(present)) / count

        def medians(values: np.ndarray) -> np.ndarray:
            parts = np.split(values[use][order], np.cumsum(count)[:-1])
            return (
                np.array(
                    [
                        median_interval(part, len(part) // per_independent)
                        for part in parts
                        if len(part)
                    ]
                )
                .reshape(-1, 3)
                .T
            )

        signal = once(("signal", *key), (truth,), lambda: medians(light)[0])
        reported, least, most = medians(blocks.noise)
        # a noise-free picture has an infinite SNR
        with np.errstate(divide="ignore", invalid="ignore"):
            snr, measured = (
                20 * np.log10(signal / np.sqrt(power))
                for power in (reported, mean((y - true) ** 2))
            )
            interval = 10 * np.log10(reported / np.stack([most, least]))
        return {
            "luminance_cd_m2": signal,
            "low_cd_m2": 10.0 ** (present / self.bins_per_decade),
            "high_cd_m2": 10.0 ** ((present + 1) / self.bins_per_decade),
            "snr_db": snr,
            "snr_interval_db": interval.T,
            "snr_measured_db": measured,
            "pixels": count,
        }


def pixels_per_independent(picture: xr.Dataset) -> int:
    """Return how many pixels count as one independent value: at least a cell of the array, because
    its pixels have one mean variance.
    """
    return max(PIXELS_PER_INDEPENDENT, block_of_picture(picture).pixels)


def _rows_with_enough_pixels(table: dict, fewest: int) -> dict:
    """Return the rows of the table with at least `fewest` pixels.

    A bin may have only a few pixels next to a lamp. They contain flare, and therefore more noise
    than other pixels of their luminance. Renderer noise would move other pixels into this bin, and
    so change its median.
    """
    enough = table["pixels"] >= fewest
    return {name: column[enough] for name, column in table.items()}
