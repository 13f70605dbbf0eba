"""Car following by the intelligent driver model (Treiber, Hennecke and Helbing 2000, eq. 2, 3)."""

from __future__ import annotations

import math

ACCELERATION_M_S2 = 1.5
BRAKING_M_S2 = 2.0  # comfortable
HARDEST_M_S2 = 8.0  # on dry asphalt
TIME_GAP_S = 1.2
STANDSTILL_M = 2.0
EXPONENT = 4.0
LEAST_M = 0.1  # of a gap, so that the model stays finite
EASY_M_S2 = 1.2  # braking that nobody notices
LEAST_S = 0.2  # of the time gap that a driver accepts


def acceleration_m_s2(
    speed: float,
    free_speed: float,
    gap_m: float,
    leader_speed: float,
    time_gap_s: float = TIME_GAP_S,
) -> float:
    """Return the acceleration of a driver.

    Parameters
    ----------
    speed, free_speed, leader_speed : m/s; `free_speed` is that of an empty road.
    gap_m : free road up to the leader; infinite without one.
    time_gap_s : that the driver keeps to a leader, besides `STANDSTILL_M`.
    """
    if free_speed <= 0:
        return -BRAKING_M_S2 if speed > 0 else 0.0
    free = 1 - (speed / free_speed) ** EXPONENT
    wanted = STANDSTILL_M + max(
        0.0,
        speed * time_gap_s
        + speed * (speed - leader_speed) / (2 * math.sqrt(ACCELERATION_M_S2 * BRAKING_M_S2)),
    )
    close = (wanted / max(gap_m, LEAST_M)) ** 2
    return max(ACCELERATION_M_S2 * (free - close), -HARDEST_M_S2)


def speed_that_stops_m_s(gap_m: float, leader_speed: float) -> float:
    """Return the speed from which a driver gets down to a leader's without effort in a gap."""
    room = max(gap_m - STANDSTILL_M, 0.0)
    return math.sqrt(leader_speed**2 + 2 * EASY_M_S2 * room)


def accepted_gap_s(gap_m: float, speed: float) -> float:
    """Return the time gap of a driver who keeps to a gap that is shorter than usual."""
    return min(max((gap_m - STANDSTILL_M) / max(speed, 0.1), LEAST_S), TIME_GAP_S)
