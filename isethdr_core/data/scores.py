"""Scores: one row per metric and object, with its interval, and what they state in the ledger."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ..uncertainty import ledger


@dataclass(frozen=True)
class Score:
    """One number about one picture, or one object in it.

    In the result of a run, `low` and `high` are the ends of the 95 % interval (`score_intervals`).
    As a metric returns them, they are the spread over the pixels of one picture. They are NaN where
    they are not known.
    """

    metric: str
    value: float
    unit: str
    object: str = ""
    low: float = float("nan")
    high: float = float("nan")


# largest difference between shares of valid pixels; beyond it, scores describe different pixels
UNLIKE_SHARES = 0.05


def unlike_shares(scores: list[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """Return the valid shares of the cameras, by object, where they differ by more than
    `UNLIKE_SHARES`.

    Parameters
    ----------
    scores : recorded scores of a run. The object of the whole frame is "".
    """
    shares: dict[str, dict[str, float]] = {}
    for score in scores:
        if score["metric"] == "valid_share":
            shares.setdefault(score["object"], {})[score["camera"]] = score["value"]
    return {name: by_camera for name, by_camera in shares.items() if are_unlike(by_camera.values())}


def are_unlike(shares: Iterable[float]) -> bool:
    """Return whether shares of valid pixels differ by more than `UNLIKE_SHARES`."""
    defined = [share for share in shares if share is not None and not math.isnan(share)]
    return bool(defined) and max(defined) - min(defined) > UNLIKE_SHARES


def objects_remark(unlike: dict[str, dict[str, float]]) -> str:
    """Return the remark that names the objects among `unlike_shares`; empty without any."""
    names = ", ".join(name for name in unlike if name)
    if not names:
        return ""
    return f"Objects whose shares of valid pixels differ by more than {UNLIKE_SHARES:g}: {names}."


def shares_remark(shares: dict[str, float]) -> str:
    """Return the remark on scores of pictures with unlike shares of valid pixels, by name."""
    listed = ", ".join(f"{name} {share:.2f}" for name, share in shares.items())
    return (
        f"Shares of valid pixels differ by more than {UNLIKE_SHARES:g} ({listed}): "
        "these scores stand on unlike parts of the frame."
    )


def half_interval(score: Score) -> float:
    """Return the larger distance from the value to an end of its interval, in its unit; NaN where
    it has neither end.
    """
    sides = [
        side for side in (score.value - score.low, score.high - score.value) if not math.isnan(side)
    ]
    return max(sides, default=math.nan)


def state_errors(scores: list[Score]) -> None:
    """State the error of the scores of one metric in the ledger: half of the widest 95 % interval,
    once per unit.

    Scores of the whole picture are used, or those of objects if there are no others. If no score
    has an interval, the bound is infinite. Nothing is added for a metric that has stated its error
    itself.
    """
    if ledger.stated():
        return
    if not scores:
        ledger.error(0.0, "1", "bound", "no score; the reason is listed among the omissions")
        return
    sure = [s for s in scores if not math.isnan(half_interval(s))]
    if not sure:
        ledger.error(
            math.inf,
            scores[0].unit or "1",
            "bound",
            f"{scores[0].metric}: no score has an interval; the metric states none, or too little"
            " of the picture is valid",
        )
        return
    of_frame = [s for s in sure if not s.object] or sure
    for unit in dict.fromkeys(s.unit for s in of_frame):
        widest = max((s for s in of_frame if s.unit == unit), key=half_interval)
        ledger.error(
            half_interval(widest),
            unit or "1",
            "statistical",
            " ".join(
                filter(None, (widest.metric, widest.object and f"of {widest.object}", "95 %"))
            ),
        )
