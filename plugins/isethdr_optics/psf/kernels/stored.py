"""Stored kernels: writing kernels of all bands to disk, and reading them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.convolution.mirrored import Mirrored

from .. import kernel_store
from .kernel_set import Kernels, Wide

if TYPE_CHECKING:
    from ..scaled_pattern import Frame


def store(name: str, made: Kernels) -> None:
    """Write kernels to disk; of mirrored kernels only one half."""
    arrays = [band.half if isinstance(band, Mirrored) else band for band in made.bands]
    count = len(arrays)
    facts = [made.outside, made.transmitted, np.full(count, made.wrap), made.core]
    facts += [np.full(count, made.core_deviation)]
    facts += [*made.speckle.T, *made.deviation.T]
    if made.wide is not None:
        facts += [np.full(count, value) for value in made.wide.deviation]
    kernel_store.save(name, (count, *arrays[0].shape), "<f4", arrays, lambda: np.stack(facts))


def stored(name: str | None, tiles: int | None = None) -> Kernels | None:
    """Return stored kernels; None where they are not stored.

    Parameters
    ----------
    name : name of the kernels on disk; None: they are not kept there.
    tiles : reach of their wider exact core, in tiles; None: they have none.
    """
    arrays = kernel_store.load(name) if name else None
    if arrays is None:
        return None
    (outside, transmitted, wrap, core, core_deviation, *errors), bands = arrays
    parts = np.split(np.stack(errors, axis=1), 2 if tiles is None else 3, axis=1)
    return Kernels(
        list(bands),
        outside,
        parts[0],
        transmitted,
        float(wrap[0]),
        parts[1],
        core,
        float(core_deviation[0]),
        name=name,
        wide=None if tiles is None else Wide(tiles, parts[2][0]),
    )


def stored_halves(name: str | None, frame: Frame, tiles: int | None = None) -> Kernels | None:
    """Return stored kernels from one pattern; None where they are not stored.

    Parameters
    ----------
    name, tiles : as in `stored`.
    frame : bands and tiles of the kernels.
    """
    found = stored(name, tiles)
    if found is None:
        return None
    bands = [Mirrored(np.array(half)) for half in found.bands]
    keep = frame.lens, frame.flares
    return replace(found, bands=bands, keep=keep, name=None, scaled=frame)
