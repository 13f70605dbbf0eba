"""Score order: which end of a score is the better one.

Scores of other people's metrics, and scores that describe a scene, have no entry: both of their
ends are then shown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

# most telling scores first: a table without room for all scores shows the first ones
LARGER_IS_BETTER = {
    "ssim": True,
    "ssim_pu21": True,
    "ciede2000": False,
    "cie94": False,
    "cie76": False,
    "contrast_detection": True,
    "dynamic_range": True,
    "snr_at_10": True,
    "log_luminance_error": False,
    "normalized_flare": False,
    "line_profile_error": False,
    "object_contrast_snr": True,
    "object_d_prime": True,
    "object_d_prime_clutter": True,
    "dynamic_range_dark_noise": True,
    "dynamic_range_snr_10db": True,
    "dynamic_range_bottom": False,
    "dynamic_range_dark_noise_bottom": False,
    "dynamic_range_snr_10db_bottom": False,
    "dynamic_range_top": True,
    "valid_share": True,
    "saturated_share": False,
}
SNR = "snr_at_"  # start of the names of signal-to-noise ratios; a luminance follows
# relative difference of two scores that are the same but for the rounding of sums over a picture
ROUNDING = 1e-9


def larger_is_better(score: str) -> bool | None:
    """Return whether larger values of a score are better; None where that is not known."""
    return True if score.startswith(SNR) else LARGER_IS_BETTER.get(score)


def most_telling_first(scores: Sequence[str]) -> list[str]:
    """Return the names of scores; those by which cameras are commonly compared come first."""
    order = {name: k for k, name in enumerate(LARGER_IS_BETTER)}
    signals = order[f"{SNR}10"]
    return sorted(
        scores,
        key=lambda name: signals if name.startswith(SNR) else order.get(name, len(order)),
    )


class Interval(Protocol):
    """A value with the ends of its 95 % interval; NaN for ends that are not known."""

    @property
    def value(self) -> float:
        """The value."""

    @property
    def low(self) -> float:
        """The lower end."""

    @property
    def high(self) -> float:
        """The upper end."""


def half_width_of_difference(first: Interval, second: Interval) -> float:
    """Return the half width of the 95 % interval of a difference, in the unit of both values; NaN
    if an interval is not known.

    Parameters
    ----------
    first, second : two independent values of one unit.

    Notes
    -----
    sqrt(h1^2 + h2^2) for the half widths h1 and h2 of the values. Runs of one rendering share its
    noise, which is then counted twice.
    """
    return math.hypot((first.high - first.low) / 2, (second.high - second.low) / 2)


def differ(first: Interval, second: Interval) -> bool | None:
    """Return whether two scores differ by more than their intervals; None if an interval is not
    known and the values are not equal. Rounding is no difference.

    Parameters
    ----------
    first, second : two independent values of one unit. Runs of one rendering share its noise: such
        runs may differ although this function returns False.
    """
    if math.isclose(first.value, second.value, rel_tol=ROUNDING):
        return False
    half_width = half_width_of_difference(first, second)
    if math.isnan(half_width) or math.isnan(first.value - second.value):
        return None
    return abs(first.value - second.value) > half_width
