"""Car following by the intelligent driver model (Treiber, Hennecke and Helbing 2000, eq. 2, 3)."""

from __future__ import annotations

import math

ACCELERATION_M_S2 = 1.5
BRAKING_M_S2 = 2.0  # comfortable deceleration
HARDEST_M_S2 = 8.0  # hardest deceleration, on dry asphalt
TIME_GAP_S = 1.2
STANDSTILL_M = 2.0
EXPONENT = 4.0
LEAST_M = 0.1  # least gap in the model, so that it stays finite
EASY_M_S2 = 1.2  # deceleration that hardly shows
LEAST_S = 0.2  # least time gap that a driver accepts


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
    speed, free_speed, leader_speed : speeds of the driver, of the driver on an empty road, and of
        the leader, m/s.
    gap_m : free road up to the leader, m; infinite without a leader.
    time_gap_s : time gap that the driver keeps to a leader in addition to `STANDSTILL_M`, s.
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
    """Return the speed, m/s, from which a driver slows to the leader's speed within a gap, m, with
    the deceleration `EASY_M_S2`.
    """
    room = max(gap_m - STANDSTILL_M, 0.0)
    return math.sqrt(leader_speed**2 + 2 * EASY_M_S2 * room)


def accepted_gap_s(gap_m: float, speed: float) -> float:
    """Return the time gap, s, of a driver who keeps a given gap, m; it lies between `LEAST_S` and
    `TIME_GAP_S`.
    """
    return min(max((gap_m - STANDSTILL_M) / max(speed, 0.1), LEAST_S), TIME_GAP_S)
