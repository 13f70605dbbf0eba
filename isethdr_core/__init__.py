"""isethdr: simulate a camera looking at a high dynamic range driving scene, in physical units.

| module         | content                                                                       |
|----------------|-------------------------------------------------------------------------------|
| `component`    | public path of `plugins.component`                                            |
| `demand`       | public path of `pipeline.demand`                                              |
| `error_terms`  | public path of `uncertainty.error_terms`                                      |
| `errors`       | every error a user can cause, and which one to raise                          |
| `extras`       | libraries outside the base install, and the error if one is missing           |
| `hookspecs`    | public path of `plugins.hookspecs`                                            |
| `ledger`       | public path of `uncertainty.ledger`                                           |
| `light_in_time` | public path of `data.temporal_modulation`                                     |
| `onnx_session` | networks in ONNX files, computed by onnxruntime                                |
| `quantities`   | public path of `data.quantities`                                              |
| `ranges`       | public path of `plugins.ranges`                                               |
| `scene`        | public path of `data.scene_description`                                       |
| `seeds`        | public path of `runs.seeds`                                                   |
| `store`        | public path of `storage.store`                                                |
| `testing`      | public path of `conformance`, the kit for plugin authors                      |
| `truth`        | public path of `data.reference_picture`                                       |
| `cli/`         | the commands, their tables, and their progress                                |
| `config/`      | component fields as Hydra groups, single runs, sweeps, and trusted folders    |
| `conformance/` | one line in a plugin's tests checks all promises of the component's kind      |
| `data/`        | the quantities that stages exchange, with their units and checks              |
| `display/`     | views of a linear picture or a rendering. Never part of a stage               |
| `identity/`    | names of results, from the code, libraries and data that made them            |
| `lighting/`    | the weight of each light group in the picture                                 |
| `motion/`      | what moves during a shot: sub-frames of the scene                             |
| `physics/`     | laws of physics, one per function, on plain arrays                            |
| `pipeline/`    | the chain of stages, and everything decided before the first computation      |
| `plugins/`     | components of plugins, their search, and the allowed values of their fields   |
| `results/`     | stored runs opened by name, shown in notebooks, and drawn                     |
| `runs/`        | one stored run, the stored radiance it reads, its noise, and its provenance   |
| `sequence/`    | exposure that is carried from frame to frame                                  |
| `storage/`     | zarr stores that are complete or absent, with checks against damage           |
| `sweeps/`      | the results of the jobs of a sweep, and one table of their scores             |
| `uncertainty/` | stated errors, their share of a budget, and their effect on pixels and scores |
"""

from __future__ import annotations

import importlib
from functools import cache
from importlib import metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import component as component
    from . import demand as demand
    from . import error_terms as error_terms
    from . import errors as errors
    from . import hookspecs as hookspecs
    from . import ledger as ledger
    from . import quantities as quantities
    from . import scene as scene
    from . import seeds as seeds
    from . import store as store
    from . import testing as testing
    from . import truth as truth
    from .config.composition import compose as compose
    from .data.error_costs import Cost as Cost
    from .data.scores import Score as Score
    from .pipeline.demand import Demand as Demand
    from .plugins.accuracy_knobs import AccuracyKnob as AccuracyKnob
    from .plugins.accuracy_knobs import ErrorShare as ErrorShare
    from .plugins.accuracy_knobs import Spaced as Spaced
    from .plugins.component import PLUGIN_API as PLUGIN_API
    from .plugins.component import Component as Component
    from .plugins.component import Stage as Stage
    from .plugins.hookspecs import hookimpl as hookimpl
    from .plugins.hookspecs import hookspec as hookspec
    from .plugins.ranges import Range as Range
    from .plugins.registry import build as build
    from .plugins.registry import components as components
    from .results.stored import open_run as open_run
    from .runs.run import run as run
    from .runs.seeds import Generator as Generator
    from .runs.seeds import generator as generator
    from .storage.store import open_scene as open_scene

    __version__: str

__all__ = [
    "AccuracyKnob",
    "Component",
    "Cost",
    "Demand",
    "ErrorShare",
    "Generator",
    "PLUGIN_API",
    "Range",
    "Score",
    "Spaced",
    "Stage",
    "__version__",
    "build",
    "component",
    "components",
    "compose",
    "demand",
    "error_terms",
    "errors",
    "generator",
    "hookimpl",
    "hookspec",
    "hookspecs",
    "ledger",
    "open_run",
    "open_scene",
    "quantities",
    "run",
    "scene",
    "seeds",
    "store",
    "testing",
    "truth",
]
_MODULE_OF = {  # public name: the module of this package that defines it
    "AccuracyKnob": "plugins.accuracy_knobs",
    "Component": "plugins.component",
    "Cost": "data.error_costs",
    "Demand": "pipeline.demand",
    "ErrorShare": "plugins.accuracy_knobs",
    "Generator": "runs.seeds",
    "PLUGIN_API": "plugins.component",
    "Range": "plugins.ranges",
    "Score": "data.scores",
    "Spaced": "plugins.accuracy_knobs",
    "Stage": "plugins.component",
    "build": "plugins.registry",
    "components": "plugins.registry",
    "compose": "config.composition",
    "generator": "runs.seeds",
    "hookimpl": "plugins.hookspecs",
    "hookspec": "plugins.hookspecs",
    "open_run": "results.stored",
    "open_scene": "storage.store",
    "run": "runs.run",
}


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that `isethdr --help` does not wait for xarray."""
    if name == "__version__":
        return _version()
    if name in _MODULE_OF:
        return getattr(importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)
    if name in __all__:
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module 'isethdr_core' has no attribute {name!r}")


@cache
def _version() -> str:
    return metadata.version("isethdr")


def __dir__() -> list[str]:
    """Return the public API."""
    return sorted(__all__)
