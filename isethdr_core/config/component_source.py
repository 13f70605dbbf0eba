"""The source from which Hydra reads the config group entry of each component. An entry is made when
it is chosen.
"""

from __future__ import annotations

from functools import cache

from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigResult, ConfigSource
from omegaconf import OmegaConf

from ..plugins import registry
from ..plugins.component import KINDS
from .composition import schema
from .packed import Packed

SCHEME = "isethdr-components"


class ComponentSource(ConfigSource):
    """Offers `<kind>/<name>` for each registered component, and imports none that is not chosen."""

    @staticmethod
    def scheme() -> str:
        """Return the beginning of this source's search path."""
        return SCHEME

    def available(self) -> bool:
        """Return True: the registry is always there."""
        return True

    def load_config(self, config_path: str) -> ConfigResult:
        """Return the typed fields of one component, with their defaults."""
        return ConfigResult(
            config=_packed(*_parted(config_path)).copy(),
            path=f"{SCHEME}://",
            provider="isethdr",
            header={"package": None},
        )

    def is_group(self, config_path: str) -> bool:
        """Return whether a path is a kind."""
        return config_path.strip("/") in ("", *KINDS)

    def is_config(self, config_path: str) -> bool:
        """Return whether a path names a component."""
        return _parted(config_path) in registry.components()

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """Return the names of a kind's components, sorted."""
        if results_filter == ObjectType.GROUP:
            return [] if config_path.strip("/") else sorted(KINDS)
        return sorted(
            name for kind, name in registry.components() if kind == config_path.strip("/")
        )


def _parted(config_path: str) -> tuple[str, str]:
    """Return kind and name of a path such as `lens/wavefront.yaml`."""
    kind, _, name = config_path.strip("/").removesuffix(".yaml").rpartition("/")
    return kind, name


@cache
def _packed(kind: str, name: str) -> Packed:
    return Packed(OmegaConf.structured(schema(registry.components()[kind, name])))
