"""From config: the chain that a composed config describes.

Wrong names, keys and values are refused here. `checks` then refuses combinations that cannot work.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omegaconf import DictConfig, OmegaConf

from ...config.composition import resolved
from ...errors import ConfigError
from ...motion.settings import motion_settings
from ...plugins.registry import build_from_config
from ...runs.names import check_names
from ...runs.seeds import checked_seed
from ...sequence.exposure import exposures_of
from ...uncertainty import budget, spending
from .checks import check_combination
from .components import SHOWN, Chain
from .demand_of_run import relative_allowed

# by kind: the key of its table of components in a config, and the word for one entry
CONFIG_KEY = {"sensor": "cameras", "lighting": "versions", "flare": "flare", "metric": "metric"}
ENTRY = {"sensor": "camera", "lighting": "version", "flare": "flare", "metric": "metric"}


def chain(config: DictConfig, rendered: bool = False) -> Chain:
    """Build all components of a composed config.

    Parameters
    ----------
    config : composed config.
    rendered : whether the radiance of the scene is stored already. Lightings are then checked
        against the groups of that radiance when they mix it. To know the groups earlier, a street
        would have to be laid out, which takes seconds.

    Raises
    ------
    ConfigError : a name, key or value is wrong; nothing has been computed yet.
    """
    config = checked_config(config)
    cameras = cameras_of(config)
    checked_seed(config.get("seed", 0))
    draws = draws_of(config)
    allowed = budget.allowed(config)
    leave_out = switch(config, "leave_out")
    versions = versions_of(config)
    reported = switch(config, "report") or not leave_out
    built = Chain(
        scene=build_from_config("scene", config.scene),
        renderer=renderer_of(config, allowed),
        lighting=build_from_config("lighting", config.lighting),
        versions=versions if reported else {},
        lens=build_from_config("lens", config.lens),
        flares=components_by_name("flare", config.get("flare")),
        cameras=cameras,
        isp=build_from_config("isp", config.isp),
        metrics=components_by_name("metric", config.get("metric")),
        draws=draws,
        leave_out=leave_out,
        reported=reported,
        unreported=() if reported else tuple(versions),
        allowed=allowed,
        motion=motion_settings(config),
        exposures=exposures_of(config, cameras),
    )
    check_combination(built, rendered)
    return spending.with_shares(built, lambda: relative_allowed(built))


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


def cameras_of(config: DictConfig) -> dict[str, Any]:
    """Return {camera: sensor}. A single `sensor` takes the place of the table of cameras."""
    if config.get("sensor"):
        check_names(ENTRY["sensor"], [config.sensor.name])
        return {config.sensor.name: build_from_config("sensor", config.sensor)}
    cameras = components_by_name("sensor", config.get("cameras"))
    if not cameras:
        raise ConfigError("the config has no camera; name a sensor, for example sensor=bayer")
    return cameras


def versions_of(config: DictConfig) -> dict[str, Any]:
    """Return {version: lighting} of the further lightings that a report shows."""
    versions = components_by_name("lighting", config.get("versions"))
    if SHOWN in versions:
        raise ConfigError(
            f"a lighting version is called {SHOWN!r}, which is the name of the run's own lighting;"
            " expected another name; type for example +lighting@versions.night=night"
        )
    return versions


def renderer_of(config: DictConfig, allowed: budget.Allowed) -> Any:
    """Return the renderer with the error allowed; None if the scene itself makes its radiance."""
    node = config.get("renderer")
    renderer = build_from_config("renderer", node) if node else None
    return budget.renderer_with_error(renderer, allowed)


def components_by_name(kind: str, node: DictConfig | None) -> dict[str, Any]:
    """Return the components of one kind by the names that the user chose; empty entries are left
    out.
    """
    if node is not None and not isinstance(node, Mapping):
        raise ConfigError(
            f"{CONFIG_KEY[kind]} is {node!r}; expected entries by name; "
            f"type for example +{kind}@{CONFIG_KEY[kind]}.mine=<name>"
        )
    check_names(ENTRY[kind], node or ())
    return {key: build_from_config(kind, value) for key, value in (node or {}).items() if value}


def draws_of(config: DictConfig) -> int:
    """Return the number of noise realisations over which scores are averaged; 1 if absent."""
    draws = config.get("draws", 1)
    if not (isinstance(draws, int) and not isinstance(draws, bool) and draws >= 1):
        raise ConfigError(
            f"draws is {draws!r}; expected a whole number of shots, at least 1; type for"
            " example draws=4"
        )
    return draws


def switch(config: DictConfig, name: str) -> bool:
    """Return a switch of the config; True if it is absent."""
    value = config.get(name, True)
    if not isinstance(value, bool):
        raise ConfigError(
            f"{name} is {value!r}; expected true or false; type for example {name}=false"
        )
    return value
