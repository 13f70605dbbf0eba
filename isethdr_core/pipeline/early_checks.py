"""Early checks: mistakes in a configuration that components can see in each other before any work.

Components may tell what they will make, or check what others will make, by the protocols here. What
says nothing is checked when it arrives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable


class ShotForm(NamedTuple):
    """What the captures of a sensor will be."""

    captures: tuple[str, ...]  # names, in their order
    filters: tuple[str, ...]  # rows of the filter array's repeated cell, one letter per pixel


@runtime_checkable
class ListsGroups(Protocol):
    """A scene that knows its light groups before it is made."""

    def light_groups(self) -> tuple[str, ...]:
        """Return the names of the light groups that the scene has."""


@runtime_checkable
class ChecksGroups(Protocol):
    """A lighting that names light groups."""

    def check_groups(self, groups: Sequence[str]) -> None:
        """Raise ConfigError where the lighting needs a group that is not among `groups`."""


@runtime_checkable
class ListsCaptures(Protocol):
    """A sensor that knows the form of its captures before it takes a shot."""

    def shot_form(self) -> ShotForm:
        """Return the names of the captures and the filter array."""


@runtime_checkable
class ChecksCaptures(Protocol):
    """Image signal processing that depends on the names of captures or on the filter array."""

    def check_shot(self, form: ShotForm) -> None:
        """Raise ConfigError where captures of this form cannot be processed."""


@runtime_checkable
class ChecksFiles(Protocol):
    """A scene that can check its files without reading their light."""

    def check_files(self) -> None:
        """Raise CatalogError or UnitError where a file of the scene cannot be right."""


def check_scene(scene: Any, lighting: Any, versions: Sequence[Any]) -> None:
    """Refuse files of a scene that are not right, and lightings that name a group it lacks.

    Parameters
    ----------
    lighting, versions : the lighting of the run, and those that only the report shows.

    Raises
    ------
    IsetHdrError : as the components raise it.
    """
    if isinstance(scene, ChecksFiles):
        scene.check_files()
    if isinstance(scene, ListsGroups):
        check_lightings(scene.light_groups(), lighting, versions)


def check_lightings(groups: Sequence[str], lighting: Any, versions: Sequence[Any]) -> None:
    """Raise ConfigError where a lighting names a light group that is not among `groups`.

    A scene of one group is shown under its own lighting alone; then `versions` are not checked.
    """
    for light in (lighting, *(versions if len(groups) > 1 else ())):
        if isinstance(light, ChecksGroups):
            light.check_groups(groups)


def check_shots(sensors: Sequence[Any], isp: Any) -> None:
    """Raise ConfigError where the image signal processing cannot take the captures of a sensor."""
    if isinstance(isp, ChecksCaptures):
        for sensor in sensors:
            if isinstance(sensor, ListsCaptures):
                isp.check_shot(sensor.shot_form())
