"""Wider cores: kernels from one pattern with a larger exact core, and finer rings around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from isethdr_core.physics.convolution.mirrored import Mirrored
from isethdr_core.pipeline.memory import machine_bytes

from ...imaging.threads import MOST_THREADS, cpus, executor
from .. import kernel_store, scaled_pattern
from . import lookup
from .kernel_set import Kernels, Wide
from .patterns import mix_scatter
from .stored import store, stored_halves


def wider_cores(computed: Kernels) -> list[scaled_pattern.CoreSize]:
    """Return the sizes larger than the present one that the exact core of kernels can have."""
    if computed.scaled is None or computed.wide is not None:
        return []
    return scaled_pattern.wider_cores(computed.scaled)


def fine_rings_fit(computed: Kernels) -> bool:
    """Return whether the machine's memory holds the kernels and the same kernels with fine rings
    together.
    """
    if computed.scaled is None:
        return False
    read = scaled_pattern.fine_rings(computed.scaled)
    fine = scaled_pattern.memory_bytes(computed.scaled, read)
    return computed.held_bytes + fine <= machine_bytes()


def with_core(computed: Kernels, tiles: int, fine_rings: bool = False) -> Kernels:
    """Return kernels from one pattern with a wider exact core. They are cached in the process and,
    if they took long, on disk.

    Parameters
    ----------
    computed : kernels from one pattern. If they have fine rings, they keep them.
    tiles : reach of the core in tiles, one of `wider_cores`.
    fine_rings : whether the rings beyond the core are computed again with the sampling of
        `scaled_pattern.fine_rings`.
    """
    key = (*computed.key, tiles, fine_rings) if computed.key else ()
    are_fine = fine_rings or computed.fine_rings

    def read_or_made() -> Kernels:
        name = lookup.name_of(computed.scaled.request) if computed.key else None
        name = name and f"{name}-core-{tiles}{'-fine' * are_fine}"
        found = stored_halves(name, computed.scaled, tiles)
        if found is None:
            start = perf_counter()
            found = _with_core(computed, tiles, fine_rings)
            if name and perf_counter() - start > kernel_store.PATTERN_WORTH_KEEPING_S:
                store(name, found)
        return replace(found, key=key, fine_rings=are_fine)

    # kernels without a key are not cached
    return lookup.once(key, read_or_made) if computed.key else read_or_made()


def _with_core(computed: Kernels, tiles: int, fine_rings: bool) -> Kernels:
    """Compute the kernels of `with_core`."""
    with executor(min(cpus(), MOST_THREADS)) as pool:
        core = scaled_pattern.wider_core(computed.scaled, tiles, pool.map)
        if fine_rings:
            rings = _fine_rings(computed, core, pool.map)
        else:
            rings = _inserted(computed, core)
    inside = 2.0 ** (np.arange(len(core.relative)) + 1) <= tiles  # octaves wholly within the core
    changed = {
        "outside": np.array([1 - float(b.sum(dtype=float)) for b in rings["bands"]]),
        "speckle": np.where(inside, core.relative, rings.pop("speckle")),
        "wide": Wide(tiles, core.deviation),
    }
    return replace(computed, **rings, **changed)


def _inserted(computed: Kernels, core: scaled_pattern.Core) -> dict[str, Any]:
    """Return the changed fields of kernels with a wider core and unchanged rings."""
    mix_scatter(core.halves, computed.scaled)
    bands = []
    rows, columns = core.reach
    for band, inner in zip(computed.bands, core.halves):
        half = band.half.copy()
        middle = band.half.shape[1] // 2
        half[: rows + 1, middle - columns : middle + columns + 1] = inner
        bands.append(Mirrored(half))
    return {"bands": bands, "speckle": computed.speckle}


def _fine_rings(
    computed: Kernels, core: scaled_pattern.Core, apply: Callable[..., Any]
) -> dict[str, Any]:
    """Return the changed fields of kernels with fine rings around a wider core."""
    read = scaled_pattern.fine_rings(computed.scaled)
    frame = replace(computed.scaled, core=core.reach)
    finer_halves = scaled_pattern.halves(frame, core.halves, read, apply)
    sums = scaled_pattern.direct_sums(frame, read, apply)
    errors = scaled_pattern.errors(frame, finer_halves, sums)
    mix_scatter(finer_halves, frame)
    count = len(finer_halves)
    return {
        "bands": [Mirrored(half) for half in finer_halves],
        "speckle": np.tile(errors.relative, (count, 1)),
        "deviation": np.tile(errors.deviation, (count, 1)),
        "wrap": max(errors.mean, scaled_pattern.wrap(computed.scaled, read)),
    }
