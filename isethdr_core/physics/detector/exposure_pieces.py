"""An exposure cut where lamps switch, so that within a piece each pulsed lamp is on or off: for
pixels that are not linear.
"""

from __future__ import annotations

import numpy as np

from .temporal_modulation import Modulation, light_s, square_wave_pieces

PER_PERIOD = 8  # pieces of a period of ripple, so that it is nearly straight within each


def pieces(
    modulations: list[Modulation],
    start_s: np.ndarray,
    duration_s: float,
    per_period: int = PER_PERIOD,
) -> tuple[np.ndarray, np.ndarray]:
    """Return (starts_s, durations_s) of intervals in order, both (pieces, ...) with the shape of
    `start_s`. Together they are the exposure.

    Rows with fewer edges have intervals of no duration. With several lamps, the intervals end at
    the edges of all.

    Parameters
    ----------
    modulations : `Modulation` of each lamp.
    start_s : start of each exposure, an array of any shape.
    duration_s : duration of all exposures.
    per_period : intervals in a period of ripple.
    """
    start = np.asarray(start_s, float)
    edges = [np.full((1, *start.shape), float(duration_s))]
    for frequency_hz, duty, depth, phase in modulations:
        if duty < 1:
            durations, _ = square_wave_pieces(start, duration_s, frequency_hz, duty, phase)
            edges.append(np.cumsum(durations[:-1], axis=0))
        elif depth > 0:
            count = int(np.ceil(per_period * frequency_hz * duration_s))
            shares = np.arange(1, max(count, 1)) / max(count, 1)
            edges.append(
                np.broadcast_to(
                    (duration_s * shares).reshape(-1, *(1,) * start.ndim),
                    (len(shares), *start.shape),
                )
            )
    ends = np.minimum(np.sort(np.concatenate(edges), axis=0), duration_s)
    begins = np.concatenate([np.zeros((1, *start.shape)), ends[:-1]])
    return start + begins, ends - begins


def count(modulations: list[Modulation], duration_s: float) -> float:
    """Return about how many pieces `pieces` makes of an exposure, without making them."""
    return 1 + sum(
        (2 * (m.duty < 1) + PER_PERIOD * (m.depth > 0)) * m.frequency_hz * duration_s
        for m in modulations
    )


def relative_in_pieces(
    modulation: Modulation, starts_s: np.ndarray, durations_s: np.ndarray
) -> np.ndarray:
    """Return the mean light of each piece relative to the mean over time; 0 in a piece of no
    duration.

    Parameters
    ----------
    modulation : how the light varies in time.
    starts_s : start of each piece, s, any shape.
    durations_s : duration of each piece, s, same shape, 0 or more.
    """
    some = durations_s > 0
    return np.where(
        some, light_s(modulation, starts_s, durations_s) / np.where(some, durations_s, 1.0), 0.0
    )
