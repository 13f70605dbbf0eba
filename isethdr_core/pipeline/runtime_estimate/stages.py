"""Stages: the names of the stages that a run will have, and what their work grows with."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...plugins.protocols import MovesInTime

if TYPE_CHECKING:
    from ..chain import Chain
    from ..demand import Demand

RENDERING = ("scene", "renderer")  # stages that a run lacks where its radiance is stored
MOTION = "motion"  # name of the stage that makes sub-frames, and of its record in a run
# stages whose work grows with the number of bands
IN_BANDS = ("renderer", "store", "radiance", "lighting", "motion", "lens")
# stages whose work grows with the pixels of a camera, the last word of their title
OF_CAMERA = ("sensor", "isp", "truth", "metric", "draws", "scores", "picture")


def kind_of(stage: str) -> str:
    """Return the kind of a stage, the first word of its name."""
    return stage.split()[0]


def camera_of(stage: str) -> str:
    """Return the camera of a stage whose kind is in `OF_CAMERA`, the last word of its name."""
    return stage.rpartition(" ")[2]


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
