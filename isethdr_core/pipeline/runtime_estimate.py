"""Run time estimate: the time of each stage, from the ledgers of stored runs.

The estimate is the time of the same stage in the most similar stored run, times the ratio of the
sizes. Up to the lens, the size is the number of tiles. From the sensor on, it is the memory of the
pixels. Two times do not grow with the size and are not multiplied: that of the plan, and that of
loading libraries in the first stage that needs them, which is most of the time of a tiny run. The
time of a stored stage is at most its CPU time: the rest was waiting for other programs. Records of
earlier versions hold no CPU time; they are used only for stages that have no other record. A stage
without a stored run gets no estimate.

A lens may estimate its own time (`EstimatesImaging`): this estimate is corrected by the ratio of
measured to estimated time in stored runs. A renderer may estimate its time, too
(`EstimatesRendering`): the estimate is corrected by the stored rendering of the most similar size,
of any scene. Sub-frames of a shot that moves are made and imaged one by one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import CatalogError
from ..identity.earlier_names import same_class
from ..plugins.protocols import (
    CountsPixels,
    EstimatesImaging,
    EstimatesRendering,
    EstimatesSamples,
    KnowsImageSize,
    KnowsItsField,
    MeetsNoiseLimit,
    MovesInTime,
)
from ..storage import store
from .imaging_plan import plans_imaging
from .memory import Frame

if TYPE_CHECKING:
    from ..motion.run_time import SubFrameWork
    from ..plugins.protocols import Renderer
    from .chain import Chain
    from .demand import Demand

NEWEST = 32  # number of stored runs, and of stored scenes, that are read: each takes a millisecond
RENDERING = ("scene", "renderer")  # stages that a run lacks where its radiance is stored
IMAGING = "imaging_s"  # attribute of a run: the time that its lens estimated
PIXELS = "pixel_bytes"  # attribute of a run: {camera: memory of its pixels}
PARTS = "sub_frames"  # key for the number of sub-frames of a run to come
MOTION = "motion"  # name of the stage that makes sub-frames, and of its record in a run
# stages whose work grows with the number of bands
IN_BANDS = ("renderer", "store", "radiance", "lighting", "motion", "lens")
# stages whose work grows with the pixels of a camera, the last word of their title
OF_CAMERA = ("sensor", "isp", "truth", "metric", "draws", "scores", "picture")
# settings on which the time of a stage depends most, besides those of its camera
SETTINGS = {
    "scene": ("scene",),
    "motion": ("renderer", "motion"),
    "lens": ("lens", "flare"),
    "isp": ("isp",),
    "metric": ("metric",),
    "draws": ("isp", "metric"),
    "scores": ("isp", "metric"),
}
# {stage: ((whether its record lacks CPU time, distance), seconds)}
Nearest = dict[str, tuple[tuple[bool, float], float]]
# a stored stage with other settings counts as less similar by as much as one of this many times
# the size
OTHER_SETTINGS = 4.0
# largest CPU time for loading one module: colour takes 1.6 s for 743 modules
LOADING_S = 3e-3
SIDES = ("height", "width")  # settings that state the number of tiles


def expected_s(
    chain: Chain,
    config: dict,
    missing: Demand | None,
    frame: Frame | None = None,
    moving: SubFrameWork | None = None,
) -> dict[str, float]:
    """Return {stage: seconds} for the stages with a stored run, or an estimate of the lens or
    renderer.

    Parameters
    ----------
    chain : components of the run.
    config : plain data from which the chain was built.
    missing : the demand for radiance that has to be rendered; None if all is stored, or known
        without a renderer.
    frame : frame of the light in the run; None if it is not known.
    moving : sub-frames of the shot; None if nothing moves.
    """
    nearest: Nearest = {}
    now = {"config": config, PIXELS: pixel_bytes(chain), PARTS: moving and moving.count}
    runs = newest("runs")
    for attributes in runs:
        if attributes["config"].get("leave_out", True) == chain.leave_out:
            for row in attributes["ledger"]:
                kind = row["stage"].split()[0]
                if kind not in RENDERING or (kind == "scene" and chain.renderer is None):
                    ratio = work_ratio(now, attributes, row["stage"])
                    if ratio is None:
                        continue
                    same = _settings(config, row["stage"]) == _settings(
                        attributes["config"], row["stage"]
                    )
                    _nearer(nearest, row, ratio, 1.0 if same else OTHER_SETTINGS)
    for attributes in newest("scenes") if missing is not None else ():
        same = same_class(attributes["scene"], chain.scene)
        for row in attributes["ledger"]:
            kind = row["stage"].split()[0]
            if kind == "scene" and same:
                _nearer(nearest, row, 1.0)
            elif kind == "renderer":
                settings = config["renderer"]
                ratio = _estimated_ratio(chain, settings, missing, frame, attributes)
                if ratio is not None:
                    _nearer(nearest, row, ratio, 1.0 if same else OTHER_SETTINGS)
                elif same:
                    ratio = _rendering(chain.renderer, settings, missing, attributes)
                    _nearer(nearest, row, ratio)
    rendering = f"renderer {config['renderer']['name']}" if missing is not None else ""
    if missing is not None and frame is not None and rendering not in nearest:
        seconds = rendering_s(chain, frame, missing)
        if seconds is not None:
            nearest[rendering] = (True, math.inf), seconds
    imaging = imaging_s(chain, frame)
    if imaging is not None:
        stage = f"lens {config['lens']['name']}"
        nearest[stage] = (False, 0.0), imaging * _correction(runs, stage, imaging) * _parts(now)
    if moving is not None:
        seconds = _sub_frames_s(moving, config, frame, nearest)
        if seconds is not None:
            nearest[MOTION] = (False, 0.0), seconds
    return {
        stage: seconds
        for stage, (_, seconds) in nearest.items()
        if stage in stages(chain, config, missing)
    }


def elapsed_s(expected: Mapping[str, float | None], threads: int) -> float:
    """Return the seconds from start to end, while the stages of the cameras share some threads.

    Parameters
    ----------
    expected : {stage: seconds}; a stage with None, which is not known, is left out of the sum.
    threads : number of threads that compute the cameras; all other stages run one after the other.
    """
    known = {stage: seconds for stage, seconds in expected.items() if seconds is not None}
    cameras_s = sum(s for stage, s in known.items() if stage.split()[0] in OF_CAMERA)
    return sum(known.values()) - cameras_s * (1 - 1 / threads)


def _sub_frames_s(
    moving: SubFrameWork, config: dict, frame: Frame | None, nearest: Mapping[str, Any]
) -> float | None:
    """Return the seconds that the sub-frames after the start of a shot take to make; None where
    they are not known.
    """
    if moving.count is None:
        return None
    if config.get("renderer") is None:  # a scene that knows its own radiance
        made = nearest.get(f"scene {config['scene']['name']}")
        return made and made[1] * (moving.count - 1)
    if not moving.to_render:
        return 0.0
    first, missing = moving.to_render[0]  # all are alike
    each = expected_s(first, config, missing, frame)
    names = [f"{kind} {config[kind]['name']}" for kind in RENDERING]
    if any(name not in each for name in names):
        return None
    return len(moving.to_render) * sum(each[name] for name in names)


def _parts(run: Mapping[str, Any]) -> int:
    """Return the number of sub-frames that a run has, or will have as far as is known."""
    if MOTION in run:
        return len(run[MOTION]["moments_s"])
    return run.get(PARTS) or 1


def pixel_bytes(chain: Chain) -> dict[str, float]:
    """Return {camera: memory of its pixels, bytes}, to which the time of its stages is
    proportional; cameras that do not state it are left out.
    """
    if not (isinstance(chain.scene, KnowsItsField) and isinstance(chain.lens, KnowsImageSize)):
        return {}
    size_m = chain.lens.image_size_m(*chain.scene.camera_field())
    return {
        name: sensor.pixel_need(*size_m).size_bytes
        for name, sensor in chain.cameras.items()
        if isinstance(sensor, CountsPixels)
    }


def imaging_s(chain: Chain, frame: Frame | None) -> float | None:
    """Return the seconds that the lens expects to need for a frame; None if it has no estimate."""
    if frame is None or not (
        plans_imaging(chain.lens) and isinstance(chain.lens, EstimatesImaging)
    ):
        return None
    return chain.lens.expected_s(frame, tuple(chain.flares.values()))


def rendering_s(chain: Chain, frame: Frame, missing: Demand) -> float | None:
    """Return the seconds that the renderer expects to need for a frame; None if it has no estimate.

    Parameters
    ----------
    chain : components of the run.
    frame : tiles and bands to render.
    missing : the demand for what has to be rendered.
    """
    if not isinstance(chain.renderer, EstimatesRendering):
        return None
    return chain.renderer.rendering_s(frame, missing.groups and len(missing.groups))


def _estimated_ratio(
    chain: Chain,
    settings: Mapping[str, Any],
    missing: Demand,
    frame: Frame | None,
    attributes: Mapping[str, Any],
) -> float | None:
    """Return the work of rendering a frame relative to that of a stored scene, by the renderer's
    own estimate, which includes work that does not grow with the tiles.

    None where the renderer has no estimate, or where the stored scene is not one whole rendering of
    the same kind.
    """
    renderer = chain.renderer
    sides = [source.get(k) for source in (settings, attributes["renderer"]) for k in SIDES]
    if frame is None or not isinstance(renderer, MeetsNoiseLimit) or not all(map(_positive, sides)):
        return None
    share = renderer.limit_share()
    if share is None or attributes.get("limit_share") != share:
        return None
    all_groups = attributes["all_groups"]
    partly = len(missing.groups or all_groups) < len(all_groups)
    continued = any(first for first, _ in attributes.get("path_span", {}).values())
    if partly or continued or attributes.get("groups_from"):
        return None
    height, width, stored_height, stored_width = sides
    before = replace(
        frame,
        rows=round(frame.rows * stored_height / height),
        columns=round(frame.columns * stored_width / width),
    )
    to_come, stored = (rendering_s(chain, f, missing) for f in (frame, before))
    return to_come / stored if to_come and stored else None


def _correction(runs: Iterable[dict[str, Any]], stage: str, expected: float) -> float:
    """Return the ratio of measured to estimated time in the stored run with the most similar
    estimate; 1 without a stored run.
    """
    nearest: Nearest = {}
    for attributes in runs:
        stored_estimate = attributes.get(IMAGING)
        for row in attributes["ledger"]:
            if stored_estimate and row["stage"] == stage and not row.get("reused"):
                _nearer(
                    nearest,
                    row,
                    expected / stored_estimate / _parts(attributes),
                )
    return nearest[stage][1] / expected if stage in nearest else 1.0


def stages(chain: Chain, config: dict, missing: Demand | None) -> list[str]:
    """Return the names of the stages that a run will have, in their order.

    Parameters
    ----------
    chain : components of the run.
    config : composed config of the run, as plain data.
    missing : demand for the radiance that has to be rendered; None if all is stored.
    """
    rendered = (
        [f"scene {config['scene']['name']}"]
        if missing is not None or chain.renderer is None
        else []
    )
    rendered += (
        [f"renderer {config['renderer']['name']}", "store scene"] if missing is not None else []
    )
    rendered += ["radiance"] * (chain.renderer is not None)
    light = ["lighting " + name for name in (config["lighting"]["name"], *chain.versions)]
    light += [MOTION] * (chain.motion is not None and isinstance(chain.scene, MovesInTime))
    light.append(f"lens {config['lens']['name']}")
    repeated = chain.draws > 1 and bool(chain.metrics)
    cameras = [
        [f"sensor {c}", f"isp {c}", f"truth {c}", *(f"metric {m} {c}" for m in chain.metrics)]
        + [f"draws {c}"] * repeated
        # the noise of a rendering changes scores; a chart has none
        + [f"scores {c}"] * (repeated and chain.renderer is not None)
        + [f"picture {c}"]
        for c in chain.cameras
    ]
    return ["plan", *rendered, *light, *(stage for camera in cameras for stage in camera)]


def work_ratio(now: dict, stored: dict, stage: str) -> float | None:
    """Return the work of a stage in a run to come, relative to that in a stored run.

    It is None if only one of the two states its number of tiles. A scene that is read from a
    picture has this number in its file, not in its settings.

    Parameters
    ----------
    now, stored : {"config": plain data, PIXELS: {camera: bytes}}; earlier versions stored no
        pixels.
    stage : name of the stage: its kind, and the name of the component or camera.
    """
    kind = stage.split()[0]
    camera = stage.rpartition(" ")[2]
    settings = now["config"], stored["config"]
    if kind == "plan":
        return 1.0
    of_one_only = _states_size(settings[0]) != _states_size(settings[1])
    if kind not in OF_CAMERA:
        if of_one_only:
            return None
        parts = _parts(now) / _parts(stored) if kind == "lens" else 1.0
        return parts * size(settings[0], kind) / size(settings[1], kind)
    both_bytes = [run.get(PIXELS, {}).get(camera) for run in (now, stored)]
    if all(map(_positive, both_bytes)):
        ratio = both_bytes[0] / both_bytes[1]
    elif of_one_only:
        return None
    else:
        ratio = size(settings[0], kind) / size(settings[1], kind)
    if kind == "draws":  # the first one is the picture itself
        more_draws = [max(config.get("draws", 2) - 1, 1) for config in settings]
        ratio *= more_draws[0] / more_draws[1]
    return ratio


def _settings(config: dict, stage: str) -> list[Any]:
    """Return the settings on which the time of a stage depends most."""
    kind = stage.split()[0]
    settings = [config.get(part) for part in SETTINGS.get(kind, ())]
    if kind in OF_CAMERA:
        cameras = config.get("cameras") or {}
        settings.append(cameras.get(stage.rpartition(" ")[2], config.get("sensor")))
    return settings


def size(config: dict, kind: str) -> float:
    """Return the quantity that the work of a stage up to the lens is proportional to: tiles, or
    tiles times bands.
    """
    source = config.get("renderer") or config["scene"]
    return _tiles(source) * (_bands(source) if kind in IN_BANDS else 1)


def _states_size(config: dict) -> bool:
    """Return whether the settings of a run hold the number of its tiles."""
    source = config.get("renderer") or config["scene"]
    return all(_positive(source.get(side)) for side in SIDES)


def _tiles(source: dict[str, int | str]) -> float:
    sides = source.get("width"), source.get("height")
    return math.prod(sides) if all(map(_positive, sides)) else 1.0


def _bands(source: dict[str, int | str]) -> float:
    """Return the number of bands; 1 if the fields of a plugin's component do not give it."""
    first, last, step = (source.get(key) for key in ("first_nm", "last_nm", "step_nm"))
    valid = all(map(_positive, (first, last, step))) and last >= first
    return 1 + (last - first) / step if valid else 1.0


