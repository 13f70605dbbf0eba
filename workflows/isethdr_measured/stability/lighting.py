"""Lighting: nearly identical light groups, extreme weights, targets out of reach, against sums in
long double and the statistics of the mixed picture.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.physics.photometry import luminance
from isethdr_core.plugins.registry import build

from .inputs import BANDS, patchy, scene
from .verdict import Measured, relative

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.lighting.targets import TargetsLighting
    from isethdr_core.lighting.weights import WeightsLighting

HALF_STEP = 2.0**-24  # relative error of mixed light, which is rounded to float32 once
SHAPE = (24, 32)


def cases() -> Iterator[tuple[Any, ...]]:
    """Yield (case, measure), with the error class where it is refused."""
    yield "weights over 15 decades", lambda: mixing({"a": 1e-9, "b": 1e6, "c": 1.0})
    yield "weights over 60 decades", lambda: mixing({"a": 1e-30, "b": 1e30, "c": 0.0})
    yield "a sum beyond float32", lambda: mixing({"a": 1e38, "b": 1e38, "c": 1e38}), UnitError
    for relative_gap in (0.0, 1e-6):
        name = "identical groups" if not relative_gap else "groups that differ by 1e-6"
        yield f"{name}: luminance targets", lambda e=relative_gap: alike(e, mean_cd_m2=None)
        yield f"{name}: a mean", lambda e=relative_gap: alike(e, mean_cd_m2=500.0)
        yield f"{name}: a median", lambda e=relative_gap: alike(e, median_cd_m2=500.0)
        yield f"{name}: a dynamic range", lambda e=relative_gap: alike(e, dynamic_range=2.0)
    for level in (1e-9, 1e-3, 1e12):
        yield (
            f"a median of {level:g} cd/m2",
            lambda v=level: reached(
                {"lamp": patchy(SHAPE) * 1e-3, "sky": patchy(SHAPE, 2)}, others=0.0, median_cd_m2=v
            ),
        )
    for ratio in (10.0, 1e6, 1e12):
        yield f"a dynamic range of {ratio:g}", lambda v=ratio: reached(_night(), dynamic_range=v)
    yield (
        "a median over a dark group",
        lambda: solved_weight({"lamp": patchy(SHAPE), "sky": np.zeros(SHAPE)}, median_cd_m2=1e6),
    )
    yield (
        "a mean below what the lamps give",
        lambda: solved_weight({"lamp": patchy(SHAPE), "sky": patchy(SHAPE, 2)}, mean_cd_m2=1e-6),
    )
    yield (
        "a dynamic range below that of the picture",
        lambda: solved_weight(_night(), dynamic_range=1.01),
    )
    yield (
        "a luminance of a dark group",
        lambda: solved_weight(
            {"lamp": np.zeros(SHAPE), "sky": patchy(SHAPE)},
            targets={"lamp": {"statistic": "max", "cd_m2": 10.0}},
        ),
    )
    yield (
        "all groups dark, a dynamic range",
        lambda: solved_weight(
            {"lamp": np.zeros(SHAPE), "sky": np.zeros(SHAPE)}, dynamic_range=100.0
        ),
    )
    yield "a weight of NaN", lambda: mixing({"a": float("nan"), "b": 1.0, "c": 1.0}), ConfigError
    yield "a negative weight", lambda: mixing({"a": -1.0, "b": 1.0, "c": 1.0}), ConfigError


def _night() -> dict:
    lamp = np.zeros(SHAPE)
    lamp[5:7, 8:11] = 1e6
    return {"lamp": lamp, "sky": patchy(SHAPE)}


def _lighting(name: str, **fields: Any) -> TargetsLighting | WeightsLighting:
    return build("lighting", name, **fields)


def mixing(weights: dict) -> Measured:
    """Compare mixed light with the weighted sum in long double.

    Parameters
    ----------
    weights : {light group: weight}.
    """
    maps = {g: patchy(SHAPE, seed) for seed, g in enumerate(weights, 3)}
    light = scene(maps)
    mixed = _lighting("weights", weights=weights)(light).values
    truth = sum(
        np.longdouble(w) * light.radiance.sel(light_group=g).values.astype(np.longdouble)
        for g, w in weights.items()
    )
    return Measured(relative(mixed, truth), HALF_STEP, "weighted sum in long double, relative")


def alike(relative_gap: float, **targets_of_picture: Any) -> Measured:
    """Check for two nearly identical groups that the values that the lighting states as reached are
    those of the picture.

    Parameters
    ----------
    relative_gap : relative difference of the groups.
    targets_of_picture : targets of the whole picture; mean_cd_m2=None sets a target of the second
        group instead.
    """
    first = patchy(SHAPE)
    maps = {"lamp": first, "sky": first * (1 + relative_gap * patchy(SHAPE, 2))}
    targets = {"lamp": {"statistic": "mean", "cd_m2": 100.0}}
    if targets_of_picture.get("mean_cd_m2", 0) is None:
        targets["sky"] = {"statistic": "max", "cd_m2": 300.0}
    return _shown(
        maps, targets=targets, **{k: v for k, v in targets_of_picture.items() if v is not None}
    )


def reached(maps: dict, **targets: Any) -> Measured:
    """Check that the picture meets a target within reach to 1e-6, as the lighting promises.

    Parameters
    ----------
    maps : {light group: (y, x) radiance}.
    targets : one target, and further fields of the lighting.
    """
    mixed = _lighting("targets", moves=["sky"], **targets)(scene(maps))
    [target] = mixed.attrs["targets"].values()
    return Measured(
        abs(_luminance_on_road(mixed, next(iter(mixed.attrs["targets"]))) / target["wanted"] - 1),
        1e-6,
        "the mixed picture, relative",
    )


def solved_weight(maps: dict, **targets: Any) -> Measured:
    """Check that a target out of reach is named, and that the stated value is the true one.

    Parameters
    ----------
    maps : {light group: (y, x) radiance}.
    targets : one target, and further fields of the lighting.
    """
    return _shown(maps, out_of_reach=True, **targets)


def _shown(maps: dict[str, np.ndarray], out_of_reach: bool = False, **fields: Any) -> Measured:
    mixed = _lighting("targets", moves=["sky"], **fields)(scene(maps))
    worst = 0.0
    for name, target in mixed.attrs["targets"].items():
        displayed = (
            _luminance_on_road(mixed, name)
            if name in ("dynamic_range", "median_cd_m2", "mean_cd_m2")
            else target["reached"]
        )
        if not (np.isnan(displayed) and np.isnan(target["reached"])):
            worst = max(worst, relative(target["reached"], displayed))
        if name not in ("dynamic_range", "median_cd_m2", "mean_cd_m2") and target["reached"]:
            worst = max(
                worst,
                relative(_of_group(maps, mixed.attrs["weights"], name, fields), target["reached"]),
            )
    if out_of_reach and not mixed.attrs["infeasible"]:
        return Measured(float("inf"), 0.0, "a target out of reach was not named")
    met = not mixed.attrs["infeasible"]
    return Measured(
        worst,
        1e-6,
        f"statistics of the mixed picture, relative; {'met' if met else 'said to be out of reach'}",
    )


def _of_group(
    maps: dict[str, np.ndarray],
    weights: dict[str, float],
    group: str,
    fields: dict[str, dict[str, dict[Any, Any]] | float],
) -> float:
    """Return the statistic of the weighted luminance of one group, cd/m2."""
    luminance_cd_m2 = (
        maps[group].astype(np.float32).astype(float)
        * float(luminance(np.ones(len(BANDS)), BANDS))
        * weights[group]
    )
    return {"max": np.max, "mean": np.mean}[fields["targets"][group]["statistic"]](luminance_cd_m2)


def _luminance_on_road(mixed: xr.DataArray, name: str) -> float:
    luminance_cd_m2 = luminance(mixed.values.astype(float), mixed.wavelength.values)
    if name == "dynamic_range":
        low, high = np.percentile(luminance_cd_m2, [1.0, 100.0], method="hazen")
        return float(high / low) if low else float("nan") if not high else float("inf")
    return float(
        np.mean(luminance_cd_m2)
        if name == "mean_cd_m2"
        else np.percentile(luminance_cd_m2, 50.0, method="hazen")
    )
