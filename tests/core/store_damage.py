"""Systematic damages of a store, and their effect on a reader: the same data, a named error, or
silence.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from isethdr_core.data import quantities as q
from isethdr_core.errors import CatalogError
from isethdr_core.storage import store

GROUPS = ("", "captures/bayer", "picture/bayer", "truth/bayer")
ROWS = 24
COLUMNS = 40


class Damage(NamedTuple):
    """One way to damage a store; an error must name at least one of the files `names`."""

    what: str
    apply: Callable[[Path], None]
    names: tuple[str, ...]


def datasets(seed: int) -> dict[str, xr.Dataset]:
    """Return a small scene with captures, picture and labels; all seeds give files of the same
    sizes.
    """
    random = np.random.default_rng(seed)
    light = random.lognormal(0, 3, (2, 3, ROWS, COLUMNS))
    axes = np.linspace(450, 650, 3), q.centres(COLUMNS, 0.8), q.centres(ROWS, 0.5)
    scene = q.scene_radiance(
        light,
        ("sky", "street"),
        *axes,
        distance=random.uniform(1, 99, (ROWS, COLUMNS)).astype("f4"),
        instance=np.full((ROWS, COLUMNS), 1 + seed % 2, "u4"),
    )
    raw = random.integers(0, 1 << 12, (2, ROWS, COLUMNS)).astype("u2")
    flags = np.zeros((2, ROWS, COLUMNS), bool)
    flags[:, seed % ROWS] = True
    planes = ("capture", "y", "x")
    captures = xr.Dataset(
        {"raw": (planes, raw, {"units": "DN"}), "saturated": (planes, flags)},
        coords={"exposure_s": ("capture", [0.01 + seed, 0.02 + seed])},
        attrs={"f_number": 4.0 + seed},
    )
    xyz = random.random((ROWS, COLUMNS, 3))
    picture = xr.Dataset({"xyz": (("y", "x", "xyz_channel"), xyz), "valid": (("y", "x"), flags[0])})
    truth = xr.Dataset({"category": (("y", "x"), np.full((ROWS, COLUMNS), 1 + seed % 2, "u2"))})
    return dict(zip(GROUPS, (scene, captures, picture, truth), strict=True))


def write(folder: Path, seed: int = 0) -> Path:
    """Write the store `s` into `folder`."""
    attributes = {"kind": "run", "seed": seed, "scores": [{"metric": "ssim", "value": 0.5 + seed}]}
    return store.write_store(folder, "s", datasets(seed), attributes)


def read(path: Path) -> dict[str, xr.Dataset]:
    """Read all of a store through the public calls."""
    found = {"attributes": xr.Dataset(attrs=store.read_attrs(path))}
    return found | {group: store.open_store(path, group).load() for group in GROUPS}


def outcome(path: Path, original: dict[str, xr.Dataset]) -> str:
    """Return "same", "silent" where values differ without an error, or the error."""
    try:
        found = read(path)
    except CatalogError as error:
        return str(error)
    same = all(found[key].identical(original[key]) for key in original)
    return "same" if same else "silent"


def files(path: Path) -> list[str]:
    """Return the paths of all files of a store."""
    return sorted(f.relative_to(path).as_posix() for f in path.rglob("*") if f.is_file())


def damages(path: Path, older: Path) -> Iterator[Damage]:
    """Yield every damage of the store `path`; `older` is another store of the same form.

    Each file is deleted, emptied, cut off, extended, changed by one bit at three places, and
    replaced by the file of the older store. Files of equal size are exchanged. Attributes and
    metadata are edited. Arrays and groups are deleted or replaced as a whole.
    """
    for file in files(path):
        size = (path / file).stat().st_size
        yield Damage(f"delete {file}", lambda p, f=file: (p / f).unlink(), (file,))
        for length in dict.fromkeys((0, size // 2, size - 1)):
            yield Damage(f"cut {file} to {length}", _resized(file, length), (file,))
        yield Damage(f"extend {file}", _resized(file, size + 4), (file,))
        for place in dict.fromkeys((0, size // 2, size - 1)):
            yield Damage(f"bit of {file} at {place}", _flipped(file, place), (file,))
        if (older / file).read_bytes() != (path / file).read_bytes():
            yield Damage(f"older {file}", _replaced(older, file), (file, "zarr.json"))
        if file.endswith("zarr.json"):
            for edit in EDITS:
                yield Damage(f"{edit.__name__} in {file}", _edited(file, edit), (file,))
    yield from _exchanges(path)
    for folder in sorted({Path(file).parent.as_posix() for file in files(path)} - {"."}):
        if (path / folder / "zarr.json").exists():
            inside = tuple(f for f in files(path) if f.startswith(f"{folder}/"))
            yield Damage(f"delete {folder}", lambda p, f=folder: shutil.rmtree(p / f), inside)
            if any((older / file).read_bytes() != (path / file).read_bytes() for file in inside):
                yield Damage(f"older {folder}", _replaced(older, folder), (*inside, "zarr.json"))


def _exchanges(path: Path) -> Iterator[Damage]:
    content = {file: (path / file).read_bytes() for file in files(path)}
    for one, other in combinations(content, 2):
        if len(content[one]) == len(content[other]) and content[one] != content[other]:
            yield Damage(f"exchange {one} and {other}", _exchanged(one, other), (one, other))


def _resized(file: str, length: int) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        with open(path / file, "r+b") as out:
            out.truncate(length)

    return apply


def _flipped(file: str, place: int) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        data = bytearray((path / file).read_bytes())
        data[place] ^= 1
        (path / file).write_bytes(data)

    return apply


def _replaced(older: Path, name: str) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        if (older / name).is_dir():
            shutil.rmtree(path / name)
            shutil.copytree(older / name, path / name)
        else:
            shutil.copy(older / name, path / name)

    return apply


def _exchanged(one: str, other: str) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        (path / one).rename(path / "aside")
        (path / other).rename(path / one)
        (path / "aside").rename(path / other)

    return apply


def _edited(file: str, edit: Callable[[str], str]) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        text = (path / file).read_text()
        changed = edit(text)
        if changed == text:
            changed = text.replace("{", "{ ", 1)  # nothing to edit: other text, same JSON
        (path / file).write_text(changed)

    return apply


def edit_digit(text: str) -> str:
    """Return the text with its first digit changed."""
    return re.sub(r"\d", lambda found: str((int(found[0]) + 1) % 10), text, count=1)


def edit_last_digit(text: str) -> str:
    """Return the text with its last digit changed, same length."""
    return edit_digit(text[::-1])[::-1]


def edit_add_attribute(text: str) -> str:
    """Return metadata with one attribute more."""
    content = json.loads(text)
    content["attributes"]["units"] = "parsec"
    return json.dumps(content)


def edit_remove_attributes(text: str) -> str:
    """Return metadata without attributes, except the marks that a root group needs."""
    content = json.loads(text)
    kept = {k: v for k, v in content["attributes"].items() if k in ("format", "complete")}
    return json.dumps(content | {"attributes": kept})


def edit_older_format(text: str) -> str:
    """Return metadata that state format 1, which has no manifests."""
    return text.replace('"format": 2', '"format": 1')


EDITS = (edit_digit, edit_last_digit, edit_add_attribute, edit_remove_attributes, edit_older_format)
