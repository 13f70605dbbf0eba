"""Scene radiance by recipe: read stored radiance, and render only the missing part.

A recipe is the scene, the renderer and their code, without demand and weights. A renderer lists in
`effort_fields` the fields that only buy accuracy (for example `samples`): a store made with at
least the requested effort serves a run. A renderer with a method `enough(paths, noise)` continues
from stored radiance instead. Its stores are pooled (`sample_accumulation`), and the renderer
receives `{group: Known}` with the stored paths of each light group.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..data.scene_description import SceneDescription
from ..errors import CatalogError, ConfigError
from ..identity.earlier_names import radiance_names
from ..pipeline.bands import of_demand
from ..pipeline.chain import Chain, stage
from ..pipeline.demand import Demand
from ..pipeline.early_checks import check_contents, check_lightings
from ..plugins.protocols import AccumulatesSamples, MeetsNoiseLimit, NamesItsEffort
from ..sequence.equal_content import contents_of
from ..sequence.equal_groups import (
    SOURCES,
    LimitBeside,
    Taken,
    TooNoisy,
    Wanted,
    find_groups,
    groups_of,
    taken_over,
)
from ..sequence.equal_groups import opened as opened_groups
from ..sequence.equal_radiance import (
    CONTENT,
    GROUP_CONTENTS,
    ContentNames,
    content_names,
    find_equal,
    note,
    noted,
)
from ..sequence.frame_seed import MARK, has_frame_seed, with_frame_seed
from ..storage import store
from ..storage.encoding import bits_for, rounding
from ..storage.join import join_scenes
from ..storage.radiance_rounding import rounded_by_noise
from ..uncertainty.budget import stored_error
from ..uncertainty.error_terms import RELATIVE, ErrorTerm, Quantity, Source
from ..uncertainty.ledger import Ledger, error, left_out, record
from .claims import claimed
from .processor import kernels
from .provenance import described, fingerprint, input_digests, libraries, versions
from .sample_accumulation import ALL_BANDS, Known, holds, known

if TYPE_CHECKING:
    import xarray as xr
    from omegaconf.dictconfig import DictConfig

    from ..plugins.protocols import Scene

ROUNDING = "store rounding"  # key of the rounding of stored radiance
NOISE = "accumulated noise"  # key of the noise of several renderings together; part: light group


def recipe_hash(chain: Chain) -> str:
    """Return the name of the radiance that the scene and the renderer describe together.

    An earlier name of the same radiance is returned where only that one is stored.
    """
    content = {
        "scene": described(chain.scene),
        "renderer": described(chain.renderer, without=effort(chain)),
        "code": fingerprint(chain.scene, chain.renderer),
        "versions": libraries(chain.scene, chain.renderer),
    }
    # files that a scene is made of; without any, the name is that of earlier versions
    inputs = input_digests(chain.scene)
    if inputs:
        content["inputs"] = inputs
    if has_frame_seed(chain.renderer, chain.exposures):  # never stored under an earlier name
        return store.content_hash(content | MARK)
    name = store.content_hash(content)
    folder = store.home() / "scenes"
    if _is_stored(folder, name) or not _is_stored(folder, "*"):
        return name
    earlier = radiance_names(chain.scene, chain.renderer, effort(chain))
    return next((n for n in earlier if _is_stored(folder, n)), name)


def _is_stored(folder: Path, recipe: str) -> bool:
    """Return whether radiance of this name is stored; `*` is any name."""
    return any(folder.glob(f"{recipe}-*.zarr"))


def effort(chain: Chain) -> tuple[str, ...]:
    """Return the renderer's fields that buy accuracy only."""
    renderer = chain.renderer
    return tuple(renderer.effort_fields) if isinstance(renderer, NamesItsEffort) else ()


