"""Running: apply a model to all tiles of a picture, and check its outputs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.onnx_session import OnnxSession, shape_text

from .tiles import Grid, tiled

# overlap of tiles for a model of fixed size with a reach beyond the largest overlap
USUAL_OVERLAP_PX = 32
# largest overlap as a share of a tile; with more, most outputs of a tile would not be used
MOST_OVERLAP = 0.375


@dataclass(frozen=True)
class Cut:
    """Requirements of a model on its tiles."""

    cell: tuple[int, int]  # rows and columns of the filter array
    multiple_px: int  # rows and columns of a tile are multiples of this number
    # largest distance from an output to an input that it depends on; inf: no limit
    reach_px: float
    # rows and columns of every tile; None: any multiples of `multiple_px`
    size: tuple[int, int] | None = None


def fixed_size(session: OnnxSession) -> tuple[int, int] | None:
    """Return rows and columns of a model's inputs; None if the file leaves them free.

    Raises
    ------
    ConfigError : one of them is fixed and the other is free.
    """
    rows, columns = session.inputs[0].shape[2:]
    if rows is None and columns is None:
        return None
    if rows is None or columns is None:
        raise ConfigError(
            f"{session.path} takes inputs of {shape_text(session.inputs[0].shape)}; expected rows"
            " and columns both free, or both fixed; export the model again"
        )
    return rows, columns


def check_size(session: OnnxSession, multiple_px: int) -> None:
    """Raise ConfigError if the fixed size of a model is no multiple of its stated `multiple_px`."""
    size = fixed_size(session)
    if size and any(side % multiple_px for side in size):
        raise ConfigError(
            f"{session.path} takes inputs of {size[0]} x {size[1]} pixels; expected multiples of"
            f" {multiple_px}, as it states; export the model again"
        )


def results_of(
    session: OnnxSession,
    planes: Mapping[str, np.ndarray],
    phase: tuple[int, int],
    cut: Cut,
    tile_px: int,
) -> dict[str, np.ndarray]:
    """Return the outputs (plane, y, x) of a model on a picture of any size.

    Parameters
    ----------
    session : the open model.
    planes : inputs (plane, y, x) by name.
    phase : row and column of the filter array's cell at the first pixel.
    cut : requirements of the model on its tiles.
    tile_px : side of the largest tile, pixels, for a model of free size.

    Raises
    ------
    ConfigError : the model fails on its inputs.
    UnitError : the model returns values that are not finite.
    """
    grid = grid_of(cut, tile_px)
    results = tiled(session.run, planes, phase, grid)
    for name, values in results.items():
        wrong = ~np.isfinite(values)
        if wrong.any():
            raise UnitError(
                f"{session.path} returned {name} with {int(wrong.sum())} of {wrong.size} values"
                " that are NaN or infinite; expected finite values for finite inputs; the model was"
                " trained for other light levels, or its file is damaged: use another model"
            )
    return results


def grid_of(cut: Cut, tile_px: int) -> Grid:
    """Return the tiling for a model. A model of free size with infinite reach gets the picture in
    one piece.

    Parameters
    ----------
    cut : requirements of the model on its tiles.
    tile_px : side of the largest tile, pixels, for a model of free size.
    """
    multiple = cut.multiple_px
    size = cut.size
    if size is not None:
        # seams are possible if the reach exceeds the overlap
        largest = int(min(size) * MOST_OVERLAP)
        wanted = cut.reach_px if cut.reach_px <= largest else USUAL_OVERLAP_PX
        overlap = -(-int(min(wanted, largest)) // multiple) * multiple
        # between its overlaps a tile keeps at least one multiple
        overlap = min(overlap, (min(size) - multiple) // (2 * multiple) * multiple)
        if cut.reach_px > overlap:
            ledger.left_out(
                "inputs beyond a tile",
                f"the model takes {size[0]} x {size[1]} pixels, and its receptive field exceeds the"
                f" {overlap} pixels by which its tiles overlap; seams are possible",
                np.nan,
                "",
                key="seams",
            )
        return Grid(cut.cell, multiple, overlap, size, fixed=True)
    if math.isinf(cut.reach_px):
        return Grid(cut.cell, multiple, 0, (1 << 30, 1 << 30))
    overlap = -(-int(cut.reach_px) // multiple) * multiple
    smallest = math.ceil(2 * overlap / (2 * MOST_OVERLAP))
    tile = -(-max(tile_px, smallest, multiple) // multiple) * multiple
    return Grid(cut.cell, multiple, overlap, (tile, tile))
