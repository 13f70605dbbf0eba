"""Frames: the config of each frame of a sequence, and the runs of all frames.

Each frame is a run of its own, with exposures that follow from the metering of the previous frames.
Metering has no noise, so exposures do not depend on the seed, and a sequence that is typed again
finds all its stored frames.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from omegaconf import DictConfig, OmegaConf, open_dict

from isethdr_core.cli.progress import hidden, track
from isethdr_core.config.composition import compose
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import Chain, chain
from isethdr_core.plugins.protocols import CarriesExposure, ListsGroups, MovesInTime
from isethdr_core.runs.labels import Labels, add_labels, checked
from isethdr_core.runs.run import Result, run
from isethdr_core.sequence.exposure import NODE, Exposure, SettledExposure, as_config
from isethdr_core.sequence.frame_exposures import settled_of
from isethdr_core.sweeps.record import Job, Sweep, begin, check_free, name_of, write_job

from .request import Request

TIME = "scene.time_s"
RATE = "scene.frames_per_s"
ROUNDING = 1e-9  # relative tolerance, because 1 / 30 s has no exact decimal number


@dataclass(frozen=True)
class Frame:
    """One finished frame."""

    number: int  # from 0
    time_s: float
    result: Result

    @property
    def exposures(self) -> Mapping[str, Any]:
        """The record of the automatic exposures, by camera."""
        return self.result.attributes.get(NODE, {})


@dataclass(frozen=True)
class Made:
    """A finished sequence."""

    sweep: Sweep  # the record of its runs
    frames: list[Frame] = field(default_factory=list)


@dataclass(frozen=True)
class Plan:
    """The times of a sequence, and the config that its frames share."""

    request: Request
    config: DictConfig
    chain: Chain

    @property
    def times_s(self) -> list[float]:
        """The time of the scene in each frame."""
        start_s = self.chain.scene.time_s
        return [start_s + k / self.request.frames_per_second for k in range(self.request.frames)]

    def frame(self, number: int, exposures: Mapping[str, Exposure]) -> DictConfig:
        """Return the config of one frame.

        Parameters
        ----------
        number : number of the frame, from 0.
        exposures : exposures that are carried into the frame, by camera.
        """
        config = self.config.copy()
        with open_dict(config):
            config.scene.time_s = self.times_s[number]
            config.scene.frames_per_s = self.request.frames_per_second
            config[NODE] = OmegaConf.create(as_config(exposures))
        return config


def planned(request: Request) -> Plan:
    """Return the plan of a sequence, checked before any work.

    Raises
    ------
    ConfigError : an override is wrong, the scene does not move, an exposure is longer than a frame,
        or the scene ends before the last frame.
    """
    config = compose(request.overrides)
    built = chain(config)
    if not isinstance(built.scene, MovesInTime):
        raise ConfigError(
            f"scene {config.scene.name!r} does not move; expected a scene with the fields time_s"
            " and frames_per_s; type for example scene=street"
        )
    if config.get(NODE) is not None:
        raise ConfigError(
            f"{NODE} is set, but a sequence determines it; expected null; type {NODE}=null"
        )
    is_typed = any(one.lstrip("+").startswith(f"{RATE}=") for one in request.overrides)
    typed = config.scene.frames_per_s
    if is_typed and typed is not None and typed != request.frames_per_second:
        raise ConfigError(
            f"{RATE} is {typed:g}, but a sequence determines it; type"
            f" frames_per_second={typed:g} in its place"
        )
    _check_exposures(built, 1 / request.frames_per_second)
    plan = Plan(request, config, built)
    last = replace(built.scene, time_s=plan.times_s[-1])
    if isinstance(last, ListsGroups):
        last.light_groups()  # raises ConfigError if the scene ends before the last frame
    return plan


def _check_exposures(built: Chain, frame_s: float) -> None:
    for name, sensor in built.cameras.items():
        longest_s = sensor.longest_exposure_s if isinstance(sensor, CarriesExposure) else None
        if longest_s and longest_s > frame_s * (1 + ROUNDING):
            raise ConfigError(
                f"the automatic exposure of camera {name!r} may take {longest_s:g} s, longer than"
                f" a frame of {frame_s:.4g} s; expected exposure_max_s within a frame; type for"
                f" example sensor.exposure_max_s={0.9 * frame_s:.3g}, or"
                f" cameras.{name}.exposure_max_s where there are several, or a smaller"
                " frames_per_second"
            )


def make(request: Request) -> Made:
    """Compute the frames of a sequence, or read stored ones, and write the record of the sequence.

    Raises
    ------
    IsetHdrError : an input is wrong; finished frames stay stored.
    """
    plan = planned(request)
    typed = request.typed()
    name = checked("name", request.name or name_of(typed).replace("sweep-", "sequence-"))
    sweep = Sweep(name, typed, (TIME,), request.frames)
    check_free(sweep)
    begin(sweep)
    made = Made(sweep)
    settled: dict[str, list[SettledExposure]] = {}
    for number in track(range(request.frames), "frames"):
        exposures = {c: request.control.next_exposure(s) for c, s in settled.items()}
        started = time.monotonic()
        with hidden():
            result = run(plan.frame(number, exposures))
        frame = Frame(number, plan.times_s[number], result)
        for camera, record in frame.exposures.items():
            settled.setdefault(camera, []).append(settled_of(record))
        made.frames.append(frame)
        add_labels(result.path, Labels(sweeps=(sweep.name,)))
        seconds = time.monotonic() - started
        overrides = (f"{TIME}={frame.time_s!r}",)
        write_job(sweep.folder, Job(number, overrides, seconds, result.path.stem, result.computed))
    return made
