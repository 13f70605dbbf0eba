"""Public path of `data.scene_description`."""

from .data.fog import Fog, PhaseLobe, fog_of
from .data.scene_description import (
    Camera,
    Facets,
    Granular,
    IntensityTable,
    Lamp,
    Material,
    Model,
    NextFrame,
    Opening,
    Part,
    Placed,
    RetroReflection,
    SceneDescription,
    Spectrum,
    Texture,
    flat,
)
from .data.sky import SkyDisc, SkyDome, SkyPart

__all__ = [
    "Camera",
    "Facets",
    "Fog",
    "Granular",
    "IntensityTable",
    "Lamp",
    "Material",
    "Model",
    "NextFrame",
    "Opening",
    "Part",
    "PhaseLobe",
    "Placed",
    "RetroReflection",
    "SceneDescription",
    "SkyDisc",
    "SkyDome",
    "SkyPart",
    "Spectrum",
    "Texture",
    "flat",
    "fog_of",
]