def scene_radiance(
    chain: Chain, demand: Demand, rows: Ledger, config: DictConfig, by_noise: bool = False
) -> tuple[xr.Dataset, list[str]]:
    """Return (scene radiance, store ids). Stored radiance is read; missing radiance is rendered and
    stored.

    A scene that provides its own radiance (a chart, a file) needs no renderer and is not stored.

    Parameters
    ----------
    chain : components of the run.
    demand : light groups, bands and labels that the run needs.
    rows : ledger that gets the rows of the stages.
    config : composed config of the run.
    by_noise : whether radiance is stored with as many bits as its noise leaves meaning.
    """
    if chain.renderer is None:
        return (
            of_demand(
                _known(
                    chain,
                    stage(
                        rows,
                        "scene",
                        config.scene.name,
                        chain.scene,
                        lambda: rendered_now(chain.scene),
                    ),
                ),
                demand,
            ),
            [],
        )
    recipe = recipe_hash(chain)
    folder = store.home() / "scenes"
    serving, missing = held_and_missing(chain, demand)
    earlier_ids = [s["id"] for s in serving]
    if missing:
        description = stage(
            rows, "scene", config.scene.name, chain.scene, lambda: rendered_now(chain.scene)
        )
        if not isinstance(description, SceneDescription):
            return _known(chain, description), []
        check_contents(description, chain.renderer)
        # before the rendering, which takes longest
        check_lightings(description.light_groups(), chain.lighting, tuple(chain.versions.values()))
        with _rendering_alone(folder, recipe):
            serving, missing = held_and_missing(chain, demand)  # another process may have stored it
            earlier_ids = [s["id"] for s in serving]
            for path in folder.glob(f"{recipe}-*.zarr"):
                # a damaged one is named now, not when the new one cannot take its place
                store.read_attrs(path)
            content = None
            if missing:
                renderer, content = rendering_of(chain, description, recipe)
            if missing and content:
                note(folder, recipe, [n for n in find_equal(folder, content.whole) if n != recipe])
                serving, missing = held_and_missing(chain, demand)
                earlier_ids = [s["id"] for s in serving]
            if missing:
                so_far = known_of(chain, serving, missing, description.light_groups())
                request = _Request(description, missing, renderer, so_far, by_noise, content)
                if not (serving or by_noise):
                    request = request._replace(taken=_equal_groups(chain, request, folder))
                serving.append(_render(chain, request, recipe, rows, config))
    return stage(
        rows, "radiance", "", None, lambda: opened(folder, serving, demand, rows, earlier_ids)
    ), [s["id"] for s in serving]


class Rendering(NamedTuple):
    """A renderer and what it is given."""

    renderer: Any  # as it renders: in a sequence with the seed of the frame
    content: ContentNames | None  # None if a plugin's part of the description is no plain data


def rendering_of(chain: Chain, description: SceneDescription, recipe: str) -> Rendering:
    """Return the rendering of a description, by whose names equal light is recognised.

    Parameters
    ----------
    chain : components of the run.
    description : description of the scene.
    recipe : name of the radiance, by `recipe_hash`.
    """
    contents = contents_of(description)
    renderer = chain.renderer
    if has_frame_seed(renderer, chain.exposures):
        renderer = with_frame_seed(renderer, contents.surfaces if contents else recipe)
    content = contents and content_names(contents, renderer, effort(chain))
    return Rendering(renderer, content)


def is_equal_stored(chain: Chain, demand: Demand, content: ContentNames) -> bool:
    """Return whether stored radiance of the same content, of any recipe, serves the demand.

    Parameters
    ----------
    chain : components of the run.
    demand : light groups, bands and labels that the run needs.
    content : names of the content of the scene's description.
    """
    folder = store.home() / "scenes"
    recipes = find_equal(folder, content.whole)
    return any(_held(chain, demand, stored(folder, recipe))[1] is None for recipe in recipes)


def _equal_groups(chain: Chain, request: _Request, folder: Path) -> list[Taken]:
    """Return the light groups of a request whose light is that of stores of other frames; none
    outside sequences, where light by need would depend on what is stored.
    """
    demand = request.demand
    content = request.content
    if content is None or chain.exposures is None:
        return []
    asked = demand.groups or request.description.light_groups()
    contents = {g: name for g, name in content.groups.items() if g in asked}

    def precise(attributes: dict, group: str) -> bool:
        alone = replace(demand, groups=(group,), labels=frozenset())
        return _held(chain, alone, [attributes])[1] is None

    wanted = Wanted(contents, demand, bits_for(stored_error(demand)))
    return find_groups(folder, wanted, precise)


