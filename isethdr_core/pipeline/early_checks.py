"""Early checks: mistakes in a configuration that components can see in each other before any work.

Components may tell what they will make, or check what others will make (`protocols`). Where a
component does not, its result is checked when it arrives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..plugins.protocols import (
    ChecksCaptures,
    ChecksFiles,
    ChecksGroups,
    ListsCaptures,
    ListsGroups,
)


class ShotForm(NamedTuple):
    """What the captures of a sensor will be."""

    captures: tuple[str, ...]  # names, in their order
    filters: tuple[str, ...]  # rows of the filter array's repeated cell, one letter per pixel
    black_rows: int = 0  # optical black rows that leave the sensor


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
