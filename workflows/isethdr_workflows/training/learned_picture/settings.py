"""Classical settings, and the search for the best setting for each score, on training roads."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from isethdr_core.errors import ConfigError

GRID_FILE = "classical_grid.csv"  # file with the scores of all settings that a search has tried
# number of passes over all fields; a later field may change the best value of an earlier one
PASSES = 2


class Setting(NamedTuple):
    """A classical development."""

    demosaic: str = "learned"
    strength: float = 1.0  # strength of nl_means; 0: no denoising
    design_snr: float = 5.0
    balance: str = "automatic"

    def fields(self) -> dict[str, Any]:
        """Return the fields of `isp=merge`."""
        denoise: dict[str, Any] = {"denoise": "none"}
        if self.strength:
            denoise = {"denoise": "nl_means", "nl_means_strength": self.strength}
        return {
            "demosaic": self.demosaic,
            **denoise,
            "design_snr": self.design_snr,
            "balance": self.balance,
        }

    def __str__(self) -> str:
        return " ".join(f"{key}={value}" for key, value in self.fields().items())


GRID: dict[str, tuple[Any, ...]] = {
    "strength": (0.0, 0.5, 0.7, 1.0, 1.4, 2.0),
    "demosaic": ("bilinear", "guided", "learned"),
    "design_snr": (1.0, 2.0, 5.0, 20.0, math.inf),
    "balance": ("daylight", "automatic"),
}
SIGNS = {"ssim": 1.0, "psnr_db": 1.0, "ciede2000": -1.0}  # 1 if larger is better, else -1
Scores = dict[str, float]


class Search:
    """The search for the settings with the best mean scores.

    For each score separately, one field after the other is set to its best value.

    Parameters
    ----------
    score : function of a setting that returns its mean scores.
    demosaics : demosaic methods for the filter array; the search begins with the last one.
    """

    def __init__(
        self,
        score: Callable[[Setting], Scores],
        demosaics: Sequence[str] = GRID["demosaic"],
    ) -> None:
        self.score = score
        self.grid = {**GRID, "demosaic": tuple(demosaics)}
        self.tried: dict[Setting, Scores] = {}

    def best(self) -> dict[str, Setting]:
        """Return the best setting for each score."""
        return {name: self._best_of(name) for name in SIGNS}

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield one row for every setting that was tried, with its scores."""
        for setting, scores in self.tried.items():
            yield {**setting._asdict(), **scores}

    def _best_of(self, name: str) -> Setting:
        found = Setting(self.grid["demosaic"][-1])
        for _ in range(PASSES):
            for field, values in self.grid.items():
                choices = [found._replace(**{field: value}) for value in values]
                found = max(choices, key=lambda one: SIGNS[name] * self._scores(one)[name])
        return found

    def _scores(self, setting: Setting) -> Scores:
        if setting not in self.tried:
            self.tried[setting] = self.score(setting)
        return self.tried[setting]


def best_in(path: Path) -> dict[float, dict[str, Setting]]:
    """Return the best settings by illuminance and score, from the file of a search.

    Raises
    ------
    ConfigError : there is no such file.
    """
    if not path.is_file():
        raise ConfigError(
            f"there is no {path}; expected the scores of classical settings; type isethdr study"
            f" learned_picture model={path.parent / 'model.onnx'} and the sensor of the model"
        )
    tried: dict[float, dict[Setting, Scores]] = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            setting = Setting(
                row["demosaic"], float(row["strength"]), float(row["design_snr"]), row["balance"]
            )
            scores = {name: float(row[name]) for name in SIGNS}
            tried.setdefault(float(row["lux"]), {})[setting] = scores
    return {lux: _search_again(scores).best() for lux, scores in tried.items()}


def _search_again(tried: Mapping[Setting, Scores]) -> Search:
    """Return a search that reads its scores from a table. It tries the same settings again."""
    methods = {setting.demosaic for setting in tried}
    return Search(tried.__getitem__, [name for name in GRID["demosaic"] if name in methods])
