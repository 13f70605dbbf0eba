"""Run time estimate: the time of each stage, from the ledgers of stored runs.

The estimate is the time of the same stage in the stored run of the most similar size, times the
ratio of the sizes. A stage without a stored run gets no estimate. A lens may estimate its own time
(`EstimatesImaging`): this estimate is corrected by the ratio of measured to estimated time in
stored runs. A renderer may estimate a scene without a stored rendering (`EstimatesRendering`).
"""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import CatalogError
from ..identity.earlier_names import same_class
from ..plugins.protocols import (
    EstimatesImaging,
    EstimatesRendering,
    EstimatesSamples,
    MeetsNoiseLimit,
)
from ..storage import store
from .imaging_plan import plans_imaging
from .memory import Frame

NEWEST = 32  # number of stored runs, and of stored scenes, that are read: each takes a millisecond
RENDERING = ("scene", "renderer", "store")  # stages that a run lacks where its radiance is stored
IMAGING = "imaging_s"  # attribute of a run: the time that its lens estimated
IN_BANDS = ("renderer", "lighting", "lens")  # stages whose work grows with the number of bands


def expected_s(chain, config: dict, missing, frame: Frame | None = None) -> dict[str, float]:
    """Return {stage: seconds} for the stages with a stored run or an estimate of the lens.

    Parameters
    ----------
    chain : the chain.
    config : plain data from which the chain was built.
    missing : the demand for radiance that has to be rendered; None if all is stored, or known
        without a renderer.
    frame : frame of the light in the run; None if it is not known.
    """
    nearest: dict[str, tuple[float, float]] = {}  # stage: (distance in size, seconds)
    runs = _newest("runs")
    for attributes in runs:
        if attributes["config"].get("leave_out", True) == chain.leave_out:
            for row in attributes["ledger"]:
                kind = row["stage"].split()[0]
                if kind not in RENDERING or (kind == "scene" and chain.renderer is None):
                    _nearer(nearest, row, size(config, kind) / size(attributes["config"], kind))
    for attributes in _newest("scenes") if missing is not None else ():
        if same_class(attributes["scene"], chain.scene):
            for row in attributes["ledger"]:
                kind = row["stage"].split()[0]
                if kind in RENDERING:
                    _nearer(
                        nearest,
                        row,
                        _rendering(chain.renderer, config["renderer"], missing, attributes)
                        if kind == "renderer"
                        else 1.0,
                    )
    rendering = f"renderer {config['renderer']['name']}" if missing is not None else ""
    if missing is not None and frame is not None and rendering not in nearest:
        seconds = rendering_s(chain, frame, missing)
        if seconds is not None:
            nearest[rendering] = math.inf, seconds
    imaging = imaging_s(chain, frame)
    if imaging is not None:
        stage = f"lens {config['lens']['name']}"
        nearest[stage] = 0.0, imaging * _correction(runs, stage, imaging)
    return {
        stage: seconds
        for stage, (_, seconds) in nearest.items()
        if stage in stages(chain, config, missing)
    }


def imaging_s(chain, frame: Frame | None) -> float | None:
    """Return the seconds that the lens expects to need for a frame; None if it has no estimate."""
    if frame is None or not (
        plans_imaging(chain.lens) and isinstance(chain.lens, EstimatesImaging)
    ):
        return None
    return chain.lens.expected_s(frame, tuple(chain.flares.values()))


def rendering_s(chain, frame: Frame, missing) -> float | None:
    """Return the seconds that the renderer expects to need for a frame; None if it has no estimate.

    Parameters
    ----------
    missing : the demand for what has to be rendered.
    """
    if not isinstance(chain.renderer, EstimatesRendering):
        return None
    return chain.renderer.rendering_s(frame, missing.groups and len(missing.groups))


def _correction(runs, stage: str, expected: float) -> float:
    """Return the ratio of measured to estimated time in the stored run with the most similar
    estimate; 1 without a stored run.
    """
    nearest: dict[str, tuple[float, float]] = {}
    for attributes in runs:
        stored_estimate = attributes.get(IMAGING)
        for row in attributes["ledger"]:
            if stored_estimate and row["stage"] == stage and not row.get("reused"):
                _nearer(
                    nearest,
                    {**row, "seconds": row["seconds"] / expected},
                    expected / stored_estimate,
                )
    return nearest.get(stage, (0.0, 1.0))[1]


def stages(chain, config: dict, missing) -> list[str]:
    """Return the names of the stages that a run will have, in their order."""
    rendered = (
        [f"scene {config['scene']['name']}"]
        if missing is not None or chain.renderer is None
        else []
    )
    rendered += [f"renderer {config['renderer']['name']}"] if missing is not None else []
    light = ["lighting " + name for name in (config["lighting"]["name"], *chain.versions)] + [
        f"lens {config['lens']['name']}"
    ]
    cameras = [
        [f"sensor {c}", f"isp {c}", f"truth {c}", *(f"metric {m} {c}" for m in chain.metrics)]
        + [f"draws {c}"] * bool(chain.draws > 1 and chain.metrics)
        + [f"picture {c}"]
        for c in chain.cameras
    ]
    return ["plan", *rendered, *light, *(stage for camera in cameras for stage in camera)]


def size(config: dict, kind: str) -> float:
    """Return the quantity that the work of a stage is proportional to: tiles, or tiles
    times bands.
    """
    source = config.get("renderer") or config["scene"]
    return _tiles(source) * (_bands(source) if kind in IN_BANDS else 1)


def _tiles(source) -> float:
    sides = source.get("width"), source.get("height")
    return math.prod(sides) if all(map(_positive, sides)) else 1.0


def _bands(source) -> float:
    """Return the number of bands; 1 if the fields of a plugin's component do not give it."""
    first, last, step = (source.get(key) for key in ("first_nm", "last_nm", "step_nm"))
    valid = all(map(_positive, (first, last, step))) and last >= first
    return 1 + (last - first) / step if valid else 1.0


def _positive(value: Any) -> bool:
    return isinstance(value, (int, float)) and 0 < value < math.inf


def _rendering(renderer, settings: dict, missing, attributes) -> float:
    """Return the work of rendering the `missing` radiance, relative to that of a stored scene:
    tiles x bands x paths of all light groups.
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
    typical = sum(expected_paths.values()) / len(expected_paths)  # of a group that this store lacks
    return (
        sum(expected_paths.get(g, typical) for g in groups)
        / sum(stored_paths.values())
        * bands
        * _tiles(settings)
        / _tiles(attributes["renderer"])
    )


def _finer(renderer, stored_share: float | None) -> float:
    """Return the ratio of samples that a smaller share of the cameras' noise takes, relative to
    `stored_share`; 1 if either rendering goes by something else.
    """
    share = renderer.limit_share() if isinstance(renderer, MeetsNoiseLimit) else None
    return (stored_share / share) ** 2 if stored_share and share else 1.0


def _expected_paths(renderer, paths: float, noise: float | None) -> float:
    """Return the number of samples per tile that a light group is expected to take.

    A renderer without an estimate is expected to take as many as its stored rendering.
    """
    if isinstance(renderer, EstimatesSamples):
        return renderer.expected_paths(paths, noise)
    return paths


def _nearer(nearest, row, ratio: float) -> None:
    distance = abs(math.log(ratio))
    if row["stage"] not in nearest or distance < nearest[row["stage"]][0]:
        nearest[row["stage"]] = distance, ratio * row["seconds"]


def _newest(kind: str) -> list[dict]:
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
