"""Asset packs behind the scenes of a dataset, with their licences."""

from __future__ import annotations

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


def _folders(dataset: Generated) -> list[str]:
    """Return the packs that the stored scenes name."""
    found: set[str] = set()
    for record in dataset.made:
        for name in record.stores[:1]:
            scene = read_attrs(home() / "scenes" / f"{name}.zarr").get("scene", {})
            found |= set(scene.get("assets", ()))
    return sorted(found)


def _about(pack: Pack) -> list[str]:
    lines = [f"- `{pack.folder}` (SHA-256 of its files begins with {pack.digest})"]
    for thing in pack.things:
        if thing.asset is not None:
            lines.append(f"  - {thing.asset.name}, {thing.category}: {thing.asset.licence}")
    return lines
