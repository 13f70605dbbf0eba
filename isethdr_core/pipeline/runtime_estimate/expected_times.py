"""Expected times: the expected seconds of every stage of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ...identity.earlier_names import same_class
from ...plugins.protocols import EstimatesImaging
from ..imaging_plan import plans_imaging
from .records import OTHER_SETTINGS, NearestRecords, newest
from .rendering import estimated_ratio, ratio_by_samples, rendering_s
from .stages import MOTION, OF_CAMERA, RENDERING, kind_of, stages
from .work import PARTS, PIXELS, has_equal_settings, pixel_bytes, sub_frames, work_ratio

if TYPE_CHECKING:
    from ...motion.run_time import SubFrameWork
    from ..chain import Chain
    from ..demand import Demand
    from ..memory import Frame

IMAGING = "imaging_s"  # attribute of a run: the time that its lens estimated


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
    now = {"config": config, PIXELS: pixel_bytes(chain), PARTS: moving and moving.count}
    runs = newest("runs")
    nearest = NearestRecords()
    _consider_runs(nearest, chain, now, runs)
    if missing is not None:
        _consider_scenes(nearest, chain, config, missing, frame)
    imaging = imaging_s(chain, frame)
    if imaging is not None:
        stage = f"lens {config['lens']['name']}"
        seconds = imaging * _correction(runs, stage, imaging) * sub_frames(now)
        nearest.replace(stage, seconds)
    if moving is not None:
        seconds = _sub_frames_s(moving, config, frame, nearest)
        if seconds is not None:
            nearest.replace(MOTION, seconds)
    expected = {stage: nearest.seconds(stage) for stage in stages(chain, config, missing)}
    return {stage: seconds for stage, seconds in expected.items() if seconds is not None}


def elapsed_s(expected: Mapping[str, float | None], threads: int) -> float:
    """Return the seconds from start to end, while the stages of the cameras share some threads.

    Parameters
    ----------
    expected : {stage: seconds}; a stage with None, which is not known, is left out of the sum.
    threads : number of threads that compute the cameras; all other stages run one after the other.
    """
    known = {stage: seconds for stage, seconds in expected.items() if seconds is not None}
    cameras_s = sum(s for stage, s in known.items() if kind_of(stage) in OF_CAMERA)
    return sum(known.values()) - cameras_s * (1 - 1 / threads)


def imaging_s(chain: Chain, frame: Frame | None) -> float | None:
    """Return the seconds that the lens expects to need for a frame; None if it has no estimate."""
    if frame is None or not (
        plans_imaging(chain.lens) and isinstance(chain.lens, EstimatesImaging)
    ):
        return None
    return chain.lens.expected_s(frame, tuple(chain.flares.values()))


def _consider_runs(
    nearest: NearestRecords, chain: Chain, now: dict[str, Any], runs: Iterable[dict[str, Any]]
) -> None:
    """Consider the ledgers of stored runs, except for the stages of the rendering."""
    config = now["config"]
    for attributes in runs:
        if attributes["config"].get("leave_out", True) != chain.leave_out:
            continue
        for row in attributes["ledger"]:
            stage = row["stage"]
            kind = kind_of(stage)
            if kind in RENDERING and not (kind == "scene" and chain.renderer is None):
                continue
            ratio = work_ratio(now, attributes, stage)
            if ratio is not None:
                same = has_equal_settings(config, attributes["config"], stage)
                nearest.consider(row, ratio, 1.0 if same else OTHER_SETTINGS)


def _consider_scenes(
    nearest: NearestRecords, chain: Chain, config: dict, missing: Demand, frame: Frame | None
) -> None:
    """Consider the ledgers of stored scenes; if no rendering is similar, the renderer's own
    estimate counts.
    """
    settings = config["renderer"]
    for attributes in newest("scenes"):
        if not {"scene", "ledger"} <= attributes.keys():  # stored by a program of a user
            continue
        same = same_class(attributes["scene"], chain.scene)
        for row in attributes["ledger"]:
            kind = kind_of(row["stage"])
            if kind == "scene" and same:
                nearest.consider(row, 1.0)
            elif kind == "renderer":
                ratio = estimated_ratio(chain, settings, missing, frame, attributes)
                if ratio is not None:
                    nearest.consider(row, ratio, 1.0 if same else OTHER_SETTINGS)
                elif same:
                    ratio = ratio_by_samples(chain.renderer, settings, missing, attributes)
                    if ratio is not None:
                        nearest.consider(row, ratio)
    stage = f"renderer {settings['name']}"
    if frame is not None and nearest.seconds(stage) is None:
        seconds = rendering_s(chain, frame, missing)
        if seconds is not None:
            nearest.replace(stage, seconds)


def _sub_frames_s(
    moving: SubFrameWork, config: dict, frame: Frame | None, nearest: NearestRecords
) -> float | None:
    """Return the seconds that the sub-frames after the start of a shot take to make; None where
    they are not known.
    """
    if moving.count is None:
        return None
    if config.get("renderer") is None:  # a scene that knows its own radiance
        seconds = nearest.seconds(f"scene {config['scene']['name']}")
        return None if seconds is None else seconds * (moving.count - 1)
    if not moving.to_render:
        return 0.0
    first, missing = moving.to_render[0]  # all are alike
    each = expected_s(first, config, missing, frame)
    names = [f"{kind} {config[kind]['name']}" for kind in RENDERING]
    if any(name not in each for name in names):
        return None
    return len(moving.to_render) * sum(each[name] for name in names)


def _correction(runs: Iterable[dict[str, Any]], stage: str, expected: float) -> float:
    """Return the ratio of measured to estimated time in the stored run with the most similar
    estimate; 1 without a stored run.
    """
    nearest = NearestRecords()
    for attributes in runs:
        stored_estimate = attributes.get(IMAGING)
        for row in attributes["ledger"]:
            if stored_estimate and row["stage"] == stage and not row.get("reused"):
                nearest.consider(row, expected / stored_estimate / sub_frames(attributes))
    seconds = nearest.seconds(stage)
    return 1.0 if seconds is None else seconds / expected
