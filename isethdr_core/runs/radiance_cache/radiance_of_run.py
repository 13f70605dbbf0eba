"""Radiance of a run: scene radiance that is stored, rendered, or made by the scene itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...data.scene_description import SceneDescription
from ...errors import ConfigError
from ...pipeline.bands import of_demand
from ...pipeline.chain import Chain, stage
from ...pipeline.demand import Demand
from ...pipeline.early_checks import check_contents, check_lightings
from ...uncertainty.ledger import Ledger, error
from .joined_radiance import opened
from .missing_radiance import completed
from .recipe import scenes_folder
from .stored_radiance import held_and_missing

if TYPE_CHECKING:
    import xarray as xr
    from omegaconf import DictConfig

    from ...plugins.protocols import Scene


def scene_radiance(
    chain: Chain, demand: Demand, rows: Ledger, config: DictConfig, by_noise: bool = False
) -> tuple[xr.Dataset, list[str]]:
    """Return (scene radiance, store ids). Stored radiance is read; missing radiance is rendered and
    stored.

    A scene that provides its own radiance (a chart, a file) needs no renderer and is not stored.

    Parameters
    ----------
    chain : components of the run.
    demand : light groups, bands and labels that the run needs.
    rows : ledger that gets the rows of the stages.
    config : composed config of the run.
    by_noise : whether radiance is stored with only those bits that are significant above its noise.
    """
    if chain.renderer is None:
        scene = made_by_scene(chain, rows, config)
        if isinstance(scene, SceneDescription):
            raise ConfigError(
                f"scene {scene.name!r} is geometry and needs a renderer; type for example"
                " renderer=mitsuba"
            )
        return of_demand(scene, demand), []
    serving, missing = held_and_missing(chain, demand)
    earlier_ids = [attributes["id"] for attributes in serving]
    if missing is not None:
        description = made_by_scene(chain, rows, config)
        if not isinstance(description, SceneDescription):
            return description, []
        check_contents(description, chain.renderer)
        # before the rendering, which takes longest
        check_lightings(description.light_groups(), chain.lighting, tuple(chain.versions.values()))
        serving, earlier_ids = completed(chain, demand, description, rows, config, by_noise)
    radiance = stage(
        rows,
        "radiance",
        "",
        None,
        lambda: opened(scenes_folder(), serving, demand, rows, earlier_ids),
    )
    return radiance, [attributes["id"] for attributes in serving]


def made_by_scene(chain: Chain, rows: Ledger, config: DictConfig) -> Any:
    """Return the description or the radiance that the scene makes, a stage of the run.

    Parameters
    ----------
    chain : components of the run.
    rows : ledger that gets the row of the stage.
    config : composed config of the run.
    """
    return stage(
        rows, "scene", config.scene.name, chain.scene, lambda: described_scene(chain.scene)
    )


def described_scene(scene: Scene) -> SceneDescription | xr.Dataset:
    """Return the result of a scene plugin. A scene description defines the scene, so its error is
    0.
    """
    result = scene()
    if isinstance(result, SceneDescription):
        error(0.0, "m", "bound", "geometry, materials and lamps are exact by definition")
    return result
