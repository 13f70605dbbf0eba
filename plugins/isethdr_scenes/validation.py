"""Checks of the fields that scenes share."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from isethdr_core.errors import ConfigError

WIDEST_DEG = {"tangent": 100, "equidistant": 200}  # largest field of a road scene by projection


def check_order(scene: Any) -> None:
    """Raise ConfigError if a range [least, most] of a road scene is not in order, or its field of
    view is too wide for its projection.

    All numbers must be within the ranges that the fields declare.
    """
    for f in fields(scene):
        value = getattr(scene, f.name)
        numbers = isinstance(value, tuple) and all(isinstance(v, int | float) for v in value)
        if numbers and value and value[0] > value[1]:
            raise ConfigError(
                f"scene.{f.name} is {list(value)}; expected the lesser number first; "
                f"type for example scene.{f.name}=[{value[1]},{value[0]}]"
            )
    widest = WIDEST_DEG[scene.projection]
    if scene.horizontal_field_deg > widest:
        more = ", or scene.projection=equidistant for up to 200 degrees"
        raise ConfigError(
            f"scene.horizontal_field_deg is {scene.horizontal_field_deg:g}; expected 10 to"
            f" {widest}; type for example"
            f" scene.horizontal_field_deg=45{more if widest == 100 else ''}"
        )
