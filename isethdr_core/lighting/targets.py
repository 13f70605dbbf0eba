"""Lighting whose weights are solved: luminances per group, a dynamic range, a median or mean of the
picture.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import ConfigError, did_you_mean
from ..plugins.ranges import Percent, Seed, check_ranges
from ..uncertainty import ledger
from ..uncertainty.error_terms import Quantity
from . import mix, solver, target
from .limits import Ratio, Reached, Weight
from .mix import all_weights
from .modulation import asked_for, check_groups, parse
from .weights import without_dark_groups

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from ..physics.detector.temporal_modulation import Modulation
    from ..pipeline.demand import Demand

# relative residual up to which a target counts as met; the searches end at 1e-14, and sums of
# float32 light have errors of 1e-7
REACHED = 1e-6


@dataclass(frozen=True)
class TargetsLighting:
    """Weights solved from photometric targets: lamp and sky luminances, dynamic range, median or
    mean.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # photometric targets {group: {statistic, cd_m2, percentile, lamp_kind, ...}}
    targets: dict[str, Any] = field(default_factory=dict)
    # weights of groups without a target {group: weight}
    weights: dict[str, Weight] = field(default_factory=dict)
    others: Weight = 1.0  # weight of all other groups; 1 keeps the light of the scene
    # light groups that may be scaled, all by one factor, to reach dynamic_range, median_cd_m2 or
    # mean_cd_m2; each of these needs at least one such group. All other groups keep their light,
    # unless dynamic_range and a median or mean are set: all groups are then scaled by a further
    # factor
    moves: list[str] = field(default_factory=list)
    # earlier spelling of `moves` with a single group; accepted until version 1.0
    ambient: str | None = None
    dynamic_range: Ratio | None = None  # ratio of the two percentiles of the picture's luminance
    low_percentile: Percent = 1.0  # lower percentile of dynamic_range (Hazen's definition)
    high_percentile: Percent = 100.0  # upper percentile of dynamic_range; 100 is the brightest tile
    median_cd_m2: Reached | None = None  # median luminance of the whole picture
    mean_cd_m2: Reached | None = None  # mean luminance of the whole picture
    # temporal modulation {group: {frequency_hz, duty or depth, phase}}
    modulation: dict[str, Any] = field(default_factory=dict)
    seed: Seed = 0  # seed of targets and phases that are ranges
    WITHIN_FIELD: ClassVar[bool] = True  # tiles beyond the field do not change the weights

    def __post_init__(self) -> None:
        check_ranges(self)
        self._varying()
        for t in target.parse(self.targets):
            if t.group in self.weights:
                raise ConfigError(
                    f"group {t.group!r} has both a target and a weight; type"
                    f" ~lighting.weights.{t.group} to drop one"
                )
        if self.ambient is not None:
            warnings.warn(
                f"lighting.ambient is now lighting.moves; type lighting.moves=[{self.ambient}]",
                FutureWarning,
                stacklevel=3,
            )
        if not self.low_percentile < self.high_percentile:
            raise ConfigError(
                f"low_percentile is {self.low_percentile:g} and high_percentile "
                f"{self.high_percentile:g}; expected 0 <= low < high <= 100; "
                "type lighting.low_percentile=1 lighting.high_percentile=100"
            )
        if self.median_cd_m2 is not None and self.mean_cd_m2 is not None:
            raise ConfigError(
                "lighting has both median_cd_m2 and mean_cd_m2; one scale cannot reach two levels; "
                "type lighting.mean_cd_m2=null"
            )
        self._check_moves()

    def _check_moves(self) -> None:
        """Raise ConfigError where a group that may be moved is also held by a target."""
        moves = self._moves()
        if isinstance(moves, str) or not all(isinstance(g, str) for g in moves):
            raise ConfigError(
                f"lighting.moves is {moves!r}; expected names of light groups; type"
                " 'lighting.moves=[sky]'"
            )
        if self._moving() and not moves:
            fields = ("dynamic_range", "median_cd_m2", "mean_cd_m2")
            name, value = next((f, v) for f in fields if (v := getattr(self, f)) is not None)
            raise ConfigError(
                f"lighting.{name} is {value:g}, and lighting.moves names no light group that may"
                " change to reach it; type 'lighting.moves=[headlights,streetlights,other]' to"
                " keep the sky as it is, or 'lighting.moves=[sky]' to keep the lamps"
            )
        with_target = [g for g in moves if self.targets.get(g) is not None]
        if self._moving() and with_target:
            raise ConfigError(
                f"group {with_target[0]!r} has a target of its own, but lighting.moves also changes"
                " its weight to reach the picture's dynamic range or level; type"
                f" ~lighting.targets.{with_target[0]} to drop the target, or name other groups, for"
                " example 'lighting.moves=[headlights,streetlights,other]'"
            )

    def __call__(self, radiance: xr.Dataset) -> xr.DataArray:
        """Return mixed radiance, W m-2 sr-1 nm-1.

        Attributes: `weights`; `targets` {name: {wanted, reached}}; `infeasible`, a text, "" where
        all were reached.
        """
        groups = mix.group_names(radiance)
        weights, targets = self._solve(radiance, groups)
        infeasible = _report(targets)
        return mix.mix(radiance, weights, self._varying(), targets=targets, infeasible=infeasible)

    def check_groups(self, groups: Sequence[str]) -> None:
        """Raise ConfigError if a target, weight or modulation names a group that is not in
        `groups`, the groups of the scene.
        """
        self._check_named(groups)
        check_groups(asked_for(self.modulation, self._known()), groups)

    def _check_named(self, groups: Sequence[str]) -> None:
        """Raise ConfigError if a target or weight names a group that is not in `groups`, which may
        be without groups of weight 0.
        """
        for t in self._own(groups):
            if t.group not in groups:
                raise ConfigError(
                    f"the scene has no light group {t.group!r}{did_you_mean(t.group, groups)}, "
                    "which the lighting has a target for; "
                    f"type ~lighting.targets.{t.group} to leave it out"
                )
        if self._moving() and not set(self._moves()) & set(groups):
            first = self._moves()[0]
            raise ConfigError(
                f"lighting.moves is {list(self._moves())}, and the scene has no such light group"
                f"{did_you_mean(first, groups)}; type 'lighting.moves=[{groups[0]}]'"
            )
        all_weights(self.weights, self.others, groups)

    def _own(self, groups: Sequence[str]) -> list[target.Target]:
        """Return the targets, without targets of luminance 0 for groups that are not there."""
        return [t for t in target.parse(self.targets) if t.high > 0 or t.group in groups]

    def _moving(self) -> bool:
        """Return whether groups move to reach a target of the whole picture."""
        return bool(self._level() or self.dynamic_range)

    def _moves(self) -> Sequence[str]:
        """Return the groups that may be moved."""
        return self.moves if self.ambient is None else [self.ambient]

    def narrow(self, demand: Demand) -> Demand:
        """Return the demand without the groups whose weight is known to be 0."""
        return without_dark_groups(demand, self._known(), self.others)

    def _known(self) -> dict[str, float]:
        """Return a number for each named group: 0 if its weight is known in advance to be 0."""
        known = {**self.weights, **{t.group: t.high for t in target.parse(self.targets)}}
        if self._moving():
            known |= {g: known.get(g, self.others) or 1.0 for g in self._moves()}
        return known

    def _varying(self) -> dict[str, Modulation]:
        """Return the modulation of the groups whose weight may differ from 0."""
        known = self._known()
        return {
            g: m
            for g, m in parse(self.modulation, self.seed).items()
            if known.get(g, self.others) != 0
        }

    def _level(self) -> tuple[str, float, float] | None:
        """Return (statistic, percentile, cd/m2) of the picture's level, or None."""
        if self.median_cd_m2 is not None:
            return "percentile", 50.0, self.median_cd_m2
        return None if self.mean_cd_m2 is None else ("mean", 0.0, self.mean_cd_m2)

    def _solve(
        self, radiance: xr.Dataset, groups: Sequence[str]
    ) -> tuple[dict[str, float], dict[Any, Any]]:
        """Return the weight of every group, and {name: {wanted, reached}} of every target."""
        # each map is read once, and only if a target needs it
        map_of = cache(lambda group: mix.luminance_map(radiance, group))
        self._check_named(groups)
        own_light = self._own(groups)
        weights = mix.all_weights(self.weights, self.others, groups)
        targets = target.draw(target.parse(self.targets), self.seed)
        at_one = {t.group: _statistic(radiance, t, map_of) for t in own_light}
        for group, value in at_one.items():
            # a group without light cannot be scaled to a luminance: it keeps the weight 1, and the
            # missed target is reported
            weights[group] = targets[group] / value if value > 0 else 1.0
        picture = {}
        if self._moving():
            # a group of weight 0 that may move starts from the light it was built with
            start = {g: weights[g] or 1.0 for g in self._moves() if g in groups}
            weights, picture = self._move(start, weights, map_of)
        lamps = {
            g: {"wanted": targets[g], "reached": weights[g] * value} for g, value in at_one.items()
        }
        return weights, {**lamps, **picture}

    def _move(
        self,
        start: dict[str, float],
        weights: dict[str, float],
        map_of: Callable[[str], np.ndarray],
    ) -> tuple[dict[str, float], dict[str, dict[str, float]]]:
        """Return the weights after moving those of the groups `start`, then of all groups, to the
        picture's targets. Also return the values reached.
        """
        level = self._level()
        ambient = sum(w * map_of(g) for g, w in start.items())
        still = {g: w for g, w in weights.items() if g not in start and w}
        other_light = sum((w * map_of(g) for g, w in still.items()), 0.0 * ambient)
        if self.dynamic_range:
            weight = solver.weight_for_dynamic_range(
                other_light, ambient, self.dynamic_range, self.low_percentile, self.high_percentile
            )
        elif level[0] == "mean":
            weight = solver.weight_for_mean(other_light, ambient, level[2])
        else:
            weight = solver.weight_for_percentile(other_light, ambient, level[1], level[2])
        weights = {**weights, **{g: weight * w for g, w in start.items()}}
        total_light = other_light + weight * ambient
        picture = {}
        if self.dynamic_range:
            reached = solver.dynamic_range(total_light, self.low_percentile, self.high_percentile)
            picture["dynamic_range"] = {"wanted": self.dynamic_range, "reached": reached}
        if level:
            name = "mean_cd_m2" if level[0] == "mean" else "median_cd_m2"
            reached = solver.statistic(total_light, level[0], level[1])
            # the dynamic range fixes the weights of the movable groups, so all groups are scaled
            # together to reach the level
            if self.dynamic_range and reached > 0:
                scale = level[2] / reached
                weights = {g: scale * w for g, w in weights.items()}
                reached *= scale
            picture[name] = {"wanted": level[2], "reached": reached}
        return weights, picture


