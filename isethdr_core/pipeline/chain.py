"""The chain: scene -> renderer -> lighting -> lens -> sensor -> isp -> metrics; needs flow the
other way.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from omegaconf import DictConfig, OmegaConf

from ..cli import progress
from ..config.composition import resolved
from ..data.derived_once import shared, values_only
from ..data.quantities import LABELS
from ..data.reference_picture import labels_on, truth
from ..data.scores import Score, state_errors
from ..errors import ConfigError, PluginError
from ..motion.settings import MotionSettings, motion_settings
from ..motion.shot_time import shot_time
from ..motion.visible_motion import LABELS as LABELS_OF_MOTION
from ..plugins.component import Stage
from ..plugins.protocols import (
    CarriesExposure,
    DeclaresNoise,
    KnowsItsField,
    MovesInTime,
    NarrowsDemand,
    ScoresFurther,
)
from ..plugins.registry import build_from_config, plugin_manager
from ..runs.names import check_names
from ..runs.noise_realisations import over_draws, state_spread
from ..runs.reuse import NOT_KEPT, Kept
from ..runs.seeds import checked_seed, generator
from ..sequence.exposure import Exposure, exposures_of
from ..uncertainty import budget, propagation, score_errors, spending
from ..uncertainty import ledger as book
from ..uncertainty.changed_scenes import ScoredShot
from ..uncertainty.ledger import Ledger
from ..uncertainty.score_intervals import RendererError, ScoreKey
from . import bands, early_checks, memory, overscan, window
from .demand import Demand
from .field_check import check_fields, check_rendered, state_field
from .imaging_plan import (
    FieldAhead,
    Imaging,
    ImagingOutline,
    ImagingPlan,
    LightBudget,
    TrivialPlan,
    in_focus,
    outlined,
    plans_imaging,
)
from .noise_limit import CameraNoise
from .shot import CameraShot, Shot, developed

if TYPE_CHECKING:
    import xarray as xr

    from ..plugins.protocols import Sensor
    from .demand import Response


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
    draws: int = 1  # shots with other noise that each score is the mean of
    allowed: budget.Allowed = budget.Allowed()
    leave_out: bool = True  # False: everything is computed, needed or not
    reported: bool = True  # whether a report shows the scene, under all versions
    unreported: tuple[str, ...] = ()  # configured versions, if no report shows them
    shares: budget.Division | None = None  # of the error allowed; None: as the components declare
    motion: MotionSettings | None = None  # during a shot; None: nothing moves
    # carried into this frame, by camera; None: the run is no frame of a sequence
    exposures: Mapping[str, Exposure] | None = None

    def components(self) -> list:
        """Return every component, left to right."""
        return [
            c
            for c in (
                self.scene,
                self.renderer,
                self.lighting,
                *self.versions.values(),
                self.lens,
                *self.flares.values(),
                *self.cameras.values(),
                self.isp,
                *self.metrics.values(),
            )
            if c is not None
        ]


@dataclass
class Camera:
    """The results of one camera: captures, picture, truth on the same grid, labels, and scores."""

    captures: Any
    picture: Any
    truth: Any
    labels: Any
    scores: list = field(default_factory=list)
    scores_of: dict[str, list[Score]] = field(default_factory=dict)  # of the first shot, by metric


def chain(config: DictConfig, rendered: bool = False) -> Chain:
    """Build all components of a composed config.

    Parameters
    ----------
    config : composed.
    rendered : whether the radiance of the scene is stored already. Lightings are then checked by
        the groups of that radiance, when they mix it: to know the groups beforehand, a street is
        laid out, which takes seconds.

    Raises
    ------
    ConfigError : a name, key or value is wrong; nothing has been computed yet.
    """
    config = checked_config(config)

    def table(kind: str, node: DictConfig | None) -> dict[str, Any]:
        if node is not None and not isinstance(node, Mapping):
            raise ConfigError(
                f"{TABLES[kind]} is {node!r}; expected entries by name; "
                f"type for example +{kind}@{TABLES[kind]}.mine=<name>"
            )
        check_names(NAMED[kind], node or ())
        return {key: build_from_config(kind, value) for key, value in (node or {}).items() if value}

    if config.get("sensor"):
        check_names(NAMED["sensor"], [config.sensor.name])
        cameras = {config.sensor.name: build_from_config("sensor", config.sensor)}
    else:
        cameras = table("sensor", config.get("cameras"))
    if not cameras:
        raise ConfigError("the config has no camera; name a sensor, for example sensor=bayer")
    checked_seed(config.get("seed", 0))
    if not (isinstance(config.get("draws", 1), int) and config.get("draws", 1) >= 1):
        raise ConfigError(
            f"draws is {config.draws!r}; expected a whole number of shots, at least 1; type for"
            " example draws=4"
        )
    renderer = config.get("renderer")
    allowed = budget.allowed(config)
    leave_out = switch(config, "leave_out")
    versions = table("lighting", config.get("versions"))
    if SHOWN in versions:
        raise ConfigError(
            f"the version name {SHOWN!r} is taken by the lighting of the run itself; "
            "choose another, for example type versions.night instead"
        )
    reported = switch(config, "report") or not leave_out
    built = Chain(
        scene=build_from_config("scene", config.scene),
        renderer=budget.renderer_with_error(
            build_from_config("renderer", renderer) if renderer else None, allowed
        ),
        lighting=build_from_config("lighting", config.lighting),
        versions=versions if reported else {},
        lens=build_from_config("lens", config.lens),
        flares=table("flare", config.get("flare")),
        cameras=cameras,
        isp=build_from_config("isp", config.isp),
        metrics=table("metric", config.get("metric")),
        draws=config.get("draws", 1),
        leave_out=leave_out,
        reported=reported,
        unreported=() if reported else tuple(versions),
        allowed=allowed,
        motion=motion_settings(config),
        exposures=exposures_of(config, cameras),
    )
    check_fields(built.scene, built.lens, built.cameras.values())
    check_rendered(built.scene, built.renderer)
    early_checks.check_shots(tuple(built.cameras.values()), built.isp)
    if not rendered:
        early_checks.check_scene(built.scene, built.lighting, tuple(built.versions.values()))
    check_motion(built)
    check_exposures(built)
    return spending.with_shares(built, lambda: relative_allowed(built))


def check_motion(chain: Chain) -> None:
    """Raise ConfigError if motion during the shot is asked for, and its duration is not known, or
    the scene does not exist at its end.
    """
    if chain.motion is not None and isinstance(chain.scene, MovesInTime):
        end_s = chain.scene.time_s + shot_time(chain.scene, chain.lens, chain.cameras).seconds
        replace(chain.scene, time_s=end_s)


def check_exposures(chain: Chain) -> None:
    """Raise ConfigError if an exposure is carried for a camera whose exposure is not automatic, or
    that cannot take it.
    """
    for name, exposure in (chain.exposures or {}).items():
        sensor = chain.cameras[name]
        if not (isinstance(sensor, CarriesExposure) and sensor.longest_exposure_s):
            raise ConfigError(
                f"exposures names the camera {name!r}, whose exposure is not automatic; expected a"
                " sensor with an exposure rule; type for example sensor.exposure_rule=centre, or"
                " exposures=null"
            )
        sensor.at_exposure(exposure)


TABLES = {"sensor": "cameras", "lighting": "versions", "flare": "flare", "metric": "metric"}
NAMED = {"sensor": "camera", "lighting": "version", "flare": "flare", "metric": "metric"}
SHOWN = "main"  # the lighting of the run, among the versions that a report shows


def checked_config(config: DictConfig) -> DictConfig:
    """Return a composed config after checking that it is one, and that all its interpolations
    resolve.

    Raises
    ------
    ConfigError : the argument is a list of overrides or a name, or an interpolation leads nowhere.
    """
    if not isinstance(config, DictConfig | dict):
        raise ConfigError(
            f"the config is {config!r}; expected a composed config; "
            'type for example hdr.run(hdr.compose(["sensor=rgbw"]))'
        )
    return resolved(config if isinstance(config, DictConfig) else OmegaConf.create(config))


def switch(config: DictConfig, name: str) -> bool:
    """Return a switch of the config; True if it is absent."""
    value = config.get(name, True)
    if not isinstance(value, bool):
        raise ConfigError(
            f"{name} is {value!r}; expected true or false; type for example {name}=false"
        )
    return value


def plan(chain: Chain, rows: Ledger) -> Demand:
    """Return the demand on the scene, derived backwards from the scores. Everything that is left
    out is stated in `rows`.

    Raises
    ------
    ConfigError : this machine has too little memory for the frame, the lens, or the pixels.
    """
    with book.stage(rows, "plan"):
        book.error(
            0.0,
            "1",
            "bound",
            "a plan computes nothing; the bound of each omission is stated with it",
        )
        state_field(chain.scene, chain.lens)
        if chain.leave_out:
            demand = demand_of_scores(chain)
            sees = demand.response is not None
        else:
            sensed = demand_of_sensors(chain, Demand())
            sees = sensed.response is not None
            demand = Demand(
                labels=frozenset(LABELS),
                error_allowed=sensed.error_allowed,
                stored_error_allowed=sensed.stored_error_allowed,
            )
        if chain.motion is not None and isinstance(chain.scene, MovesInTime):
            demand = demand.with_labels(*LABELS_OF_MOTION)
        check_memory(chain, demand)
        if not sees:  # without noise of the sensors no noise of the light is small beside it
            return demand
        sharp = replace(chain, lens=in_focus(chain.lens))
        imaged = partial(on_sensor, sharp, demand=demand)
        limit = CameraNoise(chain.lighting, sharp.lens, chain.cameras, imaged, generator())
        return replace(demand, noise_limit=limit)


def check_memory(chain: Chain, demand: Demand) -> None:
    """Raise ConfigError if the data that `demand` asks for exceed the memory of this machine."""
    memory.check_run(
        chain.renderer or chain.scene,
        chain.scene,
        chain.lens,
        tuple(chain.flares.values()),
        tuple(chain.cameras.values()),
        frame_of(chain, demand),
    )


def frame_of(chain: Chain, demand: Demand) -> memory.Frame | None:
    """Return the tiles and bands of the light in a run; None if scene and renderer do not state
    them.
    """
    source = chain.renderer or chain.scene
    wavelength_nm = demand.wavelength_nm or bands.offered_nm(source)
    sensed = demand.response is not None
    return memory.frame_of(source, chain.scene, wavelength_nm, demand.margin, sensed)


def demand_of_scores(chain: Chain) -> Demand:
    """Return the demand of the scores on the scene. Everything that no score needs is stated in the
    ledger.
    """
    if not chain.reported:
        book.left_out(
            "display view of the scene",
            "no report is asked for, and only it shows it",
            0.0,
            "cd/m2",
            needless=True,
        )
    for version in chain.unreported:
        book.left_out(
            f"lighting {version}, and light groups that it alone needs",
            "no report is asked for, and only it shows them",
            0.0,
            "cd/m2",
            needless=True,
        )
    offered = bands.offered_nm(chain.renderer or chain.scene)
    demand = Demand(wavelength_nm=offered)
    for metric in chain.metrics.values():
        demand = narrowed(metric, demand)
    demand = narrowed(chain.isp, demand)
    demand = demand_of_sensors(chain, demand)
    for flare in chain.flares.values():
        demand = narrowed(flare, demand)
    demand = narrowed(chain.lens, demand)
    state_labels(chain, demand)
    outline = imaging_outline(chain, demand, offered)
    book.record_left_out(*outline.left_out)
    needed_nm = bands.for_sensors_and_truth(offered, demand.wavelength_nm)
    lightings = chain.lighting, *chain.versions.values()
    demand = overscan.left_out_where_unseen(
        replace(demand, wavelength_nm=needed_nm), chain.renderer, outline, lightings
    )
    return union([narrowed(light, demand) for light in lightings])


def imaging_outline(
    chain: Chain, demand: Demand, offered_nm: tuple[float, ...] | None
) -> ImagingOutline:
    """Return the outline of the lens's plan for the light that `demand` asks for.

    Parameters
    ----------
    chain : components of the run.
    demand : demand of the sensors, narrowed by flares and lens.
    offered_nm : all bands of the light; None if they are not known in advance.
    """
    size = chain.scene.camera_field() if isinstance(chain.scene, KnowsItsField) else None
    budgeted = LightBudget(demand.error_allowed, demand.window_m, demand.wavelength_nm)
    flares = tuple(chain.flares.values())
    return outlined(chain.lens, flares, FieldAhead(size, offered_nm), budgeted)


def demand_of_sensors(chain: Chain, demand: Demand) -> Demand:
    """Return the union of the sensors' demands, with the accuracy that the light needs. The
    accuracy also applies to stored light, and even if nothing is left out.
    """
    return budget.budgeted(
        union([narrowed(sensor, demand) for sensor in chain.cameras.values()]),
        chain.allowed,
        chain.shares or budget.division(spending.of_chain(chain)),
    )


def relative_allowed(chain: Chain) -> float:
    """Return the relative error allowed of all light after the radiance; 0: the exact way."""
    union_of_sensors = book.collected(
        lambda: union([narrowed(sensor, Demand()) for sensor in chain.cameras.values()])
    )
    response = union_of_sensors.result.response
    if response is None:
        return 0.0
    return replace(response, noise_fraction_allowed=chain.allowed.noise_fraction).error_allowed


def state_labels(chain: Chain, demand: Demand) -> None:
    """State which labels a renderer need not make."""
    unread = [label for label in LABELS if label not in demand.labels]
    if chain.renderer is not None and unread:
        book.left_out(
            f"labels {', '.join(unread)}", "no metric reads them", 0.0, "labels", needless=True
        )


def narrowed(component: Any, demand: Demand) -> Demand:
    """Return the demand as the component narrows it, or unchanged."""
    return component.narrow(demand) if isinstance(component, NarrowsDemand) else demand


def union(demands: list[Demand]) -> Demand:
    """Return the smallest demand that covers all of `demands`."""
    first, *others = demands
    for other in others:
        first = replace(
            first,
            groups=(
                None
                if first.groups is None or other.groups is None
                else tuple(dict.fromkeys(first.groups + other.groups))
            ),
            wavelength_nm=(
                None
                if first.wavelength_nm is None or other.wavelength_nm is None
                else tuple(sorted(set(first.wavelength_nm) | set(other.wavelength_nm)))
            ),
            labels=first.labels | other.labels,
            error_allowed=min(first.error_allowed, other.error_allowed),
            stored_error_allowed=min(first.stored_error_allowed, other.stored_error_allowed),
            response=joined(first.response, other.response),
            margin=first.margin or other.margin,
            window_m=window.wider(first.window_m, other.window_m),
        )
    return first


def joined(first: Response, second: Response) -> Response:
    """Return the response of all sensors, None where one needs light wavelength by wavelength."""
    if first is second or None in (first, second):
        return first if first is second else None
    return first + second


def stage(
    rows: Ledger,
    kind: str,
    name: str,
    component: Any | None,
    call: Callable[..., Any],
    kept: Kept = NOT_KEPT,
) -> Any:
    """Run `call()` as one stage: hooks around it, a row in the ledger, the result back.

    `kept` : where a result of an earlier run may be, which takes the place of the call, and its row
        that of this one.

    Parameters
    ----------
    rows : ledger that gets the row of the stage.
    kind : kind of the component, for example `lens`.
    name : name of the stage after its kind; it may be empty.
    component : component that the hooks receive; None if the stage has none.
    call : function without arguments that computes the result.
    kept : where a result of an earlier run may be. It takes the place of the call, and its row
        replaces the row of this stage.
    """
    hook = plugin_manager().hook
    at_work = Stage(kind, name, component)
    title = f"{kind} {name}" if name else kind
    hook.isethdr_before_stage(stage=at_work)
    try:
        with book.stage(rows, title) as at_work.row, progress.shown(title):
            earlier = kept.reuse.earlier(kept.name)
            start_s = time.process_time()
            if earlier is None:
                at_work.result = call()
            else:
                book.record_row(earlier.row)
                at_work.result = earlier.result
        if earlier is None:
            cpu_s = time.process_time() - start_s
            kept.reuse.keep(kept.name, at_work.result, at_work.row, cpu_s)
        else:
            at_work.row.seconds = earlier.row.seconds
            at_work.row.cpu_s = earlier.row.cpu_s
            at_work.row.reused = True
            at_work.row.peak_bytes = earlier.row.peak_bytes
    except BaseException as err:
        at_work.error = err
        err.add_note(f"in stage {title}")
        hook.isethdr_on_stage_error(stage=at_work)
        raise
    hook.isethdr_after_stage(stage=at_work)
    return at_work.result


def imaging_plan(chain: Chain, mixed: xr.DataArray, demand: Demand) -> ImagingPlan:
    """Return the plan by which the lens computes light on the sensor plane.

    The plan is trivial if the lens has none of its own, or if nothing may be left out.

    Parameters
    ----------
    chain : components of the run.
    mixed : ([component,] wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    demand : demand of the sensors for light on the sensor plane.
    """
    flares = tuple(chain.flares.values())
    if not chain.leave_out:
        return TrivialPlan(chain.lens, flares)
    if not plans_imaging(chain.lens):
        return TrivialPlan(chain.lens, flares, demand.response, demand.error_allowed)
    sensed_nm = bands.sensed_nm(chain.cameras.values(), mixed.wavelength.values)
    budgeted = LightBudget(demand.error_allowed, demand.window_m, sensed_nm)
    return chain.lens.plan(flares, mixed, demand.response, budgeted)


def imaging(chain: Chain, mixed: xr.DataArray, demand: Demand) -> Imaging:
    """Return the imaging of mixed radiance. Its plan is made once, on first use.

    Parameters
    ----------
    chain : components of the run.
    mixed : ([component,] wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    demand : demand of the sensors for light on the sensor plane.
    """
    return Imaging(mixed, lambda: imaging_plan(chain, mixed, demand))


def on_sensor(chain: Chain, mixed: xr.DataArray, demand: Demand) -> xr.DataArray:
    """Return the light on the sensor plane, without its plan.

    Parameters
    ----------
    chain : components of the run.
    mixed : ([component,] wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    demand : demand of the sensors for light on the sensor plane.
    """
    return imaging(chain, mixed, demand).light()


def through_camera(chain: Chain, rows: Ledger, name: str, shot: Shot) -> Camera:
    """Return the results of one camera, with its scores against the truth.

    Parameters
    ----------
    chain : components of the run.
    rows : ledger that gets the rows of the camera's stages.
    name : name of the camera in the config.
    shot : light on the sensor plane, its reference, and the noise key of the shot.
    """
    sensor = chain.cameras[name]
    light = shot.light
    camera_shot = CameraShot(shot, sensor, chain.isp)
    captures = stage(
        rows,
        "sensor",
        name,
        sensor,
        lambda: sensor(light, shot.generator),
        camera_shot.kept_captures(),
    )
    picture = stage(
        rows,
        "isp",
        name,
        chain.isp,
        lambda: developed(chain.isp, captures),
        camera_shot.kept_picture(),
    )
    with book.stage(rows, f"truth {name}"):
        reference = truth(shot.reference, picture)
        labels = labels_on(shot.scene, picture)
    camera = Camera(captures, picture, reference, labels)

    def scores_of_further(metric: Any, picture_of_draw: Any) -> list[Score]:
        if isinstance(metric, ScoresFurther):
            return metric.further(picture_of_draw, picture, reference, labels)
        scores: list[Score] = metric(picture_of_draw, reference, labels)
        return scores

    def of_draw(draw: int) -> list[Score]:
        return camera_shot.values_of(draw, chain.metrics.values(), scores_of_further)

    def again(draw: int) -> list[Score]:
        """Return the scores of the same shot with other noise; its terms are those of the first
        shot, and only its values count.
        """
        with values_only():
            return book.collected(lambda: of_draw(draw)).result

    with shared(reference, labels, light, picture):
        for key, metric in chain.metrics.items():
            camera.scores_of[key] = stage(
                rows,
                "metric",
                f"{key} {name}",
                metric,
                lambda k=key, m=metric: scored(k, m(picture, reference, labels)),
                camera_shot.kept_scores(metric),
            )
        camera.scores = [score for scores in camera.scores_of.values() for score in scores]
        shots = [camera.scores]
        if chain.draws > 1 and chain.metrics:
            with book.stage(rows, f"draws {name}"):
                more_shots = (
                    [again(k) for k in range(1, chain.draws)]
                    if varies(chain, sensor)
                    else shots * (chain.draws - 1)
                )
                shots += more_shots
                state_spread(over_draws(shots), chain.draws)
        renderer = renderer_errors(chain, rows, name, camera, camera_shot)
    camera.scores = over_draws(shots, renderer)
    state_picture(chain, rows, name, camera, camera_shot)
    return camera


def renderer_errors(
    chain: Chain, rows: Ledger, name: str, camera: Camera, camera_shot: CameraShot
) -> dict[ScoreKey, RendererError]:
    """Return the error of each score due to renderer noise, and add the row that states it.

    Parameters
    ----------
    chain : components of the run.
    rows : ledger that gets the row of the errors.
    name : name of the camera in the config.
    camera : results of the camera, with the scores of its picture.
    camera_shot : computes pictures of changed light.

    Returns
    -------
    The error of each score. Empty if the scene states no renderer noise, or the scores have no
    interval.
    """
    if not chain.metrics:
        return {}
    with book.stage(rows, f"scores {name}") as row:
        if chain.draws > 1:
            shot = camera_shot.shot
            metrics = list(chain.metrics.values())
            scored_shot = ScoredShot(
                picture=camera.picture,
                truth=camera.truth,
                labels=camera.labels,
                scores=camera.scores,
                light=shot.light,
                mixed_radiance=shot.mixed,
                scene=shot.scene,
                expose=camera_shot.picture_of,
            )
            scores = list(camera.scores_of.values())
            errors_by_metric = shot.reuse.values(
                [camera_shot.score_errors_name(metric) for metric in metrics],
                lambda lacking: score_errors.of_each(
                    scored_shot, [metrics[k] for k in lacking], [scores[k] for k in lacking]
                ),
            )
            errors = score_errors.joined(errors_by_metric)
        else:
            why = "one shot does not tell how much the next one differs; draws=4 does"
            errors = score_errors.ScoreErrors(
                left_out=(book.LeftOut("intervals of scores", why, float("inf"), "1"),)
            )
        book.record(*errors.terms)
        row.left_out += errors.left_out
    # a row without an error is not kept: its omissions move to the row before
    if not row.errors:
        rows.pop()
        rows[-1].left_out += row.left_out
    return errors.errors


def state_picture(
    chain: Chain, rows: Ledger, name: str, camera: Camera, camera_shot: CameraShot
) -> None:
    """Add the row that states the error of the picture, in units of the sensor's noise, and the
    time spent.

    Parameters
    ----------
    chain : components of the run.
    rows : ledger that gets the row of the picture.
    name : name of the camera in the config.
    camera : captures and picture of the camera.
    camera_shot : the shot as this camera exposes it.
    """
    shot = camera_shot.shot
    with book.stage(rows, f"picture {name}"):
        if lacking := propagation.missing(camera.captures):
            book.error(
                float("inf"),
                propagation.UNIT,
                "bound",
                f"not known: the captures lack {', '.join(lacking)}",
            )
            return
        sampled = (
            propagation.regular_sample(camera.captures) if chain.leave_out else camera.captures
        )
        rows_of_camera = [
            row
            for row in rows
            if row.stage == f"sensor {name}" or not row.stage.startswith("sensor ")
        ]
        noise = propagation.stated_noise(rows_of_camera)
        exposure = propagation.Exposure(sampled, shot.light, shot.mixed, shot.scene)

        def electrons() -> list[propagation.Electrons]:
            errors = shot.imaging.plan.light_errors
            shots = propagation.electrons(exposure, noise, errors)
            return propagation.with_parts(shots, sampled, rows_of_camera)

        electrons_name = camera_shot.electrons_name([noise, chain.leave_out])
        shots = shot.reuse.value(electrons_name, electrons)
        propagation.record_figures(
            shots,
            rows_of_camera,
            chain.allowed.noise_fraction,
            propagation.seconds(rows, name, shot.scene),
        )


def varies(chain: Chain, sensor: Sensor) -> bool:
    """Return whether another noise realisation changes the picture. A sensor without noise declares
    this in its field `noise`.
    """
    noisy = not isinstance(sensor, DeclaresNoise) or sensor.noise
    if not chain.leave_out or noisy:
        return True
    book.left_out(
        f"{chain.draws - 1} more noise realisations",
        "the sensor has none: they would be the same",
        0.0,
        "relative",
        needless=True,
    )
    return False


def scored(key: str, scores: Sequence[Any]) -> list[Score]:
    """Return the scores of one metric, their intervals stated in the ledger; PluginError where it
    returned something else.
    """
    if not (isinstance(scores, list) and all(isinstance(s, Score) for s in scores)):
        raise PluginError(
            f"metric {key!r} returned {scores!r}; expected a list of isethdr_core.Score"
        )
    state_errors(scores)
    return scores
