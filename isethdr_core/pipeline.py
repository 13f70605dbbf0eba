"""The chain: scene -> renderer -> lighting -> lens -> sensor -> isp -> metrics; needs flow the other way."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from . import ledger as book
from . import progress
from .component import Stage
from .demand import Demand
from .errors import ConfigError, PluginError
from .ledger import Ledger
from .registry import build_from_config, plugin_manager
from .scores import Score


@dataclass(frozen=True)
class Chain:
    """The components of one run, built from its config before any work starts."""

    scene: Any
    renderer: Any
    lighting: Any
    versions: dict[str, Any]
    lens: Any
    flares: dict[str, Any]
    cameras: dict[str, Any]
    isp: Any
    metrics: dict[str, Any]

    def components(self) -> list:
        """Return every component, left to right."""
        return [c for c in (self.scene, self.renderer, self.lighting, *self.versions.values(), self.lens,
                            *self.flares.values(), *self.cameras.values(), self.isp, *self.metrics.values()) if c is not None]


@dataclass
class Camera:
    """What one camera made of the light: captures, picture, truth on its grid, labels, and scores."""

    captures: Any
    picture: Any
    truth: Any
    labels: Any
    scores: list = field(default_factory=list)


def chain(config) -> Chain:
    """Build all components of a composed config.

    Raises
    ------
    ConfigError : a name, key or value is wrong; nothing has been computed yet.
    """
    def table(kind, node):
        return {key: build_from_config(kind, value) for key, value in (node or {}).items() if value}

    if config.get("sensor"):
        cameras = {config.sensor.name: build_from_config("sensor", config.sensor)}
    else:
        cameras = table("sensor", config.get("cameras"))
    if not cameras:
        raise ConfigError("the config has no camera; name a sensor, for example sensor=bayer")
    if not isinstance(config.get("seed", 0), int):
        raise ConfigError(f"seed is {config.seed!r}; expected a whole number; type for example seed=7")
    renderer = config.get("renderer")
    return Chain(
        scene=build_from_config("scene", config.scene),
        renderer=build_from_config("renderer", renderer) if renderer else None,
        lighting=build_from_config("lighting", config.lighting),
        versions=table("lighting", config.get("versions")),
        lens=build_from_config("lens", config.lens),
        flares=table("flare", config.get("flare")),
        cameras=cameras,
        isp=build_from_config("isp", config.isp),
        metrics=table("metric", config.get("metric")))


def plan(parts: Chain, rows: Ledger) -> Demand:
    """Return what is needed of the scene, asked backwards from the scores; what that drops goes into `rows`."""
    demand = Demand()
    with book.stage(rows, "plan"):
        for metric in parts.metrics.values():
            demand = narrowed(metric, demand)
        demand = narrowed(parts.isp, demand)
        demand = union([narrowed(sensor, demand) for sensor in parts.cameras.values()])
        for flare in parts.flares.values():
            demand = narrowed(flare, demand)
        demand = narrowed(parts.lens, demand)
        return union([narrowed(light, demand) for light in (parts.lighting, *parts.versions.values())])


def narrowed(component, demand: Demand) -> Demand:
    """Return the demand as the component narrows it, or unchanged."""
    narrow = getattr(component, "narrow", None)
    return narrow(demand) if narrow else demand


def union(demands: list[Demand]) -> Demand:
    """Return the smallest demand that covers all of `demands`."""
    first, *rest = demands
    for other in rest:
        first = replace(
            first,
            groups=None if first.groups is None or other.groups is None else tuple(dict.fromkeys(first.groups + other.groups)),
            wavelength_nm=None if first.wavelength_nm is None or other.wavelength_nm is None else tuple(
                sorted(set(first.wavelength_nm) | set(other.wavelength_nm))),
            labels=first.labels | other.labels,
            error_allowed=min(first.error_allowed, other.error_allowed))
    return first


def stage(rows: Ledger, kind: str, name: str, component, call):
    """Run `call()` as one stage: hooks around it, a row in the ledger, the result back."""
    hook, at_work, title = plugin_manager().hook, Stage(kind, name, component), f"{kind} {name}" if name else kind
    hook.isethdr_before_stage(stage=at_work)
    try:
        with book.stage(rows, title) as at_work.row, progress.shown(title):
            at_work.result = call()
    except BaseException as err:
        at_work.error = err
        err.add_note(f"in stage {title}")
        hook.isethdr_on_stage_error(stage=at_work)
        raise
    hook.isethdr_after_stage(stage=at_work)
    return at_work.result


def through_camera(parts: Chain, rows: Ledger, name: str, light, mixed, scene, generator) -> Camera:
    """Return what the camera `name` makes of the light, and its scores against truth."""
    from .truth import labels_on, truth

    sensor = parts.cameras[name]
    captures = stage(rows, "sensor", name, sensor, lambda: sensor(light, generator))
    picture = stage(rows, "isp", name, parts.isp, lambda: parts.isp(captures))
    with book.stage(rows, f"truth {name}"):
        reference, labels = truth(mixed, picture), labels_on(scene, picture)
    seen = Camera(captures, picture, reference, labels)
    for key, metric in parts.metrics.items():
        seen.scores += checked(key, stage(rows, "metric", f"{key} {name}", metric, lambda m=metric: m(picture, reference, labels)))
    return seen


def checked(key: str, scores) -> list[Score]:
    """Return the scores of one metric, or raise PluginError where it returned something else."""
    if not (isinstance(scores, list) and all(isinstance(s, Score) for s in scores)):
        raise PluginError(f"metric {key!r} returned {scores!r}; expected a list of isethdr_core.Score")
    return scores
