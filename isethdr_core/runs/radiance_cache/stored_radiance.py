"""Stored radiance: which stores serve the demand of a run, and what is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...errors import CatalogError
from ...plugins.protocols import AccumulatesSamples, MeetsNoiseLimit
from ...sequence.equal_radiance import ContentNames, find_equal, noted
from ...storage import store
from ..sample_accumulation import ALL_BANDS, Known, holds, known
from .recipe import effort_spent, recipe_hash, scenes_folder

if TYPE_CHECKING:
    from ...pipeline.chain import Chain
    from ...pipeline.demand import Demand


class Held(NamedTuple):
    """The stores that serve a demand, and the demand for the missing part."""

    stores: list[dict[str, Any]]  # root attributes of each
    missing: Demand | None  # None if nothing is missing


def held_and_missing(chain: Chain, demand: Demand) -> Held:
    """Return the stores that serve `demand`, and what is missing.

    Stores of another recipe with equal content are used if they hold everything.
    """
    if chain.renderer is None:
        return Held([], None)
    folder = scenes_folder()
    recipe = recipe_hash(chain)
    own = held(chain, demand, stored(folder, recipe))
    if own.missing is None:
        return own
    equal = (held(chain, demand, stored(folder, other)) for other in noted(folder, recipe))
    return next((other for other in equal if other.missing is None), own)


def is_equal_stored(chain: Chain, demand: Demand, content: ContentNames) -> bool:
    """Return whether stored radiance of the same content, of any recipe, serves the demand.

    Parameters
    ----------
    chain : components of the run.
    demand : light groups, bands and labels that the run needs.
    content : names of the content of the scene's description.
    """
    folder = scenes_folder()
    recipes = find_equal(folder, content.whole)
    return any(held(chain, demand, stored(folder, recipe)).missing is None for recipe in recipes)


def held(chain: Chain, demand: Demand, stores: list[dict[str, Any]]) -> Held:
    """Return those of the stores of one recipe that serve a demand, and what is missing.

    Parameters
    ----------
    chain : components of the run.
    demand : light groups, bands and labels that the run needs.
    stores : root attributes of the stores.
    """
    asked = {} if goes_on(chain) else effort_spent(chain)
    candidates = [s for s in stores if serves(s, demand, asked)]
    # all stores on one grid: radiance with overscan also serves runs without it
    wide = demand.margin or any(s.get("margin", True) for s in candidates)
    best = _on_one_grid(chain, demand, candidates, wide)
    if best.missing is None or demand.margin:
        return best
    narrow = _on_one_grid(chain, demand, candidates, False)
    return narrow if narrow.missing is None else best


def _on_one_grid(
    chain: Chain, demand: Demand, candidates: list[dict[str, Any]], margin: bool
) -> Held:
    """Return the stores with or without overscan that serve a demand, and what is missing."""
    serving = [s for s in candidates if s.get("margin", True) == margin]
    missing = what_is_missing(
        serving,
        replace(demand, margin=margin),
        goes_on(chain),
        limit_share(chain, demand),
        effort_spent(chain),
    )
    return Held(serving, missing)


def stored(folder: Path, recipe: str) -> list[dict[str, Any]]:
    """Return the root attributes of every complete store of a recipe; damaged ones are skipped."""
    attributes = []
    for path in sorted(folder.glob(f"{recipe}-*.zarr")):
        try:
            attributes.append({**store.read_attrs(path), "id": path.stem})
        except CatalogError:
            continue
    return attributes


def serves(attributes: dict[str, Any], demand: Demand, effort_asked: dict[str, Any]) -> bool:
    """Return whether a store has the requested labels, and was made with at least the requested
    effort.

    A label that the renderer was asked for and did not make does not count as missing: it would not
    make it in another rendering either.

    Parameters
    ----------
    attributes : attributes of the store.
    demand : demand whose labels the store must hold.
    effort_asked : {field of the renderer that changes only the accuracy: value requested}.
    """
    # stores of earlier versions do not state the labels asked for
    answered = {*attributes["labels"], *attributes.get("labels_asked", ())}
    return set(demand.labels) <= answered and all(
        attributes["effort"].get(key, 0) >= value for key, value in effort_asked.items()
    )


def what_is_missing(
    stores: list[dict[str, Any]],
    demand: Demand,
    enough: Callable[..., bool] | None = None,
    share: float | None = None,
    effort: dict[str, Any] | None = None,
) -> Demand | None:
    """Return the demand for groups and bands that no store holds; None if all are stored.

    Groups that lack different bands are rendered at all bands that any of them lacks.

    Parameters
    ----------
    stores : root attributes of the stores.
    demand : demand of the run for scene radiance.
    enough : function(paths, noise) -> whether the stored samples of a group suffice; None: they
        always do.
    share : share of the cameras' noise at which the renderer stops; None: another setting decides.
    effort : {field of the renderer that changes only the accuracy: value}, in addition to `share`.
        Fields may end a rendering before it has reached the share; the same fields would end it
        there again.
    """
    if demand.groups is None and not stores:
        return demand
    groups_asked = demand.groups if demand.groups is not None else stores[0]["all_groups"]
    bands = ALL_BANDS if demand.wavelength_nm is None else demand.wavelength_nm
    lacking = {
        group: [b for b in bands if not _groups_have(stores, group, b, enough, (share, effort))]
        for group in groups_asked
    }
    groups = tuple(g for g in groups_asked if lacking[g])
    if not groups:
        return None
    wavelength_nm = demand.wavelength_nm
    if wavelength_nm:
        wavelength_nm = tuple(b for b in wavelength_nm if any(b in lacking[g] for g in groups))
    return replace(demand, groups=groups, wavelength_nm=wavelength_nm)


def _groups_have(
    stores: Sequence[dict[str, Any]],
    group: str,
    band: float | None,
    enough: Callable[..., bool] | None,
    by_noise: tuple[float | None, dict[str, Any] | None],
) -> bool:
    """Return whether stores hold enough of one light group at one band.

    Parameters
    ----------
    stores : root attributes of the stores.
    group : name of the light group.
    band : band centre, nm; None for all bands of the renderer.
    enough : as for `what_is_missing`.
    by_noise : share and effort, as for `what_is_missing`.
    """
    holding = [s for s in stores if holds(s, group, band)]
    if enough is None or not holding or any(group in s["absent_groups"] for s in holding):
        return bool(holding)
    share, effort = by_noise
    if share is not None:
        by_need = [s for s in holding if s.get("limit_share")]
        return any(s["limit_share"] <= share for s in by_need) or (
            effort is not None and any(s["effort"] == effort for s in by_need)
        )
    known_now = known(holding, group, (band,))
    return enough(known_now.paths, known_now.noise)


def goes_on(chain: Chain) -> Callable[..., bool] | None:
    """Return the renderer's method `enough`; None if it cannot continue from stored radiance."""
    return chain.renderer.enough if isinstance(chain.renderer, AccumulatesSamples) else None


def limit_share(chain: Chain, demand: Demand) -> float | None:
    """Return the share of the cameras' noise at which the renderer stops; None if another setting
    decides.
    """
    if demand.noise_limit is None or not isinstance(chain.renderer, MeetsNoiseLimit):
        return None
    return chain.renderer.limit_share()


def known_of(
    chain: Chain, stores: list[dict[str, Any]], missing: Demand, groups: tuple[str, ...]
) -> dict[str, Known] | None:
    """Return the stored samples of each light group at the missing bands; None if the renderer
    cannot continue from them.

    Parameters
    ----------
    chain : components of the run.
    stores : attributes of the stores that hold radiance of the recipe.
    missing : demand for the radiance that has to be rendered.
    groups : light groups of the scene, for a demand that names none.
    """
    if goes_on(chain) is None:
        return None
    bands = ALL_BANDS if missing.wavelength_nm is None else missing.wavelength_nm
    stored = {group: known(stores, group, bands) for group in missing.groups or groups}
    # a single sample is not pooled
    return {group: k if k.paths > 1 else Known(next=k.next) for group, k in stored.items()}
