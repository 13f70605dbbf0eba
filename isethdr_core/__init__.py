"""isethdr: simulate a camera looking at a high dynamic range driving scene, in physical units.

| module         | what                                                                          |
|----------------|-------------------------------------------------------------------------------|
| `component`    | public path of `plugins.component`                                            |
| `demand`       | public path of `pipeline.demand`                                              |
| `errors`       | every error a user can cause, and which one to raise                          |
| `hookspecs`    | public path of `plugins.hookspecs`                                            |
| `ledger`       | public path of `uncertainty.ledger`                                           |
| `quantities`   | public path of `data.quantities`                                              |
| `scene`        | public path of `data.scene_description`                                       |
| `seeds`        | public path of `runs.seeds`                                                   |
| `store`        | public path of `storage.store`                                                |
| `testing`      | public path of `conformance`, the kit for plugin authors                      |
| `truth`        | public path of `data.reference_picture`                                       |
| `cli/`         | the commands, their tables, and their progress                                |
| `config/`      | component fields as Hydra groups, single runs, sweeps, and trusted folders    |
| `conformance/` | one line in a plugin's tests checks all that the component's kind promises    |
| `data/`        | what crosses the borders between stages, with its units and checks            |
| `display/`     | how a linear picture or a rendering is looked at. Never a stage               |
| `lighting/`    | how much of each light group is in the picture                                |
| `physics/`     | one per function, on plain arrays; numpy, scipy, array-api-compat and         |
| `pipeline/`    | the chain of stages, and what can be known of it before anything is computed  |
| `plugins/`     | what a plugin offers, how it is found, and which values its fields may hold   |
| `runs/`        | one stored run, the stored radiance it reads, its noise, and what made it     |
| `storage/`     | zarr stores that are either whole or not there, and that name their damage    |
| `uncertainty/` | stated errors, their share of a budget, and what they do to pixels and scores |
"""

from __future__ import annotations

import importlib

_PUBLIC = {
    "Component": "component",
    "Stage": "component",
    "hookimpl": "hookspecs",
    "hookspec": "hookspecs",
    "build": "plugins.registry",
    "components": "plugins.registry",
    "compose": "config.composition",
    "run": "runs.run",
    "open_scene": "store",
    "generator": "seeds",
    "Generator": "seeds",
    "Demand": "demand",
    "Score": "data.scores",
    "Range": "plugins.ranges",
}
__all__ = sorted(_PUBLIC)


def __getattr__(name: str):
    """Import public names on first use: `isethdr --help` must not wait for xarray."""
    if name in _PUBLIC:
        return getattr(importlib.import_module(f".{_PUBLIC[name]}", __name__), name)
    raise AttributeError(f"module 'isethdr_core' has no attribute {name!r}")
