"""Equal groups: light groups of another frame that are taken over, because their light is the same.

Example: a car waits, and its indicator blinks. Only the light group of the indicator is rendered.
The light of each other group is copied from a stored frame with the same surfaces, camera and sky,
and with the same lamps in this group. Its stated errors are copied too. The new store therefore
holds everything, and stays complete when the other store is removed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..data.quantities import names
from ..pipeline.demand import Demand, NoiseLimit
from ..storage import store
from ..storage.picture_rounding import ROUNDING
from ..uncertainty import ledger
from ..uncertainty.ledger import Ledger
from ..uncertainty.render_noise import NOISE
from .equal_radiance import GROUP_CONTENTS, newest

if TYPE_CHECKING:
    import xarray as xr

GROUP = "light_group"
SOURCES = "groups_from"  # key of the attributes of a store: {light group: the store it is from}
KEPT_BITS = "keepbits"  # attribute of stored radiance: its mantissa bits
# largest share of the tiles seen by a camera that may exceed the allowed variance; in a rendering
# of all groups together, 3 % of them do
MOST_ABOVE = 0.05
WORTH = 1.15  # times the allowed variance; up to this a renderer adds no samples either
# smallest share of the allowed variance that is left for the rendered groups
LEAST_LEFT = 0.25


class TooNoisy(Exception):
    """Light that would be taken over is noisier than this frame allows."""


class Taken(NamedTuple):
    """Light groups that are taken over from one store."""

    attributes: dict[str, Any]  # root attributes of the store
    groups: list[str]


@dataclass(frozen=True)
class Wanted:
    """The light groups of a frame that is to be rendered.

    Attributes
    ----------
    contents : name of the content of each group, in the order of the description.
    demand : demand for the missing radiance.
    keepbits : mantissa bits of stored radiance.
    """

    contents: Mapping[str, str]
    demand: Demand
    keepbits: int | None

    def fits(self, attributes: Mapping[str, Any], group: str) -> bool:
        """Return whether a store holds the same light of a group, on the same grid and bands."""
        return (
            group in attributes["groups"]
            and (attributes.get(GROUP_CONTENTS) or {}).get(group) == self.contents[group]
            and attributes.get("margin", True) == self.demand.margin
            and attributes["bands_asked"] == _listed(self.demand.wavelength_nm)
        )


def find_groups(
    folder: Path, wanted: Wanted, precise: Callable[[dict[str, Any], str], bool]
) -> list[Taken]:
    """Return the light groups that need not be rendered. At least one group is always rendered,
    because labels come with its light.

    Parameters
    ----------
    folder : folder of scene stores.
    wanted : what the frame needs.
    precise : function(attributes of a store, group) -> whether its light is precise enough.
    """
    left = list(wanted.contents)
    found = []
    for attributes in newest(folder) if len(left) > 1 else ():
        groups = [g for g in left if wanted.fits(attributes, g) and precise(attributes, g)]
        if groups and _is_rounded_alike(folder, attributes, wanted.keepbits):
            found.append(Taken(attributes, groups))
            left = [g for g in left if g not in groups]
        if not left:
            break
    if not left:  # the first group is rendered in any case: the sky, which takes the least time
        first = next(iter(wanted.contents))
        found = [Taken(t.attributes, [g for g in t.groups if g != first]) for t in found]
    return [taken for taken in found if taken.groups]


def groups_of(taken: Iterable[Taken]) -> list[str]:
    """Return the names of all groups that are taken over."""
    return [group for part in taken for group in part.groups]


def beside(scene: xr.Dataset, others: Iterable[xr.Dataset], order: Iterable[str]) -> xr.Dataset:
    """Return scene radiance with the light groups of others added.

    Parameters
    ----------
    scene : scene radiance from which labels, grid and attributes are taken.
    others : scene radiance on the same grid and bands, with all variables of light groups that
        `scene` has.
    order : names of the light groups, all of them and maybe more.
    """
    parts = [scene, *others]
    place = {str(g): (n, k) for n, one in enumerate(parts) for k, g in enumerate(_groups(one))}
    groups = [group for group in order if group in place]
    joined = scene.drop_dims(GROUP).assign_coords({GROUP: (GROUP, names(groups))})
    for name, variable in scene.data_vars.items():
        if GROUP in variable.dims:
            axis = variable.dims.index(GROUP)
            places = [place[group] for group in groups]
            planes = [parts[n][name].isel({GROUP: k}).values for n, k in places]
            values = np.stack(planes, axis).astype(variable.dtype, copy=False)
            joined[name] = (variable.dims, values, variable.attrs)
    return joined.assign_attrs(scene.attrs)


def opened(folder: Path, taken: Iterable[Taken]) -> list[xr.Dataset]:
    """Return the radiance that is taken over, read when it is used."""
    scenes = []
    for part in taken:
        scene = store.open_store(folder / f"{part.attributes['id']}.zarr")
        places = [_groups(scene).index(group) for group in part.groups]
        scenes.append(scene.isel({GROUP: places}))
    return scenes


def taken_over(
    folder: Path, scene: xr.Dataset, taken: list[Taken], order: Iterable[str]
) -> xr.Dataset:
    """Return rendered radiance with the groups that are taken over, and state their errors.

    Parameters
    ----------
    folder : folder of scene stores.
    scene : scene radiance as rendered, without the groups that are taken over.
    taken : light groups of other stores.
    order : light groups of the result, in their order.
    """
    whole = beside(scene, opened(folder, taken), order)
    for key in ("noise", "path_span"):
        stated = dict(scene.attrs.get(key, {}))
        for part in taken:
            of_store = part.attributes.get(key) or {}
            stated |= {group: of_store[group] for group in part.groups if group in of_store}
        whole.attrs[key] = stated
    lamps = list(scene.attrs.get("lamps", []))
    for part in taken:
        lamps += [one for one in part.attributes.get("lamps", []) if one["group"] in part.groups]
    whole.attrs["lamps"] = sorted(lamps, key=lambda lamp: lamp["instance"])
    whole.attrs[SOURCES] = {g: part.attributes["id"] for part in taken for g in part.groups}
    for part in taken:
        _state(part)
    return whole


def _state(taken: Taken) -> None:
    """State in the ledger which groups were not rendered, and the errors of their rendering."""
    rows = Ledger.from_records(taken.attributes["ledger"])
    terms = [term for row in rows if row.kind == "renderer" for term in row.errors]
    ledger.record(*(term for term in terms if term.part is None or term.part in taken.groups))
    ledger.left_out(
        f"light groups {', '.join(taken.groups)}",
        f"taken from the store {taken.attributes['id']}, whose light is the same",
        0.0,
        "relative",
        key="equal groups",
    )


@dataclass(frozen=True, eq=False)
class LimitBeside:
    """The noise limit of groups that are rendered together with groups that are taken over.

    The cameras see the light of all groups, and the noise of all of them together. The rendered
    groups may have the part of the allowed noise that the other groups leave.

    Attributes
    ----------
    limit : function(scene radiance of all groups) -> `NoiseLimit`.
    others : the radiance that is taken over.
    share : noise of the light that is allowed, over that of the cameras.
    """

    limit: Callable[[xr.Dataset], NoiseLimit]
    others: list[xr.Dataset]
    share: float

    def __call__(self, scene: xr.Dataset) -> NoiseLimit:
        """Return the limit for the light of `scene`.

        Raises
        ------
        TooNoisy : the other groups alone have more noise than all may have together.
        """
        light = [other[["radiance"]] for other in self.others]
        order = [*_groups(scene), *(g for other in self.others for g in _groups(other))]
        limit = self.limit(beside(scene[["radiance"]].assign_attrs(scene.attrs), light, order))
        variance = np.zeros(limit.xyz.shape)
        for other in self.others:
            for k, group in enumerate(_groups(other)):
                noise = other[NOISE].isel({GROUP: k}).values.astype(float)
                variance += (limit.weights.get(group, 0.0) * noise) ** 2
        allowed = (self.share * limit.xyz) ** 2
        judged = np.isfinite(limit.xyz).any(0)
        above = np.any(variance > WORTH * allowed, axis=0)[judged]
        if above.size and above.mean() > MOST_ABOVE:
            raise TooNoisy
        left = np.maximum(allowed - variance, LEAST_LEFT * allowed)
        return replace(limit, xyz=np.sqrt(left) / self.share)


def _groups(scene: xr.Dataset) -> list[str]:
    return [str(group) for group in scene[GROUP].values]


def _listed(values: Iterable[float] | None) -> list[float] | None:
    return None if values is None else list(values)


def _is_rounded_alike(folder: Path, attributes: dict[str, Any], keepbits: int | None) -> bool:
    """Return whether stored radiance is rounded to `keepbits`, and not tile by tile."""
    rounding = store.open_store(folder / f"{attributes['id']}.zarr")["radiance"].attrs
    return ROUNDING not in rounding and rounding.get(KEPT_BITS) == keepbits
