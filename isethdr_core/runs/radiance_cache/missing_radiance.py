"""Missing radiance: render what no store holds, and store it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...errors import CatalogError
from ...pipeline.chain import stage
from ...sequence.equal_groups import SOURCES
from ...sequence.equal_radiance import CONTENT, GROUP_CONTENTS, find_equal, note
from ...storage import store
from ...storage.encoding import bits_for
from ...storage.radiance_rounding import rounded_by_noise
from ...uncertainty.budget import stored_error
from ...uncertainty.ledger import Ledger
from ..claims import claimed
from ..processor import kernels
from ..provenance import described, fingerprint, input_digests, libraries, versions
from .recipe import effort_spent, recipe_hash, scenes_folder
from .render_request import Request, equal_groups, rendered, rendering_of
from .stored_radiance import held_and_missing, known_of

if TYPE_CHECKING:
    import xarray as xr
    from omegaconf import DictConfig

    from ...data.scene_description import SceneDescription
    from ...pipeline.chain import Chain
    from ...pipeline.demand import Demand


class Completed(NamedTuple):
    """Stores that serve a demand completely."""

    stores: list[dict[str, Any]]  # root attributes of each
    earlier_ids: list[str]  # names of those that were stored before


def completed(
    chain: Chain,
    demand: Demand,
    description: SceneDescription,
    rows: Ledger,
    config: DictConfig,
    by_noise: bool = False,
) -> Completed:
    """Return the stores that serve a demand, after rendering and storing what is missing.

    One process at a time renders a recipe. Another one may have stored the radiance meanwhile.

    Parameters
    ----------
    chain : components of the run.
    demand : light groups, bands and labels that the run needs.
    description : description of the scene.
    rows : ledger that gets the rows of the stages.
    config : composed config of the run.
    by_noise : whether each tile is stored with only those bits that are significant above its
        noise.
    """
    folder = scenes_folder()
    recipe = recipe_hash(chain)
    with _rendering_alone(folder, recipe):
        serving, missing = held_and_missing(chain, demand)
        for path in folder.glob(f"{recipe}-*.zarr"):
            # a damaged store is reported now, not later when the new store cannot replace it
            store.read_attrs(path)
        if missing is None:
            return Completed(serving, _ids(serving))
        renderer, content = rendering_of(chain, description, recipe)
        if content is not None:
            note(folder, recipe, [n for n in find_equal(folder, content.whole) if n != recipe])
            serving, missing = held_and_missing(chain, demand)
            if missing is None:
                return Completed(serving, _ids(serving))
        known = known_of(chain, serving, missing, description.light_groups())
        request = Request(description, missing, renderer, known, by_noise, content)
        if not (serving or by_noise):
            request = replace(request, taken=equal_groups(chain, request))
        rendered = render_and_store(chain, request, recipe, rows, config)
        return Completed([*serving, rendered], _ids(serving))


def _ids(stores: list[dict[str, Any]]) -> list[str]:
    """Return the names of stores by their attributes."""
    return [attributes["id"] for attributes in stores]


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


def render_and_store(
    chain: Chain, request: Request, recipe: str, rows: Ledger, config: DictConfig
) -> dict[str, Any]:
    """Render the missing radiance, store it, and return the root attributes of the new store.

    Parameters
    ----------
    chain : components of the run.
    request : what the renderer is asked for.
    recipe : name of the radiance, by `recipe_hash`.
    rows : ledger that gets the rows of the stages.
    config : composed config of the run.
    """
    renderer = config.renderer.name
    radiance = stage(
        rows,
        "renderer",
        renderer,
        request.renderer,
        lambda: rendered(chain, request, f"renderer {renderer!r}"),
    )
    name = f"{recipe}-{content_of_store(chain, request, radiance)}"
    attributes = attributes_of_store(chain, request, radiance)
    attributes |= {"recipe": recipe, "ledger": rows.as_records()}
    bits = bits_for(stored_error(request.demand))
    if request.by_noise:
        radiance = rounded_by_noise(radiance, bits)
    stage(
        rows,
        "store",
        "scene",
        None,
        lambda: store.write_store(scenes_folder(), name, {"": radiance}, attributes, bits),
    )
    return {**attributes, "id": name}


def content_of_store(chain: Chain, request: Request, radiance: xr.Dataset) -> str:
    """Return eight digits that identify the part of the recipe's radiance that a store holds.

    Parameters
    ----------
    chain : components of the run.
    request : what the renderer was asked for.
    radiance : what it rendered.
    """
    demand = request.demand
    content = [
        sorted(_groups(radiance)),
        sorted(request.groups_asked()),
        sorted(demand.labels),
        demand.wavelength_nm,
        demand.margin,
        effort_spent(chain),
        request.known,
    ]
    sources = radiance.attrs.get(SOURCES, {})
    if sources:
        content.append(sources)
    return store.content_hash(content)[:8]


def attributes_of_store(chain: Chain, request: Request, radiance: xr.Dataset) -> dict[str, Any]:
    """Return the root attributes of a store of rendered radiance, without recipe and ledger.

    Parameters
    ----------
    chain : components of the run.
    request : what the renderer was asked for.
    radiance : what it rendered.
    """
    description = request.description
    demand = request.demand
    groups = _groups(radiance)
    group_contents = request.content.groups if request.content else {}
    return {
        "kind": "scene",
        "name": description.name,
        "groups": groups,
        "all_groups": list(description.light_groups()),
        "absent_groups": [g for g in request.groups_asked() if g not in groups],
        "bands_asked": demand.wavelength_nm,
        "margin": demand.margin,
        "wavelength_nm": [float(w) for w in radiance.wavelength.values],
        "labels": [v for v in radiance.data_vars if v != "radiance"],
        "labels_asked": sorted(demand.labels),
        "effort": effort_spent(chain),
        "scene": described(chain.scene),
        "renderer": described(request.renderer),
        "objects": radiance.attrs.get("objects", []),
        "lamps": radiance.attrs.get("lamps", []),
        "noise": radiance.attrs.get("noise", {}),
        "path_span": radiance.attrs.get("path_span", {}),
        "limit_share": radiance.attrs.get("limit_share"),
        "versions": versions() | libraries(chain.scene, chain.renderer),
        "inputs": input_digests(chain.scene, chain.renderer),
        CONTENT: request.content and request.content.whole,
        GROUP_CONTENTS: {g: n for g, n in group_contents.items() if g in groups},
        SOURCES: radiance.attrs.get(SOURCES, {}),
        "code": fingerprint(chain.scene, chain.renderer),
        "kernels": kernels(chain.scene, chain.renderer),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _groups(radiance: xr.Dataset) -> list[str]:
    """Return the names of the light groups of radiance."""
    return [str(group) for group in radiance.light_group.values]
