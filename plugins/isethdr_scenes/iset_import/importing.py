"""Scenes of the deposit as stores. Stored scenes are skipped, and damaged ones are reported."""

from __future__ import annotations

import hashlib
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import xarray as xr

from isethdr_core.cli.progress import track
from isethdr_core.cli.terminal import print_path, print_table
from isethdr_core.errors import CatalogError, IsetHdrError
from isethdr_core.runs.provenance import described, fingerprint, versions
from isethdr_core.runs.run import check_writable
from isethdr_core.storage import store
from isethdr_core.uncertainty import ledger

from ..iset_exr import IsetExr
from .tree import FoundScene, Skipped, scan

STORED = "stored"
KNOWN = "already stored"
WRONG = "wrong"
SOURCE = "iset_files"  # attribute of a store: size and change time of its source files
PLACE = ("folder",)  # field of the component that does not change the light


def imported(found: FoundScene, component: IsetExr, known: Sequence[Mapping[str, Any]]) -> Path:
    """Store one scene, and return the path of its store.

    If the scene is stored already and its files have not changed, nothing is written.

    Parameters
    ----------
    found : files of the scene.
    component : reads the scene.
    known : root attributes of the stores of imported scenes, with their `path`.

    Raises
    ------
    IsetHdrError, OSError : a file is damaged or cannot be read, or the store cannot be written.
    """
    stamps = found.stamps()
    scene = described(component, without=PLACE)
    for attributes in known:
        if attributes[SOURCE] == stamps and attributes["scene"] == scene:
            return Path(attributes["path"])
    component.check_files()  # checks the headers before the radiance is read
    rows = ledger.Ledger()
    with ledger.stage(rows, "scene iset_exr"):
        light = component()
    content = {"scene": scene, "code": fingerprint(component), "files": _digests(found.files)}
    recipe = store.content_hash(content)
    return store.write_store(
        store.home() / "scenes",
        f"{recipe}-{store.content_hash(recipe)[:8]}",
        {"": light},
        _attributes(light, scene, recipe)
        | {
            SOURCE: stamps,
            "digests": content["files"],
            "code": content["code"],
            "ledger": rows.as_records(),
        },
    )


def _attributes(light: xr.Dataset, scene: Mapping[str, Any], recipe: str) -> dict[str, Any]:
    """Return those root attributes that stores of rendered radiance also have."""
    groups = [str(group) for group in light["light_group"].values]
    return {
        "kind": "scene",
        "recipe": recipe,
        "name": f"iset_{scene['scene_id']}",
        "groups": groups,
        "all_groups": groups,
        "absent_groups": [],
        "bands_asked": None,
        "margin": False,
        "wavelength_nm": [float(nm) for nm in light["wavelength"].values],
        "labels": [str(name) for name in light.data_vars if name != "radiance"],
        "effort": {},
        "scene": dict(scene),
        "versions": versions(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _digests(paths: Sequence[Path]) -> dict[str, str]:
    digests = {}
    for path in paths:
        with path.open("rb") as file:
            digests[path.name] = hashlib.file_digest(file, "sha256").hexdigest()
    return digests


def known_imports(folder: Path) -> list[dict[str, Any]]:
    """Return the root attributes of the stores that this module wrote, with their `path`."""
    found = []
    for path in sorted(folder.glob("*.zarr")):
        try:
            attributes = store.read_attrs(path)
        except CatalogError:  # `isethdr catalog verify` reports such a store
            continue
        if SOURCE in attributes:
            found.append({**attributes, "path": str(path)})
    return found


def run(folder: str, field_deg: float, normalise_cd_m2: float, look: bool) -> int:
    """Store the scenes below a folder, print the counts of outcomes, and return the number of
    scenes that failed.

    Parameters
    ----------
    folder : any folder of the deposit, with the folders below it.
    field_deg : full horizontal field angle of the scenes, degrees.
    normalise_cd_m2 : mean luminance to which each light group is scaled, cd/m2; 0 keeps the
        radiance.
    look : whether scenes and files are only listed; nothing is stored.

    Raises
    ------
    CatalogError : the folder does not exist or holds no scene, or the home folder cannot be
        written.
    ConfigError : a field angle or a luminance out of range.
    """
    root = Path(folder).expanduser()
    if not root.is_dir():
        raise CatalogError(f"{root} is not a folder; type isethdr import-iset <folder>")
    settings = {"horizontal_field_deg": field_deg, "normalise_cd_m2": normalise_cd_m2}
    IsetExr(**settings)  # raises an error for values out of range before any file is read
    scenes, skipped = scan(root)
    if not scenes:
        raise CatalogError(
            f"{root} and the folders below hold no scene; expected files such as"
            " 1112184733_skymap.exr"
        )
    if look:
        _print_scenes(root, scenes)
        _print_skipped(root, skipped)
        return 0
    target = store.home() / "scenes"
    check_writable(target)
    known = known_imports(target)
    outcome = Counter[str]()
    for found in track(scenes, "importing"):
        try:
            component = IsetExr(str(found.folder), found.scene_id, **settings)
            before = set(target.glob("*.zarr"))
            path = imported(found, component, known)
        except (IsetHdrError, OSError) as error:
            outcome[WRONG] += 1
            print(f"{WRONG}: scene {found.scene_id}: {error}", file=sys.stderr, flush=True)
        else:
            outcome[KNOWN if path in before else STORED] += 1
    _print_skipped(root, skipped)
    print(", ".join(f"{count} {what}" for what, count in sorted(outcome.items())))
    print_path("scenes", target)
    return outcome[WRONG]


def _print_scenes(root: Path, scenes: Sequence[FoundScene]) -> None:
    rows = [
        [s.scene_id, len(s.files), sum(size for size, _ in s.stamps().values()) // 10**6, name]
        for s in scenes
        for name in [s.folder.relative_to(root).as_posix()]
    ]
    print_table(["scene", "files", "MB", "folder"], rows)


def _print_skipped(root: Path, skipped: Sequence[Skipped]) -> None:
    """Print the number of skipped files for each reason, with the first file as an example."""
    first = {s.why: s.path.relative_to(root).as_posix() for s in reversed(skipped)}
    counts = Counter(s.why for s in skipped)
    rows = [[count, why, first[why]] for why, count in sorted(counts.items())]
    if rows:
        print_table(["skipped", "why", "for example"], rows)
