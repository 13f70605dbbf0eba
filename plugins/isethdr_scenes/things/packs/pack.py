"""An asset pack: read a folder as a whole, and report all its mistakes at once."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from isethdr_core.errors import ConfigError

from ..ranges import read
from ..registry import GROUPS, RIDDEN
from ..riding import RidingPosition
from ..stock import Stock
from .asset import Asset, AssetThing, as_one, assembled, in_metres, size_of
from .entries import category_of, entry_mistakes
from .manifest import NAME, Riding, ThingForm, read_manifest
from .mesh_file import SUFFIXES, read_mesh
from .soundness import mesh_mistakes, number_mistakes, size_mistakes

# endings of the files that belong to a pack: meshes, their materials and textures, beams
READ = (*SUFFIXES, ".mtl", ".png", ".jpg", ".jpeg", ".tga", ".bmp", ".ies", ".ldt")
MOST_TRIANGLES = 150_000  # largest number of triangles of a thing


@dataclass(frozen=True)
class Pack:
    """The things of a folder."""

    folder: str
    digest: str  # digest of the bytes of its files
    things: tuple[AssetThing, ...]


def pack_files(folder: str) -> tuple[Path, ...]:
    """Return the manifest and the files that a pack may read, sorted."""
    root = Path(folder)
    inside = [p for p in root.rglob("*") if p.suffix.lower() in READ and p.is_file()]
    return tuple(sorted([root / NAME, *inside]))


def load_pack(folder: str) -> Pack:
    """Return a pack. A pack is read again only if the bytes of its files have changed.

    Raises
    ------
    ConfigError : there is no such folder or manifest, or it has mistakes; the message lists all
        mistakes, thing by thing.
    """
    if not Path(folder).is_dir():
        raise ConfigError(
            f"there is no folder {folder!r}; expected an asset pack: a folder with {NAME} (type"
            " isethdr things check FOLDER)"
        )
    return _loaded(folder, _digest(folder))


def stock_of(folders: Iterable[str]) -> Stock:
    """Return the bundled families with the things of packs.

    Raises
    ------
    ConfigError : a pack has mistakes, or the shares of a group exceed 1 in total.
    """
    things = [thing for folder in folders for thing in load_pack(folder).things]
    mistakes = share_mistakes(things)
    if mistakes:
        raise ConfigError(f"the asset packs {', '.join(folders)}: " + "; ".join(mistakes))
    return Stock(tuple(things))


def _digest(folder: str) -> str:
    """Return a digest of the names and bytes of a pack's files."""
    total = hashlib.sha256()
    for path in pack_files(folder):
        content = path.read_bytes() if path.is_file() else b""
        total.update(str(path.relative_to(folder)).encode())
        total.update(hashlib.sha256(content).digest())
    return total.hexdigest()[:16]


@lru_cache(maxsize=8)
def _loaded(folder: str, digest: str) -> Pack:
    told = read_manifest(Path(folder))
    mistakes = list(told.mistakes)
    things: list[AssetThing] = []
    for name, form in told.things.items():
        thing, wrong = _thing(name, form, told.licence, Path(folder), digest)
        mistakes += [f"{name} ({form.file}): {mistake}" for mistake in wrong]
        if thing is not None:
            things.append(thing)
    mistakes += share_mistakes(things)
    if mistakes:
        count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
        rows = "\n".join(f"  - {mistake}" for mistake in mistakes)
        raise ConfigError(f"the asset pack {folder} has {count}:\n{rows}")
    return Pack(folder, digest, tuple(things))


def _thing(
    name: str, form: ThingForm, licence: str, root: Path, digest: str
) -> tuple[AssetThing | None, list[str]]:
    """Return a thing, or None and its mistakes."""
    mistakes = list(entry_mistakes(name, form, licence, root))
    if mistakes:
        return None, mistakes
    try:
        parts = read_mesh(root / form.file)
    except ConfigError as error:
        return None, [str(error)]
    mistakes = number_mistakes(as_one(parts)[0])
    if mistakes:
        return None, mistakes
    parts = in_metres(parts, form)
    whole = as_one(parts)
    mistakes = mesh_mistakes(*whole, form.open)
    if mistakes:
        return None, mistakes
    size = size_of(parts)
    mistakes = size_mistakes(size, read("asset_sizes.yaml")[_plain(form.group)], form.group)
    count = len(whole[1])
    if count > MOST_TRIANGLES:
        mistakes.append(f"it has {count} triangles; expected at most {MOST_TRIANGLES}; simplify it")
    mesh, wrong = assembled(parts, form, name, root)
    mistakes += wrong
    if mistakes:
        return None, mistakes
    families = GROUPS[form.group].shares()
    asset = Asset(
        name,
        digest,
        form.licence or licence,
        form.file,
        form.share or 1 / (len(families) + 1),
        mesh,
    )
    family = form.family or name
    category = form.category or category_of(form.group, family)
    riding = _riding(form.riding) if form.group in RIDDEN and form.riding else None
    return AssetThing(family, 0, category, size, form.group, riding=riding, asset=asset), []


def _plain(group: str) -> str:
    """Return the group with the size limits of a group; trees of all seasons share `tree`."""
    return "tree" if group.endswith(" tree") else group


def _riding(form: Riding) -> RidingPosition:
    left = form.grip
    foot = form.foot
    right = (left[0], -left[1], left[2])
    return RidingPosition(form.saddle, (left, right), (foot, (foot[0], -foot[1], foot[2])))


def share_mistakes(things: Iterable[AssetThing]) -> list[str]:
    """Return a message for each group with shares that exceed 1 in total."""
    total: dict[str, float] = defaultdict(float)
    for thing in things:
        assert thing.asset is not None
        total[thing.group] += thing.asset.share
    return [
        f"the shares of the group {group} add up to {share:.3g}; expected at most 1"
        for group, share in total.items()
        if share > 1 + 1e-9
    ]
