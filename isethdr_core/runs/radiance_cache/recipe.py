"""Recipe: the name of the radiance that a scene and a renderer describe together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...identity.earlier_names import radiance_names
from ...plugins.protocols import NamesItsEffort
from ...sequence.frame_seed import MARK, has_frame_seed
from ...storage import store
from ..provenance import described, fingerprint, input_digests, libraries

if TYPE_CHECKING:
    from ...pipeline.chain import Chain


def scenes_folder() -> Path:
    """Return the folder of the stores of scene radiance."""
    return store.home() / "scenes"


def recipe_hash(chain: Chain) -> str:
    """Return the name of the radiance that the scene and the renderer describe together.

    An earlier name of the same radiance is returned if radiance is stored under that name only.
    """
    content = {
        "scene": described(chain.scene),
        "renderer": described(chain.renderer, without=effort(chain)),
        "code": fingerprint(chain.scene, chain.renderer),
        "versions": libraries(chain.scene, chain.renderer),
    }
    # files that scene and renderer read; without any, the name is the same as in earlier versions
    inputs = input_digests(chain.scene, chain.renderer)
    if inputs:
        content["inputs"] = inputs
    if has_frame_seed(chain.renderer, chain.exposures):  # never stored under an earlier name
        return store.content_hash(content | MARK)
    name = store.content_hash(content)
    folder = scenes_folder()
    if _is_stored(folder, name) or not _is_stored(folder, "*"):
        return name
    earlier = radiance_names(chain.scene, chain.renderer, effort(chain))
    return next((n for n in earlier if _is_stored(folder, n)), name)


def _is_stored(folder: Path, recipe: str) -> bool:
    """Return whether radiance of this name is stored; `*` is any name."""
    return any(folder.glob(f"{recipe}-*.zarr"))


def effort(chain: Chain) -> tuple[str, ...]:
    """Return the renderer's fields that change only the accuracy."""
    renderer = chain.renderer
    return tuple(renderer.effort_fields) if isinstance(renderer, NamesItsEffort) else ()


def effort_spent(chain: Chain) -> dict[str, Any]:
    """Return the values of the renderer's fields that change only the accuracy."""
    return {f: getattr(chain.renderer, f) for f in effort(chain)}
