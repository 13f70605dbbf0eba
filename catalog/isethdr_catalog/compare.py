"""Compare two stored runs: settings that differ, and scores that differ by more than their
intervals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from isethdr_core.cli.sweep_summary import scored_text
from isethdr_core.errors import CatalogError
from isethdr_core.results.html import table
from isethdr_core.runs.run import Result
from isethdr_core.sweeps.score_order import differ, most_telling_first
from isethdr_core.sweeps.table import Scored

from .query import Homes, show

VERDICT = {True: "yes", False: "no", None: "not known"}
ABSENT = "–"  # a setting that one of the configs does not have


class Setting(NamedTuple):
    """A setting that differs, with its name and values as on the command line."""

    name: str
    a: str
    b: str


@dataclass(frozen=True)
class ScorePair:
    """One score of the frame in both runs."""

    score: str
    unit: str
    cameras: str  # names of the cameras of A and B; one name if both are equal
    a: Scored
    b: Scored

    @property
    def difference(self) -> float:
        """B minus A, in the unit of the score."""
        return self.b.value - self.a.value

    @property
    def differs(self) -> bool | None:
        """Whether A and B differ by more than their intervals; None if an interval is unknown."""
        return differ(self.a, self.b)


@dataclass(frozen=True)
class Comparison:
    """Two runs side by side."""

    a: Result
    b: Result
    settings: list[Setting]
    versions: list[Setting]  # versions of libraries and code of components that differ
    scores: list[ScorePair]

    def _repr_html_(self) -> str:
        """Return the settings and scores as HTML tables, for notebooks."""
        settings = table(["setting", "A", "B"], self.settings)
        rows = [
            [p.score, p.unit, p.cameras, scored_text(p.a), scored_text(p.b), VERDICT[p.differs]]
            for p in self.scores
        ]
        return settings + table(["score", "unit", "cameras", "A", "B", "differ"], rows)


def compare(homes: Homes, a: str, b: str) -> Comparison:
    """Return the differences between two stored runs.

    Parameters
    ----------
    homes : home folder, or several homes.
    a, b : first digits of the keys of two runs, or their names.

    Raises
    ------
    CatalogError : one of them is no run, or several stores match.
    """
    one = stored_run(homes, a)
    other = stored_run(homes, b)
    return Comparison(
        one,
        other,
        _differing(one.attributes["config"], other.attributes["config"]),
        versions_that_differ(one, other),
        _pairs(one, other),
    )


def camera_pairs(a: Result, b: Result) -> list[tuple[str, str]]:
    """Return the pairs of cameras (A, B) to compare: those of one name, or the only ones."""
    if len(a.cameras) == len(b.cameras) == 1:
        return [(a.cameras[0], b.cameras[0])]
    return [(name, name) for name in a.cameras if name in b.cameras]


def stored_run(homes: Homes, name: str) -> Result:
    """Return the run with a name or a key.

    Raises
    ------
    CatalogError : the store is no run, or several stores match.
    """
    attributes = show(homes, name)
    if attributes.get("kind") != "run":
        raise CatalogError(
            f"{name!r} is a {attributes.get('kind', 'store')}; expected a run;"
            " `isethdr catalog find kind=run` lists them"
        )
    return Result(Path(attributes["path"]), attributes, computed=False)


def versions_that_differ(a: Result, b: Result) -> list[Setting]:
    """Return the libraries and components of both runs that differ in version or code."""
    found = [
        _differing(a.attributes.get(name, {}), b.attributes.get(name, {}))
        for name in ("versions", "code")
    ]
    return [s for part in found for s in part if ABSENT not in (s.a, s.b)]


def _differing(a: dict[str, Any], b: dict[str, Any]) -> list[Setting]:
    """Return the settings that are not equal, by their dotted names."""
    flat_a = _flat(a)
    flat_b = _flat(b)
    names = [*flat_a, *(name for name in flat_b if name not in flat_a)]
    return [
        Setting(name, flat_a.get(name, ABSENT), flat_b.get(name, ABSENT))
        for name in names
        if flat_a.get(name) != flat_b.get(name)
    ]


def _flat(table: dict[str, Any], before: str = "") -> dict[str, str]:
    found: dict[str, str] = {}
    for key, value in table.items():
        name = f"{before}{key}"
        if isinstance(value, dict) and value:
            found |= _flat(value, f"{name}.")
        else:
            found[name] = str(value)
    return found


def _pairs(a: Result, b: Result) -> list[ScorePair]:
    pairs = []
    for camera_a, camera_b in camera_pairs(a, b):
        of_a = _of_frame(a, camera_a)
        of_b = _of_frame(b, camera_b)
        cameras = camera_a if camera_a == camera_b else f"{camera_a}, {camera_b}"
        for score in most_telling_first([name for name in of_a if name in of_b]):
            unit = of_a[score][1]
            pairs.append(ScorePair(score, unit, cameras, of_a[score][0], of_b[score][0]))
    return pairs


def _of_frame(run: Result, camera: str) -> dict[str, tuple[Scored, str]]:
    return {
        s["metric"]: (Scored(*(_number(s[k]) for k in Scored._fields)), s["unit"])
        for s in run.scores
        if s["camera"] == camera and not s["object"]
    }


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan
