"""Scenes: their call, and what a scene may state before it makes any light."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    import xarray as xr

    from ...data.scene_description import SceneDescription


@runtime_checkable
class Scene(Protocol):
    """The scene in front of the camera: geometry, materials and lamps, or the light itself."""

    def __call__(self) -> SceneDescription | xr.Dataset:
        """Return the description for a renderer, or scene radiance if it is known without one.

        Returns
        -------
        `isethdr_core.scene.SceneDescription`, or a Dataset with the variable `radiance
        (light_group, wavelength, y, x)` in W m-2 sr-1 nm-1.
        """


@runtime_checkable
class KnowsItsBands(Protocol):
    """A scene or renderer that knows its bands before it makes any light."""

    def bands_nm(self) -> Iterable[float]:
        """Return the centres of all bands that it would make, nm, ascending."""


@runtime_checkable
class CountsTiles(Protocol):
    """A scene or renderer that knows the size of its frame."""

    def tile_counts(self, margin: bool) -> tuple[int, int]:
        """Return (rows, columns) of tiles, with those beyond the camera's field if `margin`."""
        ...


@runtime_checkable
class KnowsItsField(Protocol):
    """A scene that states the field of view of its camera."""

    def camera_field(self) -> tuple[float, float, str]:
        """Return (width, height, projection) of the field: tangents, or radians if equidistant."""
        ...


@runtime_checkable
class ListsGroups(Protocol):
    """A scene that knows its light groups before its radiance is computed."""

    def light_groups(self) -> tuple[str, ...]:
        """Return the names of the light groups of the scene.

        A lighting that names another group is an error.
        """
        ...


@runtime_checkable
class ChecksFiles(Protocol):
    """A scene that can check its files without reading their light."""

    def check_files(self) -> None:
        """Raise CatalogError or UnitError where a file of the scene cannot be right."""


@runtime_checkable
class NamesItsShot(Protocol):
    """A scene that provides radiance of its own, and tells different radiance apart."""

    def shot_name(self) -> str:
        """Return a name of the radiance, the key of the noise of its shots.

        Without it, all radiance of the scene has the same noise at the same seed.
        """
        ...


@runtime_checkable
class MovesInTime(Protocol):
    """A scene with objects that may move. Fields of the dataclass state the time of the view.

    The core makes the scene of another moment with `dataclasses.replace`.
    """

    @property
    def time_s(self) -> float:
        """Time for which everything has moved, s."""
        ...

    @property
    def frames_per_s(self) -> float | None:
        """Frames per second; the scene then states `SceneDescription.next_frame`, or its radiance
        has the label `motion`. None: it states neither.
        """
        ...


ABILITIES: tuple[type, ...] = (
    KnowsItsBands,
    CountsTiles,
    KnowsItsField,
    ListsGroups,
    ChecksFiles,
    NamesItsShot,
    MovesInTime,
)
