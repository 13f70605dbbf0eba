"""isethdr: simulate a camera looking at a high dynamic range driving scene, in physical units.

| module                     | what                                                             |
|----------------------------|------------------------------------------------------------------|
| `component`, `hookspecs`   | what a plugin offers, and through which hooks                    |
| `registry`, `composition`  | collect plugins; turn their fields into Hydra configs            |
| `scene`, `quantities`      | what crosses the borders between stages, and the checks on it    |
| `demand`, `ledger`         | what is needed; what it cost, how wrong it may be, what was left out |
| `pipeline`, `runs`         | the chain from scene to scores; one stored run                   |
| `store`                    | zarr stores that are either whole or not there                   |
| `physics`                  | one law per function, numpy and scipy only                       |
"""

from __future__ import annotations

import importlib

_PUBLIC = {
    "Component": "component", "Stage": "component", "hookimpl": "hookspecs", "hookspec": "hookspecs",
    "build": "registry", "components": "registry", "compose": "composition", "run": "runs", "open_scene": "store",
    "generator": "seeds", "Generator": "seeds", "Demand": "demand", "Score": "scores",
}
__all__ = sorted(_PUBLIC)


def __getattr__(name: str):
    """Import public names on first use: `isethdr --help` must not wait for xarray."""
    if name in _PUBLIC:
        return getattr(importlib.import_module(f".{_PUBLIC[name]}", __name__), name)
    raise AttributeError(f"module 'isethdr_core' has no attribute {name!r}")
