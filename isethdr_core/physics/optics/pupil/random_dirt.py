"""Random dirt: dust and scratches of a pupil, drawn from their statistics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .convex import Convex
from .shapes import disc, strip


@dataclass(frozen=True)
class Dust:
    """Statistics of the grains of dust on a pupil."""

    per_mm2: float  # mean number of grains per mm2
    radius_um: float  # median radius; radii have a log-normal distribution
    spread: float = 0.5  # standard deviation of the logarithm of the radius
    # least and greatest share of the amplitude that a grain takes; uniform between them
    loss: tuple[float, float] = (0.5, 1.0)


@dataclass(frozen=True)
class Scratches:
    """Statistics of the scratches on a pupil: straight lines in parallel groups."""

    per_mm2: float  # mean number of scratches per mm2
    width_um: float  # mean width; widths are uniform from 0.5 to 1.5 times the mean
    length_um: float  # mean length; lengths are uniform from 0.4 to 1.6 times the mean
    # least and greatest share of the amplitude that a scratch takes; uniform between them
    loss: tuple[float, float] = (0.3, 1.0)
    together: int = 1  # number of scratches in a group
    # mean distance between neighbours in a group; distances are uniform from 0.5 to 1.5 times it
    spacing_um: float = 0.0
    direction_deg: float = 0.0  # start of the range of directions, from x towards y
    direction_range_deg: float = 180.0  # directions of groups are uniform over this range


def dirt(radius: float, dust: Dust, scratches: Scratches, seed: int) -> list[tuple[Convex, float]]:
    """Draw dust and scratches over the square around a pupil, as exact shapes.

    Counts have a Poisson distribution, positions are uniform. The same arguments give the same
    dirt.

    Parameters
    ----------
    radius : radius of the pupil, mm.
    dust, scratches : statistics of the grains and of the scratches.
    seed : seed of the random numbers.

    Returns
    -------
    list of (shape, loss); the loss is 1 - amplitude transmission.
    """
    rng = np.random.default_rng(seed)
    square = 4 * radius**2
    out = []
    for _ in range(rng.poisson(dust.per_mm2 * square)):
        x, y = rng.uniform(-radius, radius, 2)
        out.append(
            (
                disc(x, y, 1e-3 * dust.radius_um * rng.lognormal(0, dust.spread)),
                rng.uniform(*dust.loss),
            )
        )
    for _ in range(rng.poisson(scratches.per_mm2 * square / scratches.together)):
        x, y = rng.uniform(-radius, radius, 2)
        angle = None
        across = 0.0
        for number in range(scratches.together):
            length = 1e-3 * scratches.length_um * rng.uniform(0.4, 1.6)
            width = 1e-3 * scratches.width_um * rng.uniform(0.5, 1.5)
            if angle is None:
                angle = np.radians(
                    scratches.direction_deg
                ) + scratches.direction_range_deg / 180 * rng.uniform(0, np.pi)
            loss = rng.uniform(*scratches.loss)
            if number:
                across += 1e-3 * scratches.spacing_um * rng.uniform(0.5, 1.5)
            out.append(
                (
                    strip(
                        x - across * np.sin(angle), y + across * np.cos(angle), length, width, angle
                    ),
                    loss,
                )
            )
    return out