@contextmanager
def _rendering_alone(folder: Path, recipe: str) -> Iterator[None]:
    """Let one process at a time render a recipe. The others print a message and wait."""
    with ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            stack.enter_context(
                claimed(folder, recipe, partial(print, file=sys.stderr, flush=True))
            )
        except OSError as error:
            raise CatalogError(
                f"cannot write scenes into {folder}: {error.strerror}; choose another folder with"
                " ISETHDR_HOME=/path"
            ) from error
        yield


def effort_spent(chain: Chain) -> dict:
    """Return the values of the renderer's fields that buy accuracy only."""
    return {f: getattr(chain.renderer, f) for f in effort(chain)}


def held_and_missing(chain: Chain, demand: Demand) -> tuple[list[dict], Demand | None]:
    """Return the attributes of the stores that serve `demand`, and the demand for the missing part;
    None if nothing is missing.

    Stores of another recipe with equal content serve where they hold everything.
    """
    if chain.renderer is None:
        return [], None
    folder = store.home() / "scenes"
    recipe = recipe_hash(chain)
    own = _held(chain, demand, stored(folder, recipe))
    if own[1] is None:
        return own
    equal = (_held(chain, demand, stored(folder, other)) for other in noted(folder, recipe))
    return next((held for held in equal if held[1] is None), own)


def _held(chain: Chain, demand: Demand, stores: list[dict]) -> tuple[list[dict], Demand | None]:
    """Return those of the stores of one recipe that serve a demand, and what is missing."""
    asked = {} if goes_on(chain) else effort_spent(chain)
    candidates = [s for s in stores if serves(s, demand, asked)]
    # all stores on one grid: radiance with overscan also serves runs without it
    wide = demand.margin or any(s.get("margin", True) for s in candidates)
    serving = [s for s in candidates if s.get("margin", True) == wide]
    on_grid = replace(demand, margin=wide)
    return serving, what_is_missing(serving, on_grid, goes_on(chain), limit_share(chain, demand))


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
    chain: Chain, stores: list[dict], missing: Demand, groups: tuple[str, str]
) -> dict[str, Known] | None:
    """Return the stored paths of each light group at the missing bands; None if the renderer cannot
    continue from them.

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
    # one path alone is not pooled
    return {group: k if k.paths > 1 else Known(next=k.next) for group, k in stored.items()}


def rendered_now(scene: Scene) -> SceneDescription | xr.Dataset:
    """Return the result of a scene plugin. A scene description defines the scene, so its error is
    0.
    """
    result = scene()
    if isinstance(result, SceneDescription):
        error(0.0, "m", "bound", "geometry, materials and lamps are exact by definition")
    return result


def opened(
    folder: Path, stores: list[dict], demand: Demand, rows: Ledger, earlier_ids: Sequence[Any] = ()
) -> xr.Dataset:
    """Return the radiance of all stores as one lazy Dataset. Restate the errors of those that an
    earlier run rendered.

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
    pooled = "paths" in all_groups.attrs  # then their noise together is stated
    record(*(t for t in terms if t not in stated and not (pooled and t.how == "statistical")))
    _record_pooled(all_groups, stores, earlier_ids, stated)
    joined = of_demand(all_groups, demand)
    return joined.assign_attrs(
        rendered_s=sum(
            row["seconds"]
            for s in stores
            for row in s["ledger"]
            if row["stage"].startswith("renderer")
        )
    )


def rounding_term(largest: float) -> ErrorTerm:
    """Return the term of stored radiance whose mantissa is rounded by at most `largest`,
    relative.
    """
    label = "radiance as stored, rounded in its mantissa"
    source = Source("radiance", key=ROUNDING)
    return ErrorTerm(source, Quantity.RADIANCE, None, largest, RELATIVE, "bound", label)


