"""Lit scene: the stored radiance of a scene under one lighting, and its image by the lens.

Light on the sensor plane is kept in the cache of intermediate results, where the next study with
the same scenes and lens finds it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import xarray as xr

from isethdr_core.config.composition import compose
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import Chain, chain, imaging, plan, stage
from isethdr_core.pipeline.imaging_plan import Imaging, labelled
from isethdr_core.pipeline.shot import LightNames, Shot
from isethdr_core.runs.result_names import of_light, of_mixed, of_radiance
from isethdr_core.runs.reuse import Kept, Reuse, cache_bytes
from isethdr_core.runs.seeds import Generator
from isethdr_core.storage import store
from isethdr_core.uncertainty.ledger import Ledger

from ..dataset.recipe import node_of
from ..dataset.record import SceneRecord
from .threads import COMPOSING
from .without import without_people

OWN = ("report=false",)
# keys of the config that choose the radiance; motion during a shot has further radiance
OTHER_RADIANCE = ("scene", "renderer", "experiment", "motion")


@dataclass(frozen=True, eq=False)
class LitScene:
    """A stored scene under one lighting.

    Parameters
    ----------
    config : composed config.
    built : components of the config.
    rows : ledger of the stages.
    scene : scene radiance with its labels.
    mixed : mixed radiance under the lighting.
    imaging : how the lens makes the light on the sensor plane.
    reuse : cache of intermediate results.
    names : names of the radiance and of the light in this cache.
    """

    config: Any
    built: Chain
    rows: Ledger
    scene: xr.Dataset
    mixed: xr.DataArray
    imaging: Imaging
    reuse: Reuse
    names: LightNames

    @cached_property
    def light(self) -> xr.DataArray:
        """The light on the sensor plane, computed on first use unless an earlier study kept it."""
        lens = self.built.lens
        kept = Kept(self.reuse, self.names.light)
        return stage(self.rows, "lens", self.config.lens.name, lens, self.imaging.light, kept)

    def shot(self, key: Generator) -> Shot:
        """Return the shot with a key of its noise."""
        return Shot(self.light, self.mixed, self.scene, key, self.imaging, self.reuse, self.names)


def check_same_radiance(overrides: Sequence[str]) -> None:
    """Check that no override asks for other radiance than that of the dataset.

    Parameters
    ----------
    overrides : overrides of all scenes, as typed.

    Raises
    ------
    ConfigError : an override changes the scene, the renderer, the experiment, or the motion
        during a shot.
    """
    for text in overrides:
        if node_of(text) in OTHER_RADIANCE:
            raise ConfigError(
                f"{text} changes the radiance, but the scenes are those of the dataset; expected"
                " overrides of the lighting, lens, cameras or isp; type for example"
                " lens.f_number=4, or make another dataset with isethdr dataset generate"
            )


def built_for(record: SceneRecord, overrides: Sequence[str]) -> tuple[Any, Chain]:
    """Return the config of a stored scene, and its components.

    Parameters
    ----------
    record : record of the scene.
    overrides : overrides of all scenes, after those of the scene itself.

    Raises
    ------
    ConfigError : an override is wrong, or the scene moves during the shot: its radiance is stored
        for one moment.
    """
    with COMPOSING:
        config = compose([*record.overrides, *OWN, *overrides])
        built = chain(config, rendered=True)
    if built.motion is not None:
        raise ConfigError(
            f"scene {record.number + 1} moves during a shot, but its radiance is that of one"
            " moment; expected motion.within_exposure=false in the recipe of the dataset"
        )
    return config, built


def joined_stores(record: SceneRecord) -> list[str]:
    """Return the names of all stores whose radiance is joined when the scene is opened. They
    include those that runs have added since the dataset was made, for example with more samples.

    Parameters
    ----------
    record : record of the scene.
    """
    recipe = record.stores[0].partition("-")[0]
    names = {path.stem for path in (store.home() / "scenes").glob(f"{recipe}-*.zarr")}
    return sorted(names | set(record.stores))


def lit(record: SceneRecord, overrides: Sequence[str], bare: bool = False) -> LitScene:
    """Return a stored scene under the lighting of its config.

    Parameters
    ----------
    record : record of the scene; its radiance is stored.
    overrides : overrides of all scenes, after those of the scene itself.
    bare : whether the same view without people, riders and animals is used.

    Raises
    ------
    ConfigError : as `built_for`.
    CatalogError : there is no stored radiance.
    """
    config, built = built_for(record, overrides)
    rows = Ledger()
    demand = plan(built, rows).with_labels("instance")
    path = without_people(record) if bare else record.stores[0]
    scene = store.open_scene(path)
    mixed = built.lighting(scene)
    radiance = of_radiance(built.scene, [str(path)] if bare else joined_stores(record), demand)
    of_main = of_mixed(radiance, built.lighting)
    return LitScene(
        config=config,
        built=built,
        rows=rows,
        scene=scene,
        mixed=mixed,
        imaging=imaging(built, labelled(built.lens, mixed, scene), demand),
        reuse=Reuse.below(cache_bytes(config)),
        names=LightNames(radiance, of_main, of_light(of_main, built, demand, mixed)),
    )
