"""Forecast: run time of all frames of a sequence, from stored runs, before any work."""

from __future__ import annotations

from dataclasses import dataclass, field

from isethdr_core.cli.summary_tables import forecast_table, seconds_text
from isethdr_core.cli.terminal import console
from isethdr_core.motion.run_time import sub_frame_work
from isethdr_core.pipeline.chain import chain, frame_of, plan
from isethdr_core.pipeline.runtime_estimate import expected_s, newest, stages
from isethdr_core.runs.radiance_cache import held_and_missing
from isethdr_core.runs.run import plain
from isethdr_core.uncertainty.ledger import Ledger

from .frames import planned
from .request import Request


@dataclass
class Forecast:
    """What the frames of a sequence take."""

    frames: int = 0
    rendered: int = 0  # frames whose radiance is not stored
    seconds: dict[str, float | None] = field(default_factory=dict)  # by stage; None: not known

    @property
    def known_s(self) -> float:
        """The sum over all stages that are known."""
        return sum(seconds for seconds in self.seconds.values() if seconds is not None)

    @property
    def unknown(self) -> list[str]:
        """The stages without an estimate."""
        return [stage for stage, seconds in self.seconds.items() if seconds is None]


def forecast(request: Request) -> Forecast:
    """Return what a sequence takes. A stage that is not known for one frame is not known.

    Raises
    ------
    ConfigError : as of `frames.planned`.
    """
    sequence = planned(request)
    found = Forecast()
    runs = newest("runs")
    for number in range(request.frames):
        config = sequence.frame(number, {})
        settings = plain(config)
        frame_chain = chain(config)
        demand = plan(frame_chain, Ledger())
        missing = held_and_missing(frame_chain, demand)[1]
        moving = sub_frame_work(frame_chain, demand, runs)
        frame = frame_of(frame_chain, demand)
        expected = expected_s(frame_chain, settings, missing, frame, moving)
        found.frames += 1
        found.rendered += missing is not None
        for stage in stages(frame_chain, settings, missing):
            so_far = found.seconds.get(stage, 0.0)
            more = expected.get(stage)
            found.seconds[stage] = None if so_far is None or more is None else so_far + more
    return found


def print_forecast(request: Request) -> None:
    """Print the number of frames, and how long they take."""
    found = forecast(request)
    console().print(forecast_table(found.seconds))
    total = f"{found.frames} frames, {found.rendered} of them to render"
    if found.known_s:
        total += f": about {seconds_text(found.known_s)} s in all"
    if found.unknown:
        total += f"; not known: {', '.join(found.unknown)}"
    print(total)