def _record_pooled(
    joined: xr.Dataset,
    stores: Sequence[dict[str, float | str] | dict[str, str]],
    earlier_ids: Sequence[Any],
    terms: Sequence[ErrorTerm],
) -> None:
    """State the noise of each light group of pooled stores, and how many of their paths were there
    before this run.
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


def what_is_missing(
    stores: list[dict],
    demand: Demand,
    enough: Callable[..., bool] | None = None,
    share: float | None = None,
) -> Demand | None:
    """Return the demand for groups and bands that no store holds; None if all are stored.

    Groups that lack different bands are rendered at all bands that any of them lacks.

    Parameters
    ----------
    stores : root attributes of the stores.
    demand : demand of the run for scene radiance.
    enough : function(paths, noise) -> whether stored paths of a group suffice; None: they always
        do.
    share : share of the cameras' noise at which the renderer stops; None: another setting decides.
    """
    if demand.groups is None and not stores:
        return demand
    groups_asked = demand.groups if demand.groups is not None else stores[0]["all_groups"]
    bands = ALL_BANDS if demand.wavelength_nm is None else demand.wavelength_nm
    lacking = {
        group: [b for b in bands if not _groups_have(stores, group, b, enough, share)]
        for group in groups_asked
    }
    groups = tuple(g for g in groups_asked if lacking[g])
    if not groups:
        return None
    return replace(
        demand,
        groups=groups,
        wavelength_nm=demand.wavelength_nm
        and tuple(b for b in bands if any(b in lacking[g] for g in groups)),
    )


def _groups_have(
    stores: Sequence[dict[str, float | str]],
    group: str,
    band: float | None,
    enough: Callable[..., bool] | None,
    share: float,
) -> bool:
    holding = [s for s in stores if holds(s, group, band)]
    if enough is None or not holding or any(group in s["absent_groups"] for s in holding):
        return bool(holding)
    if share is not None:
        return any((s.get("limit_share") or float("inf")) <= share for s in holding)
    known_now = known(holding, group, (band,))
    return enough(known_now.paths, known_now.noise)


def _known(chain: Chain, scene: xr.Dataset) -> xr.Dataset:
    if isinstance(scene, SceneDescription):
        raise ConfigError(
            f"scene {scene.name!r} is geometry and needs a renderer; type for example"
            " renderer=mitsuba"
        )
    return scene


def stored(folder: Path, recipe: str) -> list[dict]:
    """Return the root attributes of every complete store of a recipe; damaged ones are skipped."""
    attributes = []
    for path in sorted(folder.glob(f"{recipe}-*.zarr")):
        try:
            attributes.append({**store.read_attrs(path), "id": path.stem})
        except CatalogError:
            continue
    return attributes


def serves(attributes: dict, demand: Demand, effort_asked: dict) -> bool:
    """Return whether a store has the requested labels, and was made with at least the requested
    effort.

    Parameters
    ----------
    attributes : attributes of the store.
    demand : demand whose labels the store must hold.
    effort_asked : {field of the renderer that buys accuracy: value requested}.
    """
    return set(demand.labels) <= set(attributes["labels"]) and all(
        attributes["effort"].get(key, 0) >= value for key, value in effort_asked.items()
    )


class _Request(NamedTuple):
    """Arguments of a call of the renderer."""

    description: SceneDescription
    demand: Demand  # groups and bands that are missing
    renderer: Any  # with its seed
    # by light group; None: the renderer cannot continue from stored paths
    known: dict[str, Known] | None
    by_noise: bool = False  # store each tile with the bits that its noise leaves meaning
    content: ContentNames | None = None  # by which frames that show the same are recognised
    taken: list[Taken] = []  # light groups of other frames, which are not rendered

    def of_rest(self, share: float | None, folder: Path) -> _Request:
        """Return the request for the groups that are not taken over.

        Parameters
        ----------
        share : noise at which the renderer stops, over that of the cameras; None: another setting
            decides.
        folder : folder of scene stores.
        """
        taken = groups_of(self.taken)
        asked = self.demand.groups or self.description.light_groups()
        rest = tuple(group for group in asked if group not in taken)
        demand = replace(self.demand, groups=rest)
        if share is not None and demand.noise_limit is not None:
            others = opened_groups(folder, self.taken)
            demand = replace(demand, noise_limit=LimitBeside(demand.noise_limit, others, share))
        known_rest = self.known and {group: self.known[group] for group in rest}
        return self._replace(demand=demand, known=known_rest)

    def render(self) -> xr.Dataset:
        """Return what the renderer makes of the request."""
        if self.known is None:
            return self.renderer(self.description, self.demand)
        return self.renderer(self.description, self.demand, self.known)


def _radiance(chain: Chain, request: _Request, folder: Path) -> xr.Dataset:
    """Return the radiance of a request: rendered, or taken over from other frames."""
    if not request.taken:
        return request.render()
    try:
        scene = request.of_rest(limit_share(chain, request.demand), folder).render()
    except TooNoisy:
        left_out(
            f"light groups {', '.join(groups_of(request.taken))} of other frames",
            "not taken over: they are too noisy for the light of this frame",
            0.0,
            "relative",
            key="equal groups",
        )
        return request.render()
    return taken_over(folder, scene, request.taken, request.description.light_groups())


def _render(chain: Chain, request: _Request, recipe: str, rows: Ledger, config: DictConfig) -> dict:
    """Render the missing radiance, store it, and return the root attributes of the new store."""
    description = request.description
    demand = request.demand
    so_far = request.known
    folder = store.home() / "scenes"
    radiance = stage(
        rows,
        "renderer",
        config.renderer.name,
        request.renderer,
        lambda: _radiance(chain, request, folder),
    )
    effort_asked = effort_spent(chain)
    groups = [str(g) for g in radiance.light_group.values]
    groups_asked = demand.groups if demand.groups is not None else description.light_groups()
    named = request.content.groups if request.content else {}
    content = [
        sorted(groups),
        sorted(groups_asked),
        sorted(demand.labels),
        demand.wavelength_nm,
        demand.margin,
        effort_asked,
        so_far,
    ]
    sources = radiance.attrs.get(SOURCES, {})
    if sources:
        content.append(sources)
    name = f"{recipe}-{store.content_hash(content)[:8]}"
    attributes = {
        "kind": "scene",
        "recipe": recipe,
        "name": description.name,
        "groups": groups,
        "all_groups": list(description.light_groups()),
        "absent_groups": [g for g in groups_asked if g not in groups],
        "bands_asked": demand.wavelength_nm,
        "margin": demand.margin,
        "wavelength_nm": [float(w) for w in radiance.wavelength.values],
        "labels": [v for v in radiance.data_vars if v != "radiance"],
        "effort": effort_asked,
        "scene": described(chain.scene),
        "renderer": described(request.renderer),
        "objects": radiance.attrs.get("objects", []),
        "lamps": radiance.attrs.get("lamps", []),
        "noise": radiance.attrs.get("noise", {}),
        "path_span": radiance.attrs.get("path_span", {}),
        "limit_share": radiance.attrs.get("limit_share"),
        "versions": versions() | libraries(chain.scene, chain.renderer),
        "inputs": input_digests(chain.scene),
        CONTENT: request.content and request.content.whole,
        GROUP_CONTENTS: {g: n for g, n in named.items() if g in groups},
        SOURCES: sources,
        "code": fingerprint(chain.scene, chain.renderer),
        "kernels": kernels(chain.scene, chain.renderer),
        "ledger": rows.as_records(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    bits = bits_for(stored_error(demand))
    if request.by_noise:
        radiance = rounded_by_noise(radiance, bits)
    stage(
        rows,
        "store",
        "scene",
        None,
        lambda: store.write_store(folder, name, {"": radiance}, attributes, bits),
    )
    return {**attributes, "id": name}
