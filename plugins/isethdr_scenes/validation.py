"""Checks of the fields that scenes share."""

from __future__ import annotations

from isethdr_core.errors import ConfigError

VALUES = {"horizontal_field_deg": (10, 100), "aspect": (0.5, 4), "camera_height_m": (0.5, 4),
          "sky_luminance_cd_m2": (1e-6, 1e6), "luminaire_spacing_m": (4, 60)}  # least and most of single fields
WIDEST_DEG = 200  # of the horizontal field on a grid of angles


def check_ranges(scene, limits: dict[str, tuple[float, float]]) -> None:
    """Raise ConfigError unless every range field named in `limits` lies inside them, and the camera makes sense."""
    for name, (least, most) in limits.items():
        low, high = getattr(scene, name)
        if not least <= low <= high <= most:
            raise ConfigError(
                f"scene.{name} is [{low}, {high}]; expected [low, high] with {least} <= low <= high <= {most}; "
                f"type for example scene.{name}=[{least},{most}]"
            )
    for name, (least, most) in VALUES.items():
        if not hasattr(scene, name):
            continue
        value, usual = getattr(scene, name), getattr(type(scene), name)
        more = ""
        if name == "horizontal_field_deg" and scene.projection == "equidistant":
            most = WIDEST_DEG
        elif name == "horizontal_field_deg":
            more = f", or scene.projection=equidistant for up to {WIDEST_DEG} degrees"
        if not least <= value <= most:
            raise ConfigError(f"scene.{name} is {value}; expected {least} to {most}; type for example scene.{name}={usual:g}{more}")
