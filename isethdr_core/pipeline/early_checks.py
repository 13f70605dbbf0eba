"""Early checks: mistakes in the combination of components, found before any work.

Components may declare properties of their results in advance, or check those of others
(`protocols`). The results of other components are checked when they arrive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ConfigError, PluginError
from ..physics.optics.projection import PROJECTIONS
from ..plugins.protocols import (
    ChecksCaptures,
    ChecksFiles,
    ChecksGroups,
    CountsTiles,
    KnowsItsField,
    ListsCaptures,
    ListsGroups,
    RendersFog,
)

if TYPE_CHECKING:
    from ..data.scene_description import SceneDescription


class ShotForm(NamedTuple):
    """Properties of a sensor's captures, known in advance."""

    captures: tuple[str, ...]  # names, in their order
    filters: tuple[str, ...]  # rows of the filter array's repeated cell, one letter per pixel
    black_rows: int = 0  # optical black rows that leave the sensor


def check_statements(scene: Any, renderer: Any) -> None:
    """Raise PluginError if scene or renderer state their field or their tiles in another form than
    the later stages read.

    Parameters
    ----------
    scene : scene of the run.
    renderer : renderer of the run; None if the scene provides its own radiance.
    """
    if isinstance(scene, KnowsItsField):
        field = scene.camera_field()
        if not _is_field(field):
            raise PluginError(
                f"{type(scene).__name__}.camera_field() returned {field!r}; expected (width,"
                " height, projection): two numbers above 0 and one of"
                f" {', '.join(map(repr, PROJECTIONS))}"
            )
    source = scene if renderer is None else renderer
    if isinstance(source, CountsTiles):
        for margin in (False, True):
            counts = source.tile_counts(margin)
            if not _are_counts(counts):
                raise PluginError(
                    f"{type(source).__name__}.tile_counts(margin={margin}) returned {counts!r};"
                    " expected (rows, columns): two whole numbers of tiles, 1 or more"
                )


def _is_field(field: Any) -> bool:
    """Return whether a statement is (width, height, projection)."""
    if not isinstance(field, tuple | list) or len(field) != 3:
        return False
    return _are_positive(field[:2], 2) and field[2] in PROJECTIONS


def _are_positive(values: Any, count: int) -> bool:
    """Return whether `values` are `count` finite numbers above 0."""
    listed = list(values) if isinstance(values, tuple | list | np.ndarray) else []
    numbers = [value for value in listed if isinstance(value, Real) and 0 < float(value) < math.inf]
    return len(numbers) == len(listed) == count


def _are_counts(values: Any) -> bool:
    """Return whether `values` are two whole numbers from 1."""
    if not _are_positive(values, 2):
        return False
    return all(float(value).is_integer() and not isinstance(value, bool) for value in values)


def check_scene(scene: Any, lighting: Any, versions: Sequence[Any]) -> None:
    """Refuse a scene with damaged files, and lightings that name a missing light group.

    Parameters
    ----------
    scene : scene of the run.
    lighting, versions : the lighting of the run, and further lightings that only the report shows.

    Raises
    ------
    IsetHdrError : raised by the components.
    """
    if isinstance(scene, ChecksFiles):
        scene.check_files()
    if isinstance(scene, ListsGroups):
        check_lightings(scene.light_groups(), lighting, versions)


def check_lightings(groups: Sequence[str], lighting: Any, versions: Sequence[Any]) -> None:
    """Raise ConfigError if a lighting names a light group that the scene lacks.

    A scene with a single group is shown only under the lighting of the run, so further lightings
    are not checked.

    Parameters
    ----------
    groups : light groups of the scene.
    lighting : lighting of the run.
    versions : further lightings that only the report shows.
    """
    for light in (lighting, *(versions if len(groups) > 1 else ())):
        if isinstance(light, ChecksGroups):
            light.check_groups(groups)


def check_contents(description: SceneDescription, renderer: Any) -> None:
    """Raise ConfigError if the scene has fog and the renderer does not state that it renders it."""
    if description.fog is None:
        return
    if isinstance(renderer, RendersFog) and renderer.RENDERS_FOG:
        return
    raise ConfigError(
        f"scene {description.name!r} has fog (visibility {description.fog.visibility_m:g} m), which"
        f" the renderer {type(renderer).__name__} does not know; expected a renderer with"
        " RENDERS_FOG; type renderer=mitsuba, or scene.visibility_m=null for clear air"
    )


def check_shots(sensors: Sequence[Any], isp: Any) -> None:
    """Raise ConfigError where the image signal processing cannot take the captures of a sensor."""
    if isinstance(isp, ChecksCaptures):
        for sensor in sensors:
            if isinstance(sensor, ListsCaptures):
                isp.check_shot(sensor.shot_form())
