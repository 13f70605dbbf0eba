"""Reuse: intermediate results of earlier runs, with all that their stages stated.

A stage is not computed again if its result is kept. Its row of the ledger is that of the run that
computed it: the same errors, the same omissions, the seconds that it took then (`Row.reused`). The
stage states them as if it had run, so later stages see no difference.

A result that takes longer to write and read than to compute is not kept: see `WORTH_BYTES_PER_S`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from ..data.scores import Score
from ..errors import ConfigError
from ..storage.bounded_cache import BoundedCache
from ..storage.exact_encoding import Types
from ..storage.home_folder import home
from ..uncertainty.error_terms import (
    ErrorMaps,
    ErrorTerm,
    LightPart,
    Quantity,
    Reading,
    Source,
)
from ..uncertainty.ledger import LeftOut, Row, cpu_s
from ..uncertainty.propagation import Electrons
from ..uncertainty.score_errors import ScoreErrors
from ..uncertainty.score_intervals import RendererError

T = TypeVar("T")

VALUE = "value-"  # before the name of a result without a row of its own
FOLDER = "intermediate"  # name of the folder within the home folder
# Results that are computed at more bytes per second are computed again and not kept: see
# docs/how-to/catalog.md.
WORTH_BYTES_PER_S = 100e6
DEFAULT_GB = 4.0  # size for a config that states none
SMALL_BYTES = 1e6  # a result up to this size is kept, however quickly it was computed


@dataclass(frozen=True)
class StageResult:
    """What a stage returned, and what it stated."""

    result: Any
    row: Row


TYPES = Types.of(
    (
        *(ErrorTerm, Source, Quantity, LightPart, Reading, LeftOut, Row, StageResult),
        *(Electrons, ErrorMaps, Score, ScoreErrors, RendererError),
    )
)


@dataclass(frozen=True)
class Reuse:
    """Looks up intermediate results by name, and keeps new ones.

    Parameters
    ----------
    cache : cache of the results; None: everything is computed, and nothing is kept.
    """

    cache: BoundedCache | None = None

    @property
    def is_on(self) -> bool:
        """Whether anything is looked up."""
        return self.cache is not None

    @classmethod
    def below(cls, most_bytes: int) -> Reuse:
        """Return a `Reuse` that keeps up to `most_bytes` in the home folder; 0: nothing is kept."""
        if not most_bytes:
            return cls()
        return cls(BoundedCache(home() / FOLDER, most_bytes, TYPES))

    def value(self, name: str | None, compute: Callable[[], T]) -> T:
        """Return `compute()`, which states nothing, or what it returned in an earlier run."""
        if self.cache is None or name is None:
            return compute()
        stored = self.cache.get(VALUE + name)
        if stored is not None:
            return stored
        start = cpu_s()
        result = compute()
        self.cache.put(VALUE + name, result, _worth(cpu_s() - start))
        return result

    def values(
        self, names: Sequence[str | None], compute: Callable[[list[int]], Sequence[T]]
    ) -> list[T]:
        """Return several results. Each is kept separately; all missing ones are computed together.

        Parameters
        ----------
        names : names of the results; None for a result without a name.
        compute : function(places in `names`) -> the results of these places. It states nothing.
        """
        results: list[Any] = [None] * len(names)
        if self.cache is not None:
            results = [None if name is None else self.cache.get(VALUE + name) for name in names]
        missing = [place for place, result in enumerate(results) if result is None]
        if not missing:
            return results
        start = cpu_s()
        computed = compute(missing)
        each_s = (cpu_s() - start) / len(missing)
        for place, result in zip(missing, computed, strict=True):
            results[place] = result
            name = names[place]
            if self.cache is not None and name is not None:
                self.cache.put(VALUE + name, result, _worth(each_s))
        return results

    def earlier(self, name: str | None) -> StageResult | None:
        """Return what the stage of a result returned and stated in an earlier run, if it is
        kept.
        """
        return self.cache.get(name) if self.cache is not None and name is not None else None

    def keep(self, name: str | None, result: Any, row: Row, spent_s: float) -> None:
        """Keep the result and the statements of a stage.

        Statements of the stage about itself are kept without its name, which users choose.

        Parameters
        ----------
        name : name of the result, the hash of its inputs; None: it is not kept.
        result : result of the stage.
        row : row of the stage in the ledger.
        spent_s : CPU time of the stage, s.
        """
        if self.cache is None or name is None:
            return
        of_itself = row.source().kind, row.source().name
        errors = [
            replace(term, source=Source(key=term.source.key))
            if (term.source.kind, term.source.name) == of_itself
            else term
            for term in row.errors
        ]
        stage_result = StageResult(result, replace(row, stage="", errors=errors))
        self.cache.put(name, stage_result, _worth(spent_s))


NOTHING_KEPT = Reuse()


@dataclass(frozen=True)
class Kept:
    """Where the result of a stage is looked up and kept, and its name there."""

    reuse: Reuse = NOTHING_KEPT
    name: str | None = None


NOT_KEPT = Kept()


def cache_bytes(config: Mapping[str, Any]) -> int:
    """Return how many bytes of intermediate results a run may keep.

    Raises
    ------
    ConfigError : `cache_gb` is no finite number, or negative.
    """
    size_gb = config.get("cache_gb", DEFAULT_GB)
    number = isinstance(size_gb, (int, float)) and not isinstance(size_gb, bool)
    if not (number and 0 <= size_gb < math.inf):
        raise ConfigError(
            f"cache_gb is {size_gb!r}; expected the gigabytes that intermediate results may take, 0"
            " to keep none; type for example cache_gb=4"
        )
    return int(size_gb * 1e9)


def _worth(spent_s: float) -> float:
    """Return the largest size, bytes, at which a result of this CPU time is worth storing."""
    return max(SMALL_BYTES, spent_s * WORTH_BYTES_PER_S)