def _positive(value: Any) -> bool:
    return isinstance(value, (int, float)) and 0 < value < math.inf


def _rendering(
    renderer: Renderer | None, settings: dict, missing: Demand, attributes: dict[str, float | str]
) -> float:
    """Return the work of rendering the `missing` radiance, relative to that of a stored scene:
    tiles x bands x samples of all light groups.
    """
    bands = (len(missing.wavelength_nm or ()) or _bands(settings)) / len(
        attributes["wavelength_nm"]
    )
    groups = missing.groups or attributes["all_groups"]
    stored_paths = {
        group: end - first for group, (first, end) in attributes.get("path_span", {}).items()
    } or dict.fromkeys(attributes["groups"], 1)
    finer = _finer(renderer, attributes.get("limit_share"))
    expected_paths = {
        group: _expected_paths(renderer, paths * finer, attributes.get("noise", {}).get(group))
        for group, paths in stored_paths.items()
    }
    typical = sum(expected_paths.values()) / len(expected_paths)  # for groups that the store lacks
    taken_over = attributes.get("groups_from", {})  # groups that another rendering took time for
    return (
        sum(expected_paths.get(g, typical) for g in groups)
        / sum(paths for group, paths in stored_paths.items() if group not in taken_over)
        * bands
        * _tiles(settings)
        / _tiles(attributes["renderer"])
    )


