"""The scenes of pairs: all scenes of a dataset, or one stored scene. Nothing is rendered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage.home_folder import home

from ..generate import generated
from ..record import DEFINITION, folder_of, read_dataset
from .request import PairRequest


@dataclass(frozen=True)
class Source:
    """One scene to make pairs of."""

    name: str  # name of its folder: the number of the scene, or the name of its store
    road: str
    overrides: tuple[str, ...]  # overrides of its run
    store: str  # name of its store in `scenes/` of the home folder


def sources(request: PairRequest) -> list[Source]:
    """Return the scenes of a request, with the overrides of their runs.

    Raises
    ------
    ConfigError : the dataset has no scene yet.
    CatalogError : there is neither a dataset nor a stored scene of this name.
    """
    own = ("report=false", *request.overrides)
    if not (folder_of(request.name) / DEFINITION).exists():
        return [Source(_stored(request.name), "", own, _stored(request.name))]
    made = generated(read_dataset(request.name)).made
    if not made:
        raise ConfigError(
            f"the dataset {request.name!r} has no scene yet; expected at least one; type for"
            f" example isethdr dataset generate {request.name}"
        )
    found = [
        Source(f"{record.number:05d}", record.road, (*record.overrides, *own), record.stores[0])
        for record in made
    ]
    return found[: request.scenes]


def families(found: Sequence[Source]) -> list[Source]:
    """Return the first scene of each set of overridden config keys. Checking these scenes finds a
    mistake in any of the sets.
    """
    kinds: dict[frozenset[str], Source] = {}
    for source in found:
        keys = frozenset(text.partition("=")[0] for text in source.overrides)
        kinds.setdefault(keys, source)
    return list(kinds.values())


def _stored(name: str) -> str:
    """Return the name of a stored scene by the beginning of its name or of its recipe.

    Raises
    ------
    CatalogError : there is no such scene, or there are several.
    """
    stored = (path.stem for path in (home() / "scenes").glob("*.zarr"))
    found = sorted(stem for stem in stored if stem.startswith(name))
    recipes = {path.partition("-")[0] for path in found}
    if len(recipes) == 1:
        return found[0]
    known = sorted(path.parent.name for path in home().glob(f"datasets/*/{DEFINITION}"))
    what = f"{len(recipes)} stored scenes begin with" if recipes else "no dataset or scene is named"
    raise CatalogError(
        f"{what} {name!r} in {home()}; expected a dataset ({', '.join(known) or 'none yet'}) or one"
        " name of a folder in scenes/; type for example isethdr dataset list"
    )
