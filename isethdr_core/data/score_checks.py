"""Score checks: what a metric returned is a list of scores, with fields of the right types."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import PluginError
from ..uncertainty.score_intervals import ScoreKey, key_of
from .scores import Score


def check_scores(key: str, scores: Sequence[Any]) -> list[Score]:
    """Return the scores that a metric returned, if they are a list of scores of the right types.

    Parameters
    ----------
    key : name of the metric, for messages.
    scores : what the metric returned.

    Raises
    ------
    PluginError : the metric returned something else than a list of scores; a score without a name,
        with a value, interval, unit or object of a wrong type, or given twice.
    """
    if not (isinstance(scores, list) and all(isinstance(s, Score) for s in scores)):
        raise PluginError(
            f"metric {key!r} returned {scores!r}; expected a list of isethdr_core.Score"
        )
    given: set[ScoreKey] = set()
    for score in scores:
        check_score(key, score)
        if key_of(score) in given:
            of = f"the object {score.object!r}" if score.object else "the whole picture"
            raise PluginError(
                f"metric {key!r} returned the score {score.metric!r} of {of} twice; expected each"
                " score once; give it another name, for example"
                f" {score.metric + '_b'!r}"
            )
        given.add(key_of(score))
    return scores


def check_score(key: str, score: Score) -> None:
    """Raise PluginError if a field of a score has a wrong type, or its name is empty.

    Parameters
    ----------
    key : name of the metric in the config, for messages.
    score : score that the metric returned.
    """
    texts = {"metric": score.metric, "unit": score.unit, "object": score.object}
    for name, text in texts.items():
        if not isinstance(text, str) or (name == "metric" and not text):
            wanted = "a text that is not empty" if name == "metric" else 'a text, "" for none'
            raise PluginError(
                f"metric {key!r} returned the score {in_line(score.metric)}, whose {name} is"
                f" {in_line(text)}; expected {wanted}"
            )
    numbers = {"value": score.value, "low": score.low, "high": score.high}
    for name, number in numbers.items():
        if not is_number(number):
            raise PluginError(
                f"metric {key!r} returned the score {score.metric!r}, whose {name} is"
                f" {in_line(number)}; expected a number, float('nan') where it is not known"
            )


def in_line(value: object) -> str:
    """Return the beginning of a value's text in one line, because arrays have several."""
    return " ".join(reprlib.repr(value).split())


def is_number(value: object) -> bool:
    """Return whether a value is one real number. Arrays without dimensions are numbers as well."""
    try:
        array = np.asarray(value)
    except ValueError:  # a list of lists of different lengths
        return False
    return array.ndim == 0 and array.dtype.kind in "biuf"
