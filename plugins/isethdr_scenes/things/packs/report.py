"""The table of `isethdr things check`: the things of a pack."""

from __future__ import annotations

from isethdr_core.cli.terminal import print_table

from ...materials import MATERIALS
from .asset import AssetThing
from .pack import load_pack


def report(folder: str) -> None:
    """Print a row per thing of a pack.

    Raises
    ------
    ConfigError : the pack has mistakes.
    """
    pack = load_pack(folder)
    print_table(COLUMNS, [_row(thing) for thing in pack.things], f"asset pack {folder}")


COLUMNS = (
    "thing",
    "group",
    "family",
    "category",
    "length x width x height m",
    "triangles near, middle, far, distant",
    "lamps",
    "share",
    "licence",
)


def _row(thing: AssetThing) -> tuple[str, ...]:
    asset = thing.asset
    assert asset is not None
    lamps = [f"{p.lamp.kind} {p.lamp.intensity_cd:.4g} cd" for p in asset.mesh.parts if p.lamp]
    return (
        asset.name,
        thing.group,
        thing.family,
        thing.category,
        " x ".join(f"{side:.2f}" for side in thing.size_m),
        ", ".join(map(str, asset.triangles())),
        ", ".join(lamps) or "none",
        f"{asset.share:.2g}",
        asset.licence,
    )


def print_materials() -> None:
    """Print the names of all materials that a manifest may give to a part."""
    print(", ".join(sorted(MATERIALS)))
