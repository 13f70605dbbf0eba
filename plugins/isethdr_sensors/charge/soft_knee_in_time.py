"""The charge of a pixel with a soft knee under light that varies during its exposure.

The exposure is divided into pieces of constant light, and the charge is computed from piece to
piece. The share of a flash that is left at the end depends on whether it comes early or late in the
exposure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.charge_dynamics import Well, flow_varying
from isethdr_core.physics.detector.charge_dynamics_noise import EMPTY, flow_moments
from isethdr_core.physics.detector.exposure_pieces import count, pieces, relative_in_pieces
from isethdr_core.physics.detector.noise import poisson
from isethdr_core.physics.detector.random_words import words
from isethdr_core.physics.detector.temporal_modulation import light_s

if TYPE_CHECKING:
    from isethdr_core.physics.detector.temporal_modulation import Modulation
    from isethdr_core.runs.seeds import Generator

MOST_PIECES = 10_000  # largest number of pieces of an exposure


def check(components: Sequence[tuple[Modulation, np.ndarray]], exposure_s: float) -> None:
    """Refuse lamps that switch too often within one exposure for following every switch.

    Parameters
    ----------
    components : [(Modulation, (y, x) electrons), ...]; only the modulations count.
    exposure_s : exposure time, s.
    """
    modulations = [m for m, _ in components]
    if count(modulations, exposure_s) > MOST_PIECES:
        fastest = max(m.frequency_hz for m in modulations)
        raise ConfigError(
            f"a light of {fastest:g} Hz switches too often within {exposure_s:g} s: the response of"
            " this pixel is nonlinear, so each interval between switches is computed; expected at"
            f" most {MOST_PIECES} intervals in an exposure; type sensor=bayer, or remove this"
            " light's modulation, because only its mean matters at that frequency"
        )


def untouched_e(spilled_e: float, exposure_s: float, soft: Well) -> float:
    """Return the largest number of arriving electrons of which at most `spilled_e` spill, whenever
    they arrive. The worst case is that all arrive at the start of the exposure.

    Parameters
    ----------
    spilled_e : electrons that may spill, above 0.
    exposure_s : exposure time, s.
    soft : `charge_dynamics.Well` of the photodiode.
    """
    return max(
        0.0, soft.knee_e + soft.thermal_e * np.log(spilled_e / (exposure_s * soft.knee_e_per_s))
    )


def worst_spill(charge_e: float, exposure_s: float, soft: Well) -> float:
    """Return an upper bound of the share of `charge_e` that has spilled, whenever it arrived.

    Parameters
    ----------
    charge_e : arrived electrons, above 0.
    exposure_s : exposure time, s.
    soft : `charge_dynamics.Well` of the photodiode.
    """
    return min(1.0, exposure_s * float(soft.overflow_e_per_s(charge_e)) / charge_e)


@dataclass(frozen=True)
class Exposure:
    """One exposure of a photodiode with a soft knee."""

    exposure_s: float
    well: Well  # soft knee of the photodiode
    untouched_e: float  # arrived electrons up to which nothing spills


def stays(
    total_e: np.ndarray,
    components: Sequence[tuple[Modulation, np.ndarray]],
    start_s: np.ndarray,
    exposure: Exposure,
    generator: Generator | None,
    first_row: int,
) -> np.ndarray:
    """Return the charge that stays in the photodiode, (y, x) of a block of rows, electrons. The
    rest of `total_e` has spilled.

    Parameters
    ----------
    total_e : (y, x) electrons that arrived: counts, or means without a generator.
    components : [(Modulation, (y, x) mean electrons of the exposure at the mean light over time),
        ...]. One of the constant components is the dark charge.
    start_s : (y, 1) start of the exposure of each row, s.
    exposure : exposure time and photodiode.
    generator : key of the noise; None for the mean.
    first_row : first row of the block, counted from the sensor's upper left pixel.

    Notes
    -----
    The counted electrons are assumed to arrive with the time course of the mean. Two effects add
    variance: the pulse in which each electron arrived, and the choice of the electrons that spill.
    Their variance is that of `flow_moments` minus the part that the count explains.
    """
    exposure_s = exposure.exposure_s
    soft = exposure.well
    charge = np.array(total_e, float)
    y, x = np.nonzero(charge > exposure.untouched_e)
    if not len(y):
        return charge
    arrived = charge[y, x]
    begins = np.asarray(start_s, float).ravel()
    starts, durations = pieces([m for m, _ in components], begins, exposure_s)
    mean = sum(
        part[y, x] * (light_s(m, begins, exposure_s) / exposure_s)[y] for m, part in components
    )
    currents = [
        (relative_in_pieces(m, starts, durations), part[y, x] / exposure_s * (arrived / mean))
        for m, part in components
    ]
    moments = EMPTY
    for k in range(len(starts)):
        moments = flow_moments(
            moments,
            sum(relative[k][y] * rate for relative, rate in currents),
            durations[k][y],
            soft,
        )
    charge_left = moments.charge_e
    if any(m.depth for m, _ in components):  # light with a ripple is not constant within a piece
        rows = np.unique(y)
        charge_left = np.zeros(charge.shape)
        charge_left[rows] = _varying(
            charge[rows],
            [(m, part[rows]) for m, part in components],
            begins[rows, None],
            exposure_s,
            soft,
        )
        charge_left = charge_left[y, x]
    if generator is not None:
        explained = (moments.charge_var_e2 + moments.covariance_e2) ** 2 / arrived
        variance = np.clip(
            moments.charge_var_e2 - explained, 0.0, np.maximum(arrived - charge_left, 0.0)
        )
        word = words(
            generator.stream("pixel", "spill"),
            first_row,
            first_row + len(charge),
            0,
            charge.shape[1],
        )[y, x]
        charge_left = np.maximum(charge_left + variance - poisson(variance, word), 0.0)
    charge[y, x] = charge_left
    return charge


def _varying(
    total_e: np.ndarray,
    components: Sequence[tuple[Modulation, np.ndarray]],
    start_s: np.ndarray,
    exposure_s: float,
    soft: Well,
) -> np.ndarray:
    """Return the mean charge (y, x) that is left of `total_e`, by exact quadrature. The arguments
    are those of `stays`.
    """
    mean = sum(part * (light_s(m, start_s, exposure_s) / exposure_s) for m, part in components)
    scale = np.divide(total_e, mean, out=np.zeros_like(total_e), where=mean > 0) / exposure_s
    rates = [(m, part * scale) for m, part in components]

    def arriving(begin_s: np.ndarray, duration_s: np.ndarray) -> np.ndarray:
        return sum(rate * light_s(m, begin_s, duration_s) for m, rate in rates)

    charge_left = 0.0
    for begin, duration in zip(
        *pieces([m for m, _ in components], start_s, exposure_s, per_period=2), strict=True
    ):
        charge_left = flow_varying(charge_left, arriving, begin, duration, soft)[0]
    return charge_left
