"""Rendering alone: radiance and labels of a configured scene, whole, stored for later runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from threadpoolctl import threadpool_limits

from ..errors import ConfigError
from ..pipeline.chain import chain, checked_config, plan
from ..storage import store
from ..uncertainty.ledger import Ledger
from .radiance_cache import held_and_missing, scene_radiance
from .run import check_writable

if TYPE_CHECKING:
    import xarray as xr
    from omegaconf import DictConfig


@dataclass(frozen=True)
class Rendered:
    """Stored radiance of one scene."""

    stores: tuple[Path, ...]
    computed: bool  # False: all of it was stored before

    @property
    def attributes(self) -> list[Mapping[str, Any]]:
        """The recorded properties of each store: objects, lamps, noise, ledger."""
        return [store.read_attrs(path) for path in self.stores]

    def open(self) -> xr.Dataset:
        """Return radiance and labels; parts are read when they are used."""
        return store.open_scene(self.stores[0])


def render(config: DictConfig, by_noise: bool = False) -> Rendered:
    """Render the scene of a composed config with all light groups, bands and labels, and store it.

    The cameras of the config state the noise that the renderer has to reach; nothing is imaged. A
    later run of the same scene reads the stored radiance.

    Parameters
    ----------
    config : composed config.
    by_noise : whether each tile is stored with only those mantissa bits that are significant above
        its noise (`storage.radiance_rounding`). This takes two thirds of the bytes.

    Raises
    ------
    ConfigError : the config has no renderer, or a wrong name, key or value.
    CatalogError : the store cannot be written, or a stored one is damaged.
    """
    config = checked_config(config)
    whole = replace(chain(config), leave_out=False)
    if whole.renderer is None:
        raise ConfigError(
            f"scene={config.scene.name} has no renderer, so there is nothing to render; expected a"
            " scene with geometry; type for example scene=night_drive renderer=mitsuba"
        )
    check_writable(store.home() / "scenes")
    rows = Ledger()
    demand = plan(whole, rows)
    missing = held_and_missing(whole, demand)[1]
    with threadpool_limits(1, "blas"):
        _, ids = scene_radiance(whole, demand, rows, config, by_noise)
    if not ids:
        raise ConfigError(
            f"scene={config.scene.name} states its own radiance, so there is nothing to render;"
            " expected a scene with geometry; type for example scene=night_drive"
        )
    paths = tuple(store.home() / "scenes" / f"{name}.zarr" for name in ids)
    return Rendered(paths, missing is not None)
