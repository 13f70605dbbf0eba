"""Score checks: what a metric and its faster methods returned are lists of scores, with fields of
the right types.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..errors import PluginError
from ..uncertainty.score_intervals import ScoreKey, key_of
from .scores import Score


def check_scores(key: str, scores: Sequence[Any], method: str = "") -> list[Score]:
    """Return the scores that a metric returned, if they are a list of scores of the right types.

    Parameters
    ----------
    key : name of the metric, for messages.
    scores : what the metric returned.
    method : method of the metric that returned them; empty: its call.

    Raises
    ------
    PluginError : the metric returned something else than a list of scores; a score without a name,
        with a value, interval, unit or object of a wrong type, or given twice.
    """
    by = f"{method} of metric {key!r}" if method else f"metric {key!r}"
    if not (isinstance(scores, list) and all(isinstance(s, Score) for s in scores)):
        raise PluginError(f"{by} returned {in_line(scores)}; expected a list of isethdr_core.Score")
    given: set[ScoreKey] = set()
    for score in scores:
        check_score(by, score)
        if key_of(score) in given:
            of = f"the object {score.object!r}" if score.object else "the whole picture"
            name = (
                f"under the name that the call of the metric gives it, once: {score.metric!r}"
                if method
                else f"once; give it another name, for example {score.metric + '_b'!r}"
            )
            raise PluginError(
                f"{by} returned the score {score.metric!r} of {of} twice; expected each score"
                f" {name}"
            )
        given.add(key_of(score))
    return scores


def check_scores_of_parts(key: str, scores: Any, count: int) -> list[list[Score]]:
    """Return what `of_parts` of a metric returned, if it is one list of scores for each part.

    Parameters
    ----------
    key : name of the metric, for messages.
    scores : what the method returned.
    count : number of parts.

    Raises
    ------
    PluginError : it is no list, has another length, or a part has something else than scores of the
        right types.
    """
    if not isinstance(scores, list) or len(scores) != count:
        length = f"a list of {len(scores)}" if isinstance(scores, list) else in_line(scores)
        raise PluginError(
            f"of_parts of metric {key!r} returned {length}; expected a list of {count} lists of"
            " isethdr_core.Score, one for each number in `part`; return [] for a part without"
            " scores"
        )
    for number, of_part in enumerate(scores):
        check_scores(key, of_part, f"of_parts, part {number},")
    return scores


@contextmanager
def noted(key: str, method: str) -> Iterator[None]:
    """Add a note with the method and its metric to errors that are raised inside.

    Parameters
    ----------
    key : name of the metric.
    method : method of the metric that is called inside.
    """
    try:
        yield
    except Exception as err:
        err.add_note(f"in {method} of metric {key!r}")
        raise


def check_score(by: str, score: Score) -> None:
    """Raise PluginError if a field of a score has a wrong type, or its name is empty.

    Parameters
    ----------
    by : metric that returned the score, for messages.
    score : score that the metric returned.
    """
    texts = {"metric": score.metric, "unit": score.unit, "object": score.object}
    for name, text in texts.items():
        if not isinstance(text, str) or (name == "metric" and not text):
            wanted = "a text that is not empty" if name == "metric" else 'a text, "" for none'
            raise PluginError(
                f"{by} returned the score {in_line(score.metric)}, whose {name} is"
                f" {in_line(text)}; expected {wanted}"
            )
    numbers = {"value": score.value, "low": score.low, "high": score.high}
    for name, number in numbers.items():
        if not is_number(number):
            raise PluginError(
                f"{by} returned the score {score.metric!r}, whose {name} is"
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
