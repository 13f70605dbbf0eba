"""Files of third parties that the scenes of a dataset use: asset packs, roads, traffic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from isethdr_scenes.things.packs.pack import Pack, load_pack

from isethdr_core.errors import ConfigError
from isethdr_core.storage.store import home, read_attrs

from .generate import Generated


def pack_lines(dataset: Generated) -> list[str]:
    """Return the lines of the card about packs: folder, digest, and the licence of each thing.

    A line says so if a pack cannot be read any more. Without packs there are no lines.
    """
    lines = []
    for folder in _folders(dataset):
        try:
            lines += _about(load_pack(folder))
        except ConfigError:
            lines.append(f"- `{folder}`: cannot be read now, so its licences are not known")
    return lines


def file_lines(dataset: Generated) -> list[str]:
    """Return one line for each file of roads or traffic that the stored scenes were made with."""
    digests: dict[str, str] = {}
    for attributes in _stored(dataset):
        folders = [Path(folder).resolve() for folder in _packs_of(attributes)]
        for path, digest in attributes.get("inputs", {}).items():
            if not any(Path(path).resolve().is_relative_to(folder) for folder in folders):
                digests[path] = digest
    return [f"- `{path}` (its SHA-256 begins with {digests[path]})" for path in sorted(digests)]


def _folders(dataset: Generated) -> list[str]:
    """Return the packs that the stored scenes name."""
    return sorted({folder for attributes in _stored(dataset) for folder in _packs_of(attributes)})


def _stored(dataset: Generated) -> list[dict[str, Any]]:
    """Return the attributes of the first store of each scene."""
    names = [name for record in dataset.made for name in record.stores[:1]]
    return [read_attrs(home() / "scenes" / f"{name}.zarr") for name in names]


def _packs_of(attributes: dict[str, Any]) -> list[str]:
    return list(attributes.get("scene", {}).get("assets", ()))


def _about(pack: Pack) -> list[str]:
    lines = [f"- `{pack.folder}` (SHA-256 of its files begins with {pack.digest})"]
    for thing in pack.things:
        if thing.asset is not None:
            lines.append(f"  - {thing.asset.name}, {thing.category}: {thing.asset.licence}")
    return lines
