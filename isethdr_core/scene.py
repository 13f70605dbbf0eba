"""Public path of `data.scene_description`."""

from .data.scene_description import (
    Camera,
    Lamp,
    Material,
    Model,
    Part,
    Placed,
    SceneDescription,
    Spectrum,
    flat,
)

__all__ = [
    "Camera",
    "Lamp",
    "Material",
    "Model",
    "Part",
    "Placed",
    "SceneDescription",
    "Spectrum",
    "flat",
]
