"""Simulated decisions: the observer's template is applied to noisy windows, and hits are counted.

The probabilities of the observer assume normally distributed clutter. Here only the noise is
normal: the template comes from the windows of other roads. It decides on the object's own road, in
front of its own background, with new noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from .hotelling import found, template


class Counted(NamedTuple):
    """Decisions of one object's template, at a stated share of false alarms per place.

    `told_apart` needs no threshold. A pair is one window with the object and one without it on the
    same road; it is told apart if the window with the object has the larger answer (two-alternative
    forced choice, Green and Swets 1966). A share of 0.5 is guessing. It is NaN if the road has no
    window without an object.
    """

    hits: int
    trials: int
    false_alarms: int
    places: int
    told_apart: float


@dataclass(frozen=True, eq=False)
class Task:
    """The observer's knowledge about one object.

    Parameters
    ----------
    difference : (channel,) difference that the object makes to the mean output.
    clutter : (channel, channel) covariance over windows of other roads.
    mean : (channel,) mean output over windows of other roads.
    noise : (channel, channel) covariance of the noise.
    """

    difference: np.ndarray
    clutter: np.ndarray
    mean: np.ndarray
    noise: np.ndarray


def counted(
    task: Task, shown: np.ndarray, empty: np.ndarray, share: float, random: np.random.Generator
) -> Counted:
    """Return the decisions on windows with and without the object, with random noise.

    Parameters
    ----------
    task : the observer's knowledge about the object: difference, clutter and noise.
    shown : (window, channel) mean outputs with the object.
    empty : (window, channel) mean outputs without an object.
    share : share of the places without an object that the threshold lets pass, if clutter is
        normal.
    random : random generator of the noise.
    """
    together = task.clutter + task.noise
    weights = template(task.difference, together)
    limit = limit_of(weights, together, share)
    factor = np.linalg.cholesky(task.noise)

    def answers(outputs: np.ndarray) -> np.ndarray:
        noisy = outputs + random.standard_normal(outputs.shape) @ factor.T
        return (noisy - task.mean) @ weights

    with_it = answers(shown)
    without = answers(empty)
    told_apart = float(np.mean(with_it[:, None] > without)) if len(without) else np.nan
    return Counted(
        int(np.sum(with_it > limit)),
        len(shown),
        int(np.sum(without > limit)),
        len(empty),
        told_apart,
    )


def limit_of(weights: np.ndarray, together: np.ndarray, share: float) -> float:
    """Return the limit that a given share of the template's answers exceeds, if they are normal.

    Parameters
    ----------
    weights : (channel,) template.
    together : (channel, channel) covariance of clutter and noise.
    share : share of the answers without an object that exceed the limit.
    """
    return float(_quantile(share) * np.sqrt(weights @ together @ weights))


def _quantile(share: float) -> float:
    return float(ndtri(1 - share))


def expected_share(d: np.ndarray, share: float) -> np.ndarray:
    """Return the probability of a hit that the observer states.

    Parameters
    ----------
    d : detectability of the objects, any shape.
    share : share of false alarms per place.
    """
    return found(d, _quantile(share))
