"""Reference white: the display white of the reference picture, and how renderer noise moves it.

The white is a percentile of the luminance. A metric that compares at this white has a score that
moves with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeGuard, cast

from ..data.quantities import LUMINANCE
from ..display.display_view import WHITE_PERCENTILE, luminance, white_cd_m2, white_pixels
from ..plugins.protocols import HasWhite
from .changed_scenes import ChangedScenes
from .percentile_errors import percentile_error
from .score_intervals import ScoreKey
from .score_movements import MANY, Movement

if TYPE_CHECKING:
    from ..plugins.protocols import Metric

WHITE_LOTS = 4  # changes of the reference picture for its white, each with its opposite
BLOCK_TILES = 8  # side of the blocks of a percentile, in tiles: few tiles lie in two blocks


class White(NamedTuple):
    """The display white of the reference picture, and how renderer noise moves it."""

    level_cd_m2: float
    movement: Movement


NO_WHITE = White(0.0, Movement(0.0, math.inf, 0.0, 0.0, 1, "", math.inf))


def finds_white(metric: Metric) -> TypeGuard[HasWhite]:
    """Return whether a metric compares against the white of the reference picture."""
    return isinstance(metric, HasWhite) and not metric.white_cd_m2


def with_white(metric: Metric, white_cd_m2: float) -> Metric:
    """Return the metric with this white if it would otherwise find the white of the reference
    picture, which differs from part to part.
    """
    return at_white(metric, white_cd_m2) if finds_white(metric) else metric


def at_white(metric: HasWhite, white_cd_m2: float) -> Metric:
    """Return the metric with this white."""
    fixed: Metric = replace(cast(Any, metric), white_cd_m2=white_cd_m2)  # metrics are dataclasses
    return fixed


def keys_of_white(metrics: Sequence[Metric]) -> list[ScoreKey]:
    """Return the scores that are the white of the reference picture."""
    return [(m.WHITE_SCORE, LUMINANCE, "") for m in metrics if finds_white(m)]


def white_of(scenes: ChangedScenes) -> White:
    """Return the white of the reference picture, and how renderer noise moves it."""
    level = luminance(scenes.shot.truth)
    error = percentile_error(
        level,
        white_pixels(level),
        WHITE_PERCENTILE / 100,
        map(scenes.luminance_change, range(WHITE_LOTS)),
        math.ceil(BLOCK_TILES * scenes.tile_pixels),
    )
    freedom = error.degrees_of_freedom
    rms = math.hypot(error.standard_error, error.shift)
    known = max(round(min(freedom, MANY)), 1)
    how = f"the share of pixels below it after {2 * WHITE_LOTS} changes of the scene"
    movement = Movement(error.standard_error, freedom, error.shift, rms, known, how, math.inf)
    return White(white_cd_m2(level), movement)
