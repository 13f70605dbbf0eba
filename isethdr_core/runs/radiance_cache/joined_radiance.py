"""Joined radiance: the radiance of several stores as one Dataset, with its errors restated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...pipeline.bands import of_demand
from ...storage import store
from ...storage.encoding import rounding
from ...storage.join import join_scenes
from ...uncertainty.error_terms import RELATIVE, ErrorTerm, Quantity, Source
from ...uncertainty.ledger import Ledger, left_out, record
from ..sample_accumulation import known

if TYPE_CHECKING:
    import xarray as xr

    from ...pipeline.demand import Demand

ROUNDING = "store rounding"  # key of the rounding of stored radiance
LABELS_NOT_MADE = "labels not made"  # key of labels that the renderer was asked for
NOISE = "accumulated noise"  # key of the noise of several renderings together; part: light group


def opened(
    folder: Path,
    stores: list[dict[str, Any]],
    demand: Demand,
    rows: Ledger,
    earlier_ids: Sequence[str] = (),
) -> xr.Dataset:
    """Return the radiance of all stores as one lazy Dataset, and restate the errors of stores that
    an earlier run rendered.

    Parameters
    ----------
    folder : folder of the stores.
    stores : attributes of the stores to join.
    demand : light groups, bands and labels that the run needs.
    rows : ledger of the run, with the errors already stated.
    earlier_ids : names of the stores that an earlier run rendered.
    """
    scenes = [store.open_store(folder / f"{s['id']}.zarr") for s in stores]
    kept_bits = [s["radiance"].attrs.get("keepbits") for s in scenes]
    largest = max(map(rounding, kept_bits))
    record(rounding_term(largest))
    stated = [term for row in rows for term in row.errors]
    terms = [
        term
        for s in stores
        for row in Ledger.from_records(s["ledger"])
        if row.kind == "renderer"
        for term in row.errors
    ]
    all_groups = join_scenes(scenes, demand.groups)
    pooled = "paths" in all_groups.attrs  # the noise of pooled stores is stated for all together
    record(*(t for t in terms if t not in stated and not (pooled and t.how == "statistical")))
    _record_pooled(all_groups, stores, earlier_ids, stated)
    _record_labels(all_groups, demand)
    rendered_s = sum(
        row["seconds"] for s in stores for row in s["ledger"] if row["stage"].startswith("renderer")
    )
    return of_demand(all_groups, demand).assign_attrs(rendered_s=rendered_s)


def rounding_term(largest: float) -> ErrorTerm:
    """Return the error term of stored radiance that is rounded by at most `largest`, relative."""
    label = "radiance as stored, rounded in its mantissa"
    source = Source("radiance", key=ROUNDING)
    return ErrorTerm(source, Quantity.RADIANCE, None, largest, RELATIVE, "bound", label)


def _record_labels(joined: xr.Dataset, demand: Demand) -> None:
    """State which labels the run asks for and the renderer did not make.

    Parameters
    ----------
    joined : radiance of all stores together.
    demand : demand of the run for scene radiance.
    """
    not_made = sorted(demand.labels - set(map(str, joined.data_vars)))
    if not_made:
        left_out(
            f"labels {', '.join(not_made)}",
            "the renderer did not make them: results that need them are missing",
            math.inf,
            "labels",
            key=LABELS_NOT_MADE,
        )


def _record_pooled(
    joined: xr.Dataset,
    stores: Sequence[dict[str, Any]],
    earlier_ids: Sequence[str],
    terms: Sequence[ErrorTerm],
) -> None:
    """State the noise of each light group of pooled stores, and how many of their samples an
    earlier run stored.

    Parameters
    ----------
    joined : radiance of all stores together.
    stores : root attributes of the stores.
    earlier_ids : names of the stores that an earlier run rendered.
    terms : errors that this run has stated already.
    """
    # a renderer states the noise of each light group as that of a part of the radiance
    stated_groups = {
        t.part for t in terms if t.source.kind == "renderer" and t.how == "statistical"
    }
    for group, paths in joined.attrs.get("paths", {}).items():
        noise = joined.attrs["noise"].get(group)
        if noise is not None and group not in stated_groups:
            label = f"{paths} samples per tile: median over tiles, light group {group}"
            source = Source("renderer", key=NOISE)
            record(
                ErrorTerm(source, Quantity.RADIANCE, group, noise, RELATIVE, "statistical", label)
            )
        if reused := known(
            [s for s in stores if s["id"] in earlier_ids], group, joined.wavelength.values
        ).paths:
            left_out(
                f"{reused} of {paths} samples per tile of light group {group}",
                "stored by an earlier run",
                0.0,
                "relative",
            )
