"""Temporal modulation of lamps: the exact light of any exposure, for pulse-width modulation and
mains ripple.

Times are in seconds, phases in periods (0..1). The phase at a time is computed from the exact
product of time and frequency, so that it is as precise after a day as after a millisecond.
Intervals are given by start and duration, because an end would be a rounded sum. All arguments
broadcast: one value, one per row, or one per pixel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Modulation(NamedTuple):
    """Modulation of a light about its mean: pulse-width modulation (duty below 1), ripple (depth
    above 0), or none.
    """

    frequency_hz: float = 0.0
    duty: float = 1.0  # share of the period in which the light is on, with the strength mean / duty
    depth: float = 0.0  # amplitude of a sinusoidal ripple / mean
    phase: float = 0.0  # phase at time 0, periods; a pulse starts, and a ripple peaks, at phase 0


def constant(modulation: Modulation) -> bool:
    """Return whether the light is constant."""
    return modulation.duty == 1.0 and modulation.depth == 0.0


def light_s(
    modulation: Modulation, start_s: float | np.ndarray, duration_s: float | np.ndarray
) -> np.ndarray:
    """Return the integral of the light over each exposure, relative to its mean over all time,
    seconds; exact.

    Parameters
    ----------
    modulation : frequency, duty, depth and phase of the light; at the frequency 0 the state of
        `phase` persists.
    start_s, duration_s : start and duration of each exposure, s; broadcast against each other.
    """
    frequency_hz, duty, depth, phase = modulation
    if constant(modulation):
        return np.broadcast_to(
            np.asarray(duration_s, float),
            np.broadcast_shapes(np.shape(start_s), np.shape(duration_s)),
        )
    if depth:
        return ripple_s(start_s, duration_s, frequency_hz, depth, phase)
    return square_wave_s(start_s, duration_s, frequency_hz, duty, phase) / duty


def relative_light(
    modulation: Modulation, start_s: float | np.ndarray, duration_s: float | np.ndarray
) -> np.ndarray:
    """Return the mean light of each exposure, of a duration above 0, relative to its mean over all
    time; 1 for constant light.

    Parameters
    ----------
    modulation : frequency, duty, depth and phase of the light.
    start_s, duration_s : start and duration of each exposure, s; broadcast against each other.
    """
    return light_s(modulation, start_s, duration_s) / duration_s


def row_starts_s(rows: int, line_time_s: float, start_s: float = 0.0) -> np.ndarray:
    """Return the start of each row's exposure, (rows, 1) seconds, for a rolling or global shutter.

    Parameters
    ----------
    rows : number of rows.
    line_time_s : time from row to row, s; 0 for a global shutter.
    start_s : start of the first row, s.
    """
    return (start_s + line_time_s * np.arange(rows))[:, None]


def phase_at(
    time_s: float | np.ndarray, frequency_hz: float | np.ndarray, phase: float | np.ndarray = 0.0
) -> np.ndarray:
    """Return time x frequency + phase modulo 1, with only the rounding error of the result (exact
    products, Dekker 1971).

    Parameters
    ----------
    time_s : time, s.
    frequency_hz : frequency, Hz, 0 or more.
    phase : phase at time 0, periods.
    """
    t = np.asarray(time_s, float)
    f = np.asarray(frequency_hz, float)
    product = t * f
    split = 134217729.0  # 2^27 + 1 splits a float64 into two halves with exact products
    t_high = split * t - (split * t - t)
    f_high = split * f - (split * f - f)
    t_low = t - t_high
    f_low = f - f_high
    error = ((t_high * f_high - product) + t_high * f_low + t_low * f_high) + t_low * f_low
    turns = (product - np.floor(product)) + (error + (phase - np.floor(phase)))
    turns = turns - np.floor(turns)
    return np.where(turns >= 1.0, 0.0, turns)  # a tiny negative value was rounded up to 1


def square_wave_s(
    start_s: float | np.ndarray,
    duration_s: float | np.ndarray,
    frequency_hz: float | np.ndarray,
    duty: float | np.ndarray,
    phase: float | np.ndarray = 0.0,
) -> np.ndarray:
    """Return the time in an exposure, seconds, in which a pulse-width modulated lamp is on; exact.

    Parameters
    ----------
    start_s, duration_s : start and duration of each exposure, s; the duration is 0 or more.
    frequency_hz : frequency of the lamp, Hz, 0 or more; at 0 the state of `phase` persists.
    duty : share of the period in which the lamp is on, 0..1. It switches on at phase 0.
    phase : phase at time 0, periods.
    """
    frequency = np.asarray(frequency_hz, float)
    duration = np.asarray(duration_s, float)
    at = phase_at(start_s, frequency, phase)
    periods = frequency * duration
    whole_periods = np.floor(periods)
    fraction = periods - whole_periods
    # The rest of the exposure may contain light of this period and of the next one. Counts of
    # periods are never subtracted.
    on = np.clip(duty - at, 0.0, fraction) + np.clip(fraction - (1.0 - at), 0.0, duty)
    safe = np.where(frequency > 0, frequency, 1.0)
    still = np.where(at < duty, duration, 0.0)
    return np.where(frequency > 0, np.minimum((whole_periods * duty + on) / safe, duration), still)


def ripple_s(
    start_s: float | np.ndarray,
    duration_s: float | np.ndarray,
    frequency_hz: float | np.ndarray,
    depth: float | np.ndarray,
    phase: float | np.ndarray = 0.0,
) -> np.ndarray:
    """Return the integral of 1 + depth cos(2 pi (frequency t + phase)) over an exposure, seconds;
    exact.

    A lamp on mains of 50 or 60 Hz has a ripple of 100 or 120 Hz. The rounding error is relative to
    the integral of the mean light.

    Parameters
    ----------
    start_s, duration_s : start and duration of each exposure, s.
    frequency_hz : frequency of the ripple, Hz, 0 or more.
    depth : amplitude over the mean, 0 to 1; the mean light is 1.
    phase : phase at time 0, periods.
    """
    periods = np.asarray(frequency_hz, float) * duration_s
    middle = phase_at(start_s, frequency_hz, phase) + 0.5 * (
        periods - 2.0 * np.floor(0.5 * periods)
    )
    return duration_s * (1.0 + depth * np.sinc(periods) * np.cos(2 * np.pi * middle))


def square_wave_pieces(
    start_s: np.ndarray, duration_s: float, frequency_hz: float, duty: float, phase: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return (durations_s, on): the pieces of constant light of exposures, in order, for
    `charge_dynamics.flow_pieces`.

    Parameters
    ----------
    start_s : start of each exposure, s, any shape.
    duration_s : duration of all exposures, s, 0 or more.
    frequency_hz : frequency of the lamp, Hz, 0 or more.
    duty : share of the period in which the lamp is on, 0 to 1.
    phase : phase at time 0, periods; the lamp switches on at phase 0.

    Returns
    -------
    durations_s, on : (piece, ...) with the shape of `start_s`: durations in seconds, and the states
        1 (on) and 0 (off), alternating. Exposures with fewer pieces than others have pieces of
        duration 0, which have no effect.
    """
    at = phase_at(start_s, frequency_hz, phase)
    if frequency_hz * duration_s == 0 or not 0 < duty < 1:
        lit = np.where(at < duty, 1.0, 0.0)
        return np.full((1, *lit.shape), float(duration_s)), lit[None]
    count = 2 * int(np.ceil(frequency_hz * duration_s)) + 3
    durations = []
    states = []
    remaining_s = np.full(at.shape, float(duration_s))
    # pieces 2 n and 2 n + 1 are the on and off parts of period n; the exposure starts in period 0
    for k in range(count):
        end = k // 2 + (duty if k % 2 == 0 else 1.0)
        begin = k // 2 + (0.0 if k % 2 == 0 else duty)
        full = (
            (end - np.maximum(begin, at)) / frequency_hz
            if k < 2
            else np.full(at.shape, (duty if k % 2 == 0 else 1 - duty) / frequency_hz)
        )
        piece = np.clip(full, 0.0, remaining_s)
        remaining_s = remaining_s - piece
        durations.append(piece)
        states.append(np.full(at.shape, 1.0 - k % 2))
    return np.stack(durations), np.stack(states)
