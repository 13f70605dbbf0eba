"""The scene `stored`: radiance from the home folder by its name, whatever its source.

A run finds stored radiance by its recipe as long as the code of the scene and of the renderer stays
the same. With another version of that code the recipe has another name, and the scene would be
rendered again. This scene names the store itself, so nothing is rendered.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from isethdr_core import ledger
from isethdr_core.errors import ConfigError
from isethdr_core.store import ROOT_FILE, home, open_scene
from isethdr_core.uncertainty.ledger import Ledger

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Stored:
    """Scene radiance of the home folder: a rendered scene of any version, or an imported one."""

    THREAD_SAFE: ClassVar[bool] = True

    store: str = ""  # name of the store, of its recipe, or the beginning of either

    def __call__(self) -> xr.Dataset:
        """Return radiance and labels; parts are read when they are used.

        The errors that the renderer stated are recorded in the ledger of this run.

        Raises
        ------
        ConfigError : no store is named.
        CatalogError : no store has this name, or several have it.
        """
        scene = self._opened()
        rows = Ledger.from_records(_attributes(scene).get("ledger", ()))
        for row in rows:
            if row.kind == "renderer":
                ledger.record(*row.errors)
        return scene

    def input_files(self) -> Iterator[Path]:
        """Return the root files of the stores, which describe how the radiance was made."""
        folder = home() / "scenes"
        recipe = str(_attributes(self._opened())["recipe"])
        return folder.glob(f"{recipe}-*.zarr/{ROOT_FILE}")

    def check_files(self) -> None:
        """Check that there is a store of this name.

        Raises
        ------
        ConfigError, CatalogError : as `__call__`.
        """
        self._opened()

    def light_groups(self) -> tuple[str, ...]:
        """Return the stored light groups."""
        return tuple(map(str, self._opened().light_group.values))

    def shot_name(self) -> str:
        """Return the name of the recipe: shots have the noise of the run that rendered it."""
        return str(_attributes(self._opened())["recipe"])

    def bands_nm(self) -> tuple[float, ...]:
        """Return the centres of the stored bands, nm."""
        return tuple(float(w) for w in self._opened().wavelength.values)

    def camera_field(self) -> tuple[float, float, str]:
        """Return (width, height, projection) of the camera's field."""
        attributes = _attributes(self._opened())
        return (
            float(attributes["field_width"]),
            float(attributes["field_height"]),
            str(attributes.get("projection", "tangent")),
        )

    def _opened(self) -> xr.Dataset:
        if not self.store:
            raise ConfigError(
                "no store is named; type for example scene.store=8f35a2693af19087; `isethdr catalog"
                " find kind=scene` lists them"
            )
        return open_scene(self.store)


def _attributes(scene: xr.Dataset) -> dict[Any, Any]:
    return scene.attrs