def _statistic(
    radiance: xr.DataArray, t: target.Target, map_of: Callable[[str], np.ndarray]
) -> float:
    """Return the statistic that a target names, of its group at weight 1, cd/m2."""
    if t.statistic == "lamp_axis":
        return _lamp_axis(radiance, t)
    return solver.statistic(map_of(t.group), t.statistic, t.percentile)


def _lamp_axis(radiance: xr.DataArray, t: target.Target) -> float:
    """Return the largest luminance in the scene's list of lamps, cd/m2 at weight 1, among the lamps
    that the target names; 0 if there are none.
    """
    lamps = radiance.attrs.get("lamps")
    if lamps is None:
        raise ConfigError(
            f"lighting.targets.{t.group}.statistic is lamp_axis, but this scene lists no lamps; "
            f"type lighting.targets.{t.group}.statistic=max"
        )
    return max(
        (
            float(lamp["luminance_cd_m2"])
            for lamp in lamps
            if lamp["group"] == t.group and t.lamp_kind in ("", lamp["kind"])
        ),
        default=0.0,
    )


def _report(targets: dict[Any, Any]) -> str:
    """State the largest residual in the ledger. Return the targets that were not reached, with
    their residuals, as one text.
    """
    missed = []
    worst = 0.0
    for name, value in targets.items():
        wanted = value["wanted"]
        reached = value["reached"]
        residual = (
            abs(reached / wanted - 1)
            if wanted and math.isfinite(reached)
            else float(reached != wanted)
        )
        worst = max(worst, residual)
        if residual > REACHED:
            text = f"{name}: wanted {wanted:.6g}, reached {reached:.6g}"
            missed.append(text)
            ledger.left_out(
                f"target {text}",
                "no weights of this scene reach it together with the others",
                residual,
                "relative",
            )
    if targets:
        label = "photometric targets of the lighting"
        ledger.error(worst, "relative", "measured", label, key="targets", acts_on=Quantity.TARGET)
    return "; ".join(missed)
