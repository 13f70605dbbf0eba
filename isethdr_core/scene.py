"""Public path of `data.scene_description`."""

from .data.scene_description import (
    Camera,
    Facets,
    Granular,
    IntensityTable,
    Lamp,
    Material,
    Model,
    Part,
    Placed,
    RetroReflection,
    SceneDescription,
    Spectrum,
    Texture,
    flat,
)

__all__ = [
    "Camera",
    "Facets",
    "Granular",
    "IntensityTable",
    "Lamp",
    "Material",
    "Model",
    "Part",
    "Placed",
    "RetroReflection",
    "SceneDescription",
    "Spectrum",
    "Texture",
    "flat",
]
