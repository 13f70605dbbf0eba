"""Estimate of the run time of all frames of a sequence, from stored runs, before any work.

Frames with the same light are found from the description of the scene. Descriptions are built for
this until a time limit. All other frames count as frames to render.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

from isethdr_core.cli.summary_tables import runtime_estimate_table
from isethdr_core.cli.terminal import console, duration, number_of
from isethdr_core.data.scene_description import SceneDescription
from isethdr_core.motion.run_time import sub_frame_work
from isethdr_core.pipeline.chain import Chain, camera_threads, chain, frame_of, plan
from isethdr_core.pipeline.demand import Demand
from isethdr_core.pipeline.runtime_estimate import elapsed_s, expected_s, newest, stages
from isethdr_core.runs.radiance_cache import (
    held_and_missing,
    is_equal_stored,
    recipe_hash,
    rendering_of,
)
from isethdr_core.runs.run import plain
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.ledger import Ledger

from .frames import planned
from .request import Request

LOOK_S = 20.0  # CPU time limit for building descriptions of scenes in an estimate


@dataclass
class RuntimeEstimate:
    """Expected run time of the frames of a sequence."""

    frames: int = 0
    rendered: int = 0  # frames with light that is neither stored nor that of an earlier frame
    equal: int = 0  # frames with the light of an earlier frame, or of another stored scene
    partly: int = 0  # frames of `rendered` for which some light groups are known
    unseen: int = 0  # frames that were not compared, because that would take too long
    seconds: dict[str, float | None] = field(default_factory=dict)  # by stage; None: not known
    threads: int = 1  # number of threads that work on the cameras of a frame

    @property
    def known_s(self) -> float:
        """The elapsed time of all stages with an estimate, s."""
        return elapsed_s(self.seconds, self.threads)

    @property
    def unknown(self) -> list[str]:
        """The stages without an estimate."""
        return [stage for stage, seconds in self.seconds.items() if seconds is None]


@dataclass
class EqualFrames:
    """A search for frames with the light of earlier frames, up to a time limit."""

    most_s: float = LOOK_S  # limit of CPU time
    whole: set[str] = field(default_factory=set)  # names of the light of the frames so far
    groups: set[str] = field(default_factory=set)  # names of their light groups
    spent_s: float = 0.0  # CPU time so far

    def missing(self, frame: Chain, demand: Demand, missing: Demand) -> Demand | None:
        """Return the part of a frame that is left to render; None if another frame has its light.

        Parameters
        ----------
        frame : components of the frame.
        demand : demand on its scene.
        missing : part of the demand that is not stored.

        Raises
        ------
        TimeoutError : the search has taken longer than `most_s`.
        """
        if self.spent_s > self.most_s:
            raise TimeoutError
        start = time.process_time()
        description = ledger.collected(frame.scene).result
        content = None
        if isinstance(description, SceneDescription):
            content = rendering_of(frame, description, recipe_hash(frame)).content
        self.spent_s += time.process_time() - start
        if content is None:
            return missing
        if content.whole in self.whole or is_equal_stored(frame, demand, content):
            return None
        asked = missing.groups or tuple(content.groups)
        new = tuple(g for g in asked if content.groups[g] not in self.groups)
        self.whole.add(content.whole)
        self.groups.update(content.groups.values())
        # labels are rendered together with the light of one group, so one group is kept
        return missing if new == asked else replace(missing, groups=new or asked[:1])


def runtime_estimate(request: Request, most_s: float = LOOK_S) -> RuntimeEstimate:
    """Return the expected run time of a sequence. A stage that is not known for one frame is not
    known for the sequence.

    Parameters
    ----------
    request : settings of the sequence.
    most_s : limit of CPU time for building scenes to find equal frames, s.

    Raises
    ------
    ConfigError : as for `frames.planned`.
    """
    sequence = planned(request)
    found = RuntimeEstimate()
    equal = EqualFrames(most_s)
    runs = newest("runs")
    for number in range(request.frames):
        config = sequence.frame(number, {})
        settings = plain(config)
        frame_chain = chain(config)
        demand = plan(frame_chain, Ledger())
        missing = held_and_missing(frame_chain, demand)[1]
        if missing is not None:
            try:
                rest = equal.missing(frame_chain, demand, missing)
            except TimeoutError:
                found.unseen += 1
            else:
                found.equal += rest is None
                found.partly += rest not in (None, missing)
                missing = rest
        moving = sub_frame_work(frame_chain, demand, runs)
        frame = frame_of(frame_chain, demand)
        expected = expected_s(frame_chain, settings, missing, frame, moving)
        found.frames += 1
        found.threads = camera_threads(frame_chain)
        found.rendered += missing is not None
        for stage in stages(frame_chain, settings, missing):
            so_far = found.seconds.get(stage, 0.0)
            more = expected.get(stage)
            found.seconds[stage] = None if so_far is None or more is None else so_far + more
    return found


def print_runtime_estimate(request: Request) -> None:
    """Print the number of frames of a sequence, and their expected run time."""
    found = runtime_estimate(request)
    console().print(runtime_estimate_table(found.seconds, found.threads))
    total = f"{number_of(found.frames, 'frame')}, {found.rendered} of them to render"
    if found.partly:
        total += f" ({found.partly} in part)"
    if found.equal:
        total += f", {found.equal} equal to another one"
    if found.unseen:
        total += f"; {found.unseen} were not compared, which takes too long"
    if found.unknown:
        total += "; the time is not known, because the stages with ? have no stored example"
    elif found.known_s:
        total += f": about {duration(found.known_s)} in all"
    print(total)