def _finer(renderer: Renderer | None, stored_share: float | None) -> float:
    """Return the ratio of the samples that the renderer's share of the cameras' noise needs, to
    those that `stored_share` needed; 1 if either rendering stops by another criterion.
    """
    share = renderer.limit_share() if isinstance(renderer, MeetsNoiseLimit) else None
    return (stored_share / share) ** 2 if stored_share and share else 1.0


def _expected_paths(renderer: Renderer | None, paths: float, noise: float | None) -> float:
    """Return the number of samples per tile that a light group is expected to take.

    A renderer without an estimate is expected to take as many as its stored rendering.
    """
    if isinstance(renderer, EstimatesSamples):
        return renderer.expected_paths(paths, noise)
    return paths


def _nearer(
    nearest: Nearest, row: dict[str, float | str], ratio: float, unlike: float = 1.0
) -> None:
    """Take the estimate from a ledger row if this row is more similar than the rows before. A row
    with CPU time is preferred to any row without it, which may have waited most of its time.

    Parameters
    ----------
    nearest : changed in place.
    row : row of a stored ledger, as plain data.
    ratio : work relative to that of the row.
    unlike : factor above 1 if settings differ; its logarithm adds to the distance.
    """
    unlikeness = row.get("cpu_s") is None, abs(math.log(ratio)) + math.log(unlike)
    if row["stage"] not in nearest or unlikeness < nearest[row["stage"]][0]:
        loading_s = min(_busy_s(row), LOADING_S * row.get("modules", 0))
        nearest[row["stage"]] = unlikeness, loading_s + ratio * (_busy_s(row) - loading_s)


def _busy_s(row: dict[str, float | str]) -> float:
    """Return the seconds of a stage without its waiting for other programs."""
    cpu_s = row.get("cpu_s")  # earlier versions stored none
    return row["seconds"] if cpu_s is None else min(row["seconds"], cpu_s)


def newest(kind: str) -> list[dict]:
    """Return the root attributes of the newest complete stores of a folder."""
    attributes = []
    for path in sorted((store.home() / kind).glob("*.zarr"), key=_age)[:NEWEST]:
        with suppress(CatalogError):
            attributes.append(store.read_attrs(path))
    return attributes


def _age(path: Path) -> float:
    try:
        return -path.stat().st_mtime
    except OSError:  # another process has just taken it away
        return math.inf
