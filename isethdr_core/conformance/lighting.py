"""Promises of a lighting: the mix is the weighted sum of the groups, with the stated weights."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..data.quantities import check_mixed
from ..data.temporal_modulation import time_mean
from ..pipeline.demand import Demand
from ..plugins.protocols import Lighting, NarrowsDemand
from .inputs import GROUPS, damaged_scenes, scene
from .lazy import same_from_store
from .promise import (
    close,
    fortran,
    holds,
    keeps,
    refuses,
    repeatable,
    safe_in_threads,
    stated,
)


def check(subject: str, lighting: Lighting) -> None:
    """Check one lighting on a scene of four light groups."""
    radiance = scene()
    repeatable(subject, lighting, scene)
    scenes = (radiance, scene(level=0.02))
    safe_in_threads(subject, lighting, [partial(lighting, one) for one in scenes])
    mixed = time_mean(lighting(radiance))
    with keeps(subject, "returns mixed radiance"):
        check_mixed(mixed)
    holds(
        subject,
        "keeps the scene's grid",
        all(np.array_equal(mixed[d], radiance[d]) for d in ("wavelength", "y", "x")),
    )
    holds(
        subject,
        "carries the camera's field",
        (mixed.attrs.get("field_width"), mixed.attrs.get("field_height"))
        == (radiance.attrs["field_width"], radiance.attrs["field_height"]),
    )
    weights = mixed.attrs.get("weights", {})
    groups = [str(g) for g in radiance.light_group.values]
    holds(
        subject,
        "states the weight of every group in attrs['weights']",
        isinstance(weights, dict) and set(weights) == set(groups),
        repr(weights),
    )
    holds(
        subject,
        "weights are finite, 0 or more",
        all(0 <= w < np.inf for w in weights.values()),
        repr(weights),
    )
    total = np.tensordot(
        [weights[g] for g in groups], radiance["radiance"].values.astype(float), axes=1
    )
    # the sum is computed in float64 and rounded once to float32: half a unit in the last place is
    # 6e-8; twice that is allowed, for sums in another order
    close(
        subject, "the mix is the sum of weight times radiance", mixed.values, total, 1.2e-7, 1e-30
    )
    turned = time_mean(
        stated(subject, lambda: lighting(fortran(radiance.isel(light_group=slice(None, None, -1)))))
    )
    # solved weights change in their last digits if the groups have another order
    close(
        subject,
        "the order of the light groups does not matter",
        turned.values,
        mixed.values,
        1e-5,
        1e-30,
    )
    if isinstance(lighting, NarrowsDemand):
        kept_groups = lighting.narrow(Demand(groups=GROUPS)).groups
        needed_groups = GROUPS if kept_groups is None else kept_groups
        with keeps(subject, "needs no light group that its narrow drops"):
            part = time_mean(lighting(radiance.sel(light_group=list(needed_groups))))
            close(
                subject,
                "needs no light group that its narrow drops",
                part.values,
                mixed.values,
                1e-6,
                1e-30,
            )
    same_from_store(subject, lighting, radiance, lighting(radiance))
    for fault, damaged in damaged_scenes(radiance):
        if fault.endswith("light") and not any(weights.values()):
            continue  # all lights are off: no value is read, so no mistake can be detected
        refuses(subject, fault, partial(lighting, damaged))
