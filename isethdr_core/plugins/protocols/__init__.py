"""Contracts of components: the calls of each kind, and the optional abilities.

| module       | Protocols of                                                                   |
|--------------|--------------------------------------------------------------------------------|
| `by_kind`    | tables: the required calls and the optional abilities of each kind             |
| `any_kind`   | abilities of any kind: narrowing the demand, input files, programs, accuracy   |
| `scenes`     | scenes: bands, tiles, field, light groups, files, motion                       |
| `renderers`  | renderers: field, fog, samples that are continued, estimates                   |
| `lightings`  | lightings: the light groups that they need                                     |
| `lenses`     | lenses: image size, field border, focus, memory and time, point spread function |
| `lens_plans` | lenses that plan the imaging of a field, or state the errors of their light    |
| `flares`     | flares: the four ways in which a flare acts on light                           |
| `sensors`    | sensors: noise, pixels, exposure, duration of a shot, memory                   |
| `isps`       | image signal processing: the captures that it accepts                          |
| `metrics`    | metrics: scores of further noise realisations, and of parts of a picture       |

Import the names from this package: `from isethdr_core.plugins.protocols import Lens`.

Each kind has one Protocol for its required call, and one small Protocol for each optional ability.
The core tests `isinstance(component, Ability)`, and uses the ability if the component has it. When
a plugin is loaded, `plugins.abilities` compares its classes with these Protocols: a misspelt
method, or one with parameters that the core could not pass, is an error.

A `/` in a signature means that the core passes the preceding parameters by position. A plugin may
name them freely. All others may be passed by name.

Members other than methods are class attributes, or fields of the dataclass. A class withdraws an
ability of its base class by setting the method to None.

Python caches the classes that have all methods of a Protocol. Do not remove a method from a class
after the first `isinstance` test.
"""

from .any_kind import (
    ChoosesKernels,
    DeclaresAccuracy,
    DividesErrorAllowed,
    NarrowsDemand,
    ReadsFiles,
    RunsPrograms,
    ThreadSafe,
)
from .flares import (
    AddsLight,
    Flare,
    RedirectsLight,
    ScattersLight,
    TransmitsPupil,
)
from .isps import (
    ChecksCaptures,
    Isp,
)
from .lens_plans import (
    ImagingPlan,
    MakesPhotocurrent,
    OutlinesImaging,
    PlansImaging,
    StatesErrors,
    StatesSpreadErrors,
)
from .lenses import (
    CountsKernels,
    CountsMemory,
    EstimatesImaging,
    FocusesAtDepth,
    HasPointSpread,
    KeepsLight,
    KnowsImageSize,
    Lens,
    StatesFieldBorder,
)
from .lightings import (
    ChecksGroups,
    Lighting,
    LooksWithinField,
)
from .metrics import (
    HasMeanOfParts,
    HasWhite,
    Metric,
    ScoresFurther,
    ScoresParts,
)
from .renderers import (
    AccumulatesSamples,
    ChecksCameraField,
    CountsRenderMemory,
    EstimatesRendering,
    EstimatesSamples,
    MeetsNoiseLimit,
    NamesItsEffort,
    Renderer,
    RendersFog,
    RendersMargin,
)
from .scenes import (
    ChecksFiles,
    CountsTiles,
    KnowsItsBands,
    KnowsItsField,
    ListsGroups,
    MovesInTime,
    NamesItsShot,
    Scene,
)
from .sensors import (
    CarriesExposure,
    ChecksFocalLength,
    ChecksImageSize,
    CountsPixels,
    DeclaresNoise,
    HasPixelCounts,
    HasPixelPitch,
    ListsCaptures,
    Sensor,
    TimesItsShot,
)

__all__ = [
    "AccumulatesSamples",
    "AddsLight",
    "CarriesExposure",
    "ChecksCameraField",
    "ChecksCaptures",
    "ChecksFiles",
    "ChecksFocalLength",
    "ChecksGroups",
    "ChecksImageSize",
    "ChoosesKernels",
    "CountsKernels",
    "CountsMemory",
    "CountsPixels",
    "CountsRenderMemory",
    "CountsTiles",
    "DeclaresAccuracy",
    "DeclaresNoise",
    "DividesErrorAllowed",
    "EstimatesImaging",
    "EstimatesRendering",
    "EstimatesSamples",
    "Flare",
    "FocusesAtDepth",
    "HasMeanOfParts",
    "HasPixelCounts",
    "HasPixelPitch",
    "HasPointSpread",
    "HasWhite",
    "ImagingPlan",
    "Isp",
    "KeepsLight",
    "KnowsImageSize",
    "KnowsItsBands",
    "KnowsItsField",
    "Lens",
    "Lighting",
    "ListsCaptures",
    "ListsGroups",
    "LooksWithinField",
    "MakesPhotocurrent",
    "MeetsNoiseLimit",
    "Metric",
    "MovesInTime",
    "NamesItsEffort",
    "NamesItsShot",
    "NarrowsDemand",
    "OutlinesImaging",
    "PlansImaging",
    "ReadsFiles",
    "RedirectsLight",
    "Renderer",
    "RendersFog",
    "RendersMargin",
    "RunsPrograms",
    "ScattersLight",
    "Scene",
    "ScoresFurther",
    "ScoresParts",
    "Sensor",
    "StatesErrors",
    "StatesFieldBorder",
    "StatesSpreadErrors",
    "ThreadSafe",
    "TimesItsShot",
    "TransmitsPupil",
]
