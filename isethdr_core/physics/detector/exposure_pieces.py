"""An exposure, divided at the times when lamps switch, for pixels that are not linear. Within a
piece each pulsed lamp is either on or off.
"""

from __future__ import annotations

import numpy as np

from .temporal_modulation import Modulation, light_s, square_wave_pieces

PER_PERIOD = 8  # number of pieces per period of ripple, so that it is nearly linear within each


def pieces(
    modulations: list[Modulation],
    start_s: np.ndarray,
    duration_s: float,
    per_period: int = PER_PERIOD,
) -> tuple[np.ndarray, np.ndarray]:
    """Return (starts_s, durations_s) of the pieces of exposures in order, both (piece, ...) with
    the shape of `start_s`. Together the pieces are the exposure.

    With several lamps, pieces end where any lamp switches. Exposures with fewer pieces than others
    have pieces of duration 0.

    Parameters
    ----------
    modulations : `Modulation` of each lamp.
    start_s : start of each exposure, s, an array of any shape.
    duration_s : duration of all exposures, s.
    per_period : number of pieces per period of ripple.
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
    """Return the approximate number of pieces that `pieces` makes of an exposure of `duration_s`
    seconds.
    """
    return 1 + sum(
        (2 * (m.duty < 1) + PER_PERIOD * (m.depth > 0)) * m.frequency_hz * duration_s
        for m in modulations
    )


def relative_in_pieces(
    modulation: Modulation, starts_s: np.ndarray, durations_s: np.ndarray
) -> np.ndarray:
    """Return the mean light of each piece relative to the mean over all time; 0 in a piece of
    duration 0.

    Parameters
    ----------
    modulation : temporal modulation of the light.
    starts_s : start of each piece, s, any shape.
    durations_s : duration of each piece, s, same shape, 0 or more.
    """
    some = durations_s > 0
    return np.where(
        some, light_s(modulation, starts_s, durations_s) / np.where(some, durations_s, 1.0), 0.0
    )
