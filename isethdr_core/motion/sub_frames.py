"""Sub-frames: the light of a scene that moves during a shot.

The first sub-frame is the scene itself, at the start of the shot. Labels and reference picture are
those of this moment. Each further sub-frame is the scene of a later moment. It is rendered with
fewer samples and its own seed: still parts of the picture are the mean of all sub-frames, and the
noise of this mean is stated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from math import ceil, sqrt
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ..cli import progress
from ..data.quantities import MOTION
from ..data.scene_description import SceneDescription
from ..data.temporal_modulation import components, stacked
from ..lighting.mix import group_names, mix
from ..physics.detector.temporal_modulation import Modulation
from ..pipeline.chain import Chain
from ..pipeline.demand import Demand
from ..plugins.protocols import MovesInTime, NamesItsEffort
from ..runs.radiance_cache import scene_radiance
from ..uncertainty import ledger
from ..uncertainty.ledger import Ledger
from ..uncertainty.render_noise import HALF_DIFFERENCE, NOISE
from .moments import SubFrame, sub_frames, within
from .shot_time import ShotTime, shot_time
from .visible_motion import displacement

STILL = 0.1  # share of `step_px`; a scene that moves less during a shot counts as still
LEAST_SAMPLES = 2  # smallest number; from one sample the renderer cannot estimate its noise
LARGEST_ERROR_ALLOWED = 0.999  # relative noise that a renderer accepts
# effort fields of renderers, and their value for one of several sub-frames that are averaged
CHEAPER: dict[str, Callable[[float, int], float]] = {
    "samples": lambda samples, steps: max(ceil(samples / steps), LEAST_SAMPLES),
    "error_allowed": lambda noise, steps: min(noise * sqrt(steps), LARGEST_ERROR_ALLOWED),
    "noise_share_allowed": lambda share, steps: share * sqrt(steps),
}


@dataclass(frozen=True, eq=False)
class Still:
    """The start of a shot: scene radiance with its labels, and its mixed radiance."""

    scene: xr.Dataset
    mixed: xr.DataArray


@dataclass(frozen=True, eq=False)
class Moving:
    """The light of a shot during which the scene moves.

    Attributes
    ----------
    mixed : mixed radiance (component, wavelength, y, x), a component for each sub-frame.
    scene : radiance and labels at the start of the shot, with the renderer's noise of the mean of
        all sub-frames.
    record : settings, moments and stores, as plain data.
    """

    mixed: xr.DataArray
    scene: xr.Dataset
    record: dict[str, Any]


class _Moment(NamedTuple):
    """One sub-frame: its radiance, and the names of the stores that hold it."""

    sub_frame: SubFrame
    scene: xr.Dataset
    ids: list[str]


def in_motion(
    chain: Chain, demand: Demand, rows: Ledger, config: Any, still: Still
) -> Moving | None:
    """Return the light of a shot during which the scene moves, as `Moving`; None if it stands
    still, or if the settings of the chain do not ask for motion.

    Parameters
    ----------
    chain : components of the run.
    demand : demand for the scene radiance.
    rows : ledger of the run.
    config : composed config.
    still : light at the start of the shot.

    Raises
    ------
    ConfigError : the duration of the shot is not known, or the scene does not exist at a moment.
    """
    settings = chain.motion
    if settings is None:
        return None
    with ledger.stage(rows, "motion"):
        if not isinstance(chain.scene, MovesInTime):
            _state_still(f"scene {config.scene.name} does not move", 0.0)
            return None
        time = shot_time(chain.scene, chain.lens, chain.cameras)
        motion_px = time.pixels_per_field * largest_motion(chain.scene, still.scene, time.seconds)
        if settings.sub_frames is None and motion_px <= STILL * settings.step_px:
            _state_still(f"scene {config.scene.name} stands still during the shot", motion_px)
            return None
        count = settings.count(motion_px)
        moments = _moments(chain, demand, config, still, sub_frames(time.seconds, count))
        _state(motion_px, count, time)
        shot_s = time.seconds
        record = {
            "settings": asdict(settings),
            "shot_s": shot_s,
            "motion_px": motion_px,
            "moments_s": [m.sub_frame.moment_s for m in moments],
            "scene_ids": [m.ids for m in moments],
        }
        mixed = _mixed(chain.lighting, moments, still.mixed, shot_s)
        return Moving(mixed, _with_noise(still.scene, moments, shot_s), record)


def largest_motion(scene: Any, still: xr.Dataset, shot_s: float) -> float:
    """Return the largest motion of a tile within the camera's field during a shot, in the unit of
    the field coordinates.

    Parameters
    ----------
    scene : scene component with `time_s` and `frames_per_s`.
    still : its radiance, with `distance` and `instance` where it is rendered.
    shot_s : duration of the shot.
    """
    made = ledger.collected(replace(scene, frames_per_s=1 / shot_s)).result
    if isinstance(made, SceneDescription):
        motion = displacement(made, still)
    elif MOTION in made:
        motion = np.hypot(*np.moveaxis(made[MOTION].values.astype(float), -1, 0))
    else:
        return 0.0
    width = still.attrs.get("field_width", np.inf)
    height = still.attrs.get("field_height", np.inf)
    rows = np.abs(still.y.values) < height / 2
    columns = np.abs(still.x.values) < width / 2
    seen = motion[rows][:, columns]
    return float(np.max(seen, where=np.isfinite(seen), initial=0.0))


def cheaper(renderer: Any, number: int, steps: int) -> Any:
    """Return the renderer of one sub-frame. It has less effort, because the mean over all
    sub-frames counts, and its own random numbers.

    Parameters
    ----------
    renderer : renderer of the run; None if the scene provides its own radiance.
    number : number of the sub-frame, from 0; it is added to the renderer's seed.
    steps : number of sub-frames.
    """
    if renderer is None:
        return None
    effort = renderer.effort_fields if isinstance(renderer, NamesItsEffort) else ()
    values = {name: getattr(renderer, name) for name in effort if name in CHEAPER}
    changed: dict[str, Any] = {
        name: CHEAPER[name](value, steps) for name, value in values.items() if value is not None
    }
    if any(field.name == "seed" for field in fields(renderer)):
        changed["seed"] = renderer.seed + number
    return replace(renderer, **changed)


def _moments(
    chain: Chain, demand: Demand, config: Any, still: Still, shot: list[SubFrame]
) -> list[_Moment]:
    """Return the radiance of the sub-frames of a shot; the first one is its start.

    Parameters
    ----------
    chain : components of the run.
    demand : demand for the scene radiance.
    config : composed config.
    still : light at the start of the shot.
    shot : the sub-frames.
    """
    first, *later = shot
    found = [_Moment(first, still.scene, [])]
    grid = still.scene
    beyond = float(np.abs(grid.x.values).max()) > grid.attrs.get("field_width", np.inf) / 2
    needed = replace(demand, labels=frozenset(), margin=demand.margin or beyond)
    for number, sub_frame in enumerate(later, start=1):
        at_moment = replace(
            chain,
            scene=replace(chain.scene, time_s=chain.scene.time_s + sub_frame.moment_s),
            renderer=cheaper(chain.renderer, number, len(later)),
        )
        with progress.shown(f"sub-frame {number} of {len(later)}"):
            scene, ids = scene_radiance(at_moment, needed, Ledger(), config)
        found.append(_Moment(sub_frame, _on_grid(scene, grid), ids))
    return found


def _on_grid(scene: xr.Dataset, grid: xr.Dataset) -> xr.Dataset:
    """Return the tiles of `scene` that `grid` has; stored radiance may reach farther out."""
    sizes = [(part.sizes["y"], part.sizes["x"]) for part in (scene, grid)]
    if sizes[0] == sizes[1]:
        return scene
    cut = scene.sel(y=grid.y.values, x=grid.x.values, method="nearest")
    return cut.assign_coords(y=grid.y, x=grid.x)


def _mixed(
    lighting: Any, moments: list[_Moment], still: xr.DataArray, shot_s: float
) -> xr.DataArray:
    """Return mixed radiance (component, wavelength, y, x) of all sub-frames, with the weights and
    the lamps' modulation of the first one.
    """
    modulation = {g: Modulation(**m) for g, m in still.attrs.get("modulation", {}).items()}
    names: list[str] = []
    modulations: list[Modulation] = []
    planes: list[xr.DataArray] = []
    for number, moment in enumerate(moments):
        groups = group_names(moment.scene)
        weights = dict(still.attrs["weights"])
        if any(group not in weights for group in groups):  # a lamp that comes into view
            weights = ledger.collected(lambda s=moment.scene: lighting(s)).result.attrs["weights"]
            weights = weights | still.attrs["weights"]
        weights = {group: weights[group] for group in groups}
        varying = {group: m for group, m in modulation.items() if group in groups}
        light = ledger.collected(lambda s=moment.scene, w=weights, v=varying: mix(s, w, v)).result
        for lamp, plane in components(light):
            for timed in within(moment.sub_frame.window, shot_s, lamp):
                names.append(f"sub-frame {number}")
                modulations.append(timed.modulation)
                planes.append((plane * np.float32(timed.factor)).assign_attrs(still.attrs))
    return stacked(names, modulations, planes)


def _with_noise(still: xr.Dataset, moments: list[_Moment], shot_s: float) -> xr.Dataset:
    """Return the scene at the start of a shot, with the noise of the mean over all sub-frames.

    The noise of the sub-frames is independent. If one of them states no noise, none is returned.
    """
    stated = [name for name in (NOISE, HALF_DIFFERENCE) if name in still]
    unknown = [name for name in stated if any(name not in m.scene for m in moments)]
    out = still.drop_vars(unknown)
    for name in set(stated) - set(unknown):
        total = np.zeros(still[name].shape)
        for moment in moments:
            share = (moment.sub_frame.window.end_s - moment.sub_frame.window.start_s) / shot_s
            groups = group_names(moment.scene)
            for k, group in enumerate(group_names(still)):
                if group in groups:
                    part = moment.scene[name].isel(light_group=groups.index(group)).values
                    part = share * part.astype(float)
                    total[k] += part**2 if name == NOISE else part
        values = np.sqrt(total) if name == NOISE else total
        out[name] = still[name].copy(data=values.astype(still[name].dtype))
    return out


def _state_still(why: str, motion_px: float) -> None:
    ledger.error(0.0, "px", "bound", "motion between sub-frames: there is only one sub-frame")
    ledger.left_out("sub-frames of the shot", why, motion_px, "px", needless=motion_px == 0)


def _state(motion_px: float, count: int, time: ShotTime) -> None:
    """State what sampling the motion leaves out."""
    step_px = motion_px / (count - 1)
    ledger.error(
        step_px,
        "px",
        "measured",
        f"largest motion from one of {count} sub-frames to the next; {motion_px:.3g} px in a shot"
        f" of {1e3 * time.seconds:.3g} ms",
        key="step",
    )
    ledger.left_out(
        "lamps that are switched, and labels, between sub-frames",
        "labels and reference picture are those of the start of the shot",
        motion_px,
        "px",
    )
