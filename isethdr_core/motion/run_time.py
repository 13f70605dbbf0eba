"""Run time: how many sub-frames a shot will have, and which of them are still to be rendered.

The number follows from what moves, which is known only once the start of the shot is rendered.
Before that it is taken from the newest stored run of the same kind of scene whose shot moved, by
the ratio of the shot times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from ..identity.earlier_names import same_class
from ..pipeline.chain import Chain
from ..pipeline.demand import Demand
from ..plugins.protocols import MovesInTime
from ..runs.radiance_cache import held_and_missing
from .moments import sub_frames
from .shot_time import shot_time
from .sub_frames import cheaper


class SubFrameWork(NamedTuple):
    """The sub-frames that a run is expected to have."""

    count: int | None  # number of them, the start of the shot included; None: not known
    # chain and missing radiance of each later sub-frame that is not stored
    to_render: tuple[tuple[Chain, Demand], ...] = ()


def sub_frame_work(
    chain: Chain, demand: Demand, runs: Sequence[Mapping[str, Any]]
) -> SubFrameWork | None:
    """Return the sub-frames that a run will have; None if nothing moves during its shot.

    Parameters
    ----------
    chain : components of the run.
    demand : demand for the scene radiance.
    runs : root attributes of stored runs, the newest first.
    """
    settings = chain.motion
    if settings is None or not isinstance(chain.scene, MovesInTime):
        return None
    shot_s = shot_time(chain.scene, chain.lens, chain.cameras).seconds
    count = settings.sub_frames
    for attributes in runs:
        if (
            count is None
            and "motion" in attributes
            and same_class(attributes["scene"], chain.scene)
        ):
            stored = attributes["motion"]
            count = settings.count(stored["motion_px"] * shot_s / stored["shot_s"])
    if count is None:
        return SubFrameWork(None)
    later = sub_frames(shot_s, count)[1:]
    needed = replace(demand, labels=frozenset())
    to_render = []
    for number, sub_frame in enumerate(later, start=1):
        at_moment = replace(
            chain,
            scene=replace(chain.scene, time_s=chain.scene.time_s + sub_frame.moment_s),
            renderer=cheaper(chain.renderer, number, len(later)),
            motion=None,
        )
        missing = held_and_missing(at_moment, needed)[1]
        if missing is not None:
            to_render.append((at_moment, missing))
    return SubFrameWork(count, tuple(to_render))
