"""isethdr: simulate a camera looking at a high dynamic range driving scene, in physical units.

| module                          | what                                                                  |
|---------------------------------|-----------------------------------------------------------------------|
| `component`, `hookspecs`        | what a plugin offers, and through which hooks                         |
| `registry`, `composition`       | collect plugins; turn their fields into Hydra configs                 |
| `ranges`                        | which values a component's field may hold                             |
| `trust`                         | which folders a config file may come from                             |
| `builtin`                       | the components that the core itself offers: lighting                  |
| `scene`, `categories`           | scene description: geometry, materials, lamps; names of things        |
| `quantities`, `scores`          | what crosses the borders between stages, and the checks on it         |
| `light_in_time`                 | components of light that varies in time, and its mean                 |
| `geometry`                      | where a sensor looks: projection, distortion, relative illumination   |
| `early_checks`                  | mistakes that components see in each other before any work            |
| `field`                         | whether every sensor fits into the camera's field, before any work    |
| `truth`, `view`                 | the picture without noise and flare; how a picture looks on a display |
| `saturation`                    | which pixels no capture measured                                      |
| `preview`                       | a rendering of few paths, denoised light group by light group: a view |
| `local_tone`, `white_balance`   | views that follow the surroundings, or the light of the scene         |
| `demand`, `ledger`, `progress`  | what is needed; what it cost and how wrong it may be; how far it is   |
| `error_terms`                   | what a stated error acts on, and on which part of the light           |
| `bands`, `margin`, `window`     | bands, tiles beyond the field or a sensor, that can be left out       |
| `forecast`                      | how long each stage will take                                         |
| `memory`                        | how much memory a run will take; refused where the machine has less   |
| `accuracy`                      | what a run may be wrong by, and which stage by how much of it         |
| `noise_units`, `scene_noise`, `score_errors` | how wrong a picture and its scores are, in units of its noise |
| `lens_errors`                   | what a lens knows of how wrong it makes the light of a scene          |
| `seeds`, `provenance`           | which noise; which code, versions and inputs                          |
| `pipeline`, `recipes`, `runs`   | the chain; stored radiance; one stored run                            |
| `pooling`                       | what several stored renderings of the same light know together        |
| `draws`                         | scores over several noise realisations of one shot                    |
| `score_intervals`               | one 95 % interval per score, over sensor noise and renderer noise     |
| `store`, `store_arrays`, `store_encoding`, `store_join` | zarr stores that are either whole or not there |
| `store_manifest`, `store_reader` | size and checksum of every file; reads that are compared with them |
| `parent_watch`                  | workers of a sweep end with the process that started them             |
| `kernels`                       | the processor, and what libraries chose for it                        |
| `claims`                        | of several processes one renders a scene, the others wait              |
| `names`                         | names that become folders of a store                                  |
| `leftovers`                     | temporary names, and what killed writers left behind                  |
| `run_warnings`                  | exposures that make the scores of a run say little                    |
| `cli`, `hydra_app`, `sweeps`, `summary` | the command line, sweeps, and what it prints                  |
| `terminal`                      | the console that prints every name as it is                           |
| `errors`                        | every error a user can cause                                          |
| `lighting`                      | light groups mixed to weights or photometric targets                  |
| `testing`                       | the conformance kit for plugin authors                                |
| `physics`                       | one law per function, numpy and scipy only                            |
"""

from __future__ import annotations

import importlib

_PUBLIC = {
    "Component": "component",
    "Stage": "component",
    "hookimpl": "hookspecs",
    "hookspec": "hookspecs",
    "build": "registry",
    "components": "registry",
    "compose": "composition",
    "run": "runs",
    "open_scene": "store",
    "generator": "seeds",
    "Generator": "seeds",
    "Demand": "demand",
    "Score": "scores",
    "Range": "ranges",
}
__all__ = sorted(_PUBLIC)


def __getattr__(name: str):
    """Import public names on first use: `isethdr --help` must not wait for xarray."""
    if name in _PUBLIC:
        return getattr(importlib.import_module(f".{_PUBLIC[name]}", __name__), name)
    raise AttributeError(f"module 'isethdr_core' has no attribute {name!r}")
