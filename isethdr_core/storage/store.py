"""Zarr v3 stores that are either complete or absent.

One process writes a store under a temporary name in its final folder, reads it back, and renames
it. A store with its final name is complete and never changes. Interrupted writers leave only
temporary names, which the next writer in that folder removes.

    <ISETHDR_HOME or ./runs>/scenes/<name>.zarr    one scene's radiance and labels
    <ISETHDR_HOME or ./runs>/runs/<name>.zarr      one run: captures, pictures, scores
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..errors import MOST_LISTED, CatalogError
from ..runs.names import check_path
from ..uncertainty import ledger
from .arrays import COORDINATES, consolidate, write_dataset, write_group
from .atomic_write import remove_leftovers, temporary_path
from .encoding import KEEPBITS, LIGHT, jsonable, portable, restored, rounding
from .home_folder import home as home
from .manifest import (
    ADVICE,
    MANIFEST,
    MANIFEST_FILE,
    Manifest,
    check_files,
    check_metadata,
    check_whole,
    damaged,
    read_manifest,
    write_manifest,
)
from .object_home.calls import (
    check_files_in_bucket,
    follow_home,
    home_of_stub,
    publish_store,
    source_in_bucket,
)

FORMAT = 2  # layout below the root; increased when an older reader would misread a newer store
WITHOUT_MANIFEST = 1  # the format before manifests: `isethdr catalog adopt` adds one
ROOT_FILE = "zarr.json"


def content_hash(obj: object) -> str:
    """Return 16 hex digits that identify the content of `obj`; the order of dictionary keys does
    not matter.
    """
    text = json.dumps(jsonable(obj), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def find_complete(folder: str | os.PathLike[str], name: str) -> Path | None:
    """Return the path of the complete store `name` in `folder`; None if it does not exist.

    Raises
    ------
    CatalogError : as `read_attrs`; or a file is missing or has another size.
    """
    path = Path(folder) / f"{name}.zarr"
    if not path.exists():
        return None
    _opened(path)
    return path


def read_attrs(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the root attributes of a store, without reading any array.

    Raises
    ------
    CatalogError : the store is missing, damaged, incomplete, or written by a newer version.
    """
    return _root(Path(path))[0]


def _opened(path: Path) -> tuple[dict[str, Any], Manifest | None]:
    """Return the root attributes and the manifest of a store, after checking that all of its files
    are there with their sizes.
    """
    attrs, manifest = _root(path)
    if manifest is not None:
        address = home_of_stub(path)
        if address is None:
            check_files(path, manifest)
        else:
            check_files_in_bucket(path, manifest, address)
    return attrs, manifest


def _root(path: Path) -> tuple[dict[str, Any], Manifest | None]:
    """Return the root attributes, compared with the manifest, and the manifest; None for a store of
    format 1.
    """
    try:
        text = (path / ROOT_FILE).read_bytes()
        attrs = json.loads(text)["attributes"]
        complete = attrs.get("complete")
        version = attrs.get("format")
    except FileNotFoundError:
        if path.exists():
            raise CatalogError(f"{path} is not a store: it holds no zarr.json; {ADVICE}") from None
        raise CatalogError(
            f"there is no store {path}; `isethdr catalog find` lists what there is"
        ) from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CatalogError(
            f"the store {path} is damaged: zarr.json cannot be read ({error}); {ADVICE}"
        ) from None
    if complete is not True:
        raise CatalogError(
            f"the store {path} is incomplete: it lacks the mark that is written last; {ADVICE}"
        )
    manifest = read_manifest(path)
    if manifest is not None:
        try:
            check_whole(path, ROOT_FILE, manifest.files[ROOT_FILE], text)
        except CatalogError as error:
            if version == WITHOUT_MANIFEST:
                raise CatalogError(
                    f"{error}; `isethdr catalog adopt` finishes an adoption that was interrupted"
                ) from None
            raise
    if version not in (WITHOUT_MANIFEST, FORMAT) or isinstance(version, bool):
        raise CatalogError(
            f"the store {path} has format {version!r}; this version reads {WITHOUT_MANIFEST} and"
            f" {FORMAT}; install the isethdr that wrote it"
        )
    if manifest is None and version == FORMAT:
        raise damaged(path, MANIFEST_FILE, "is missing")
    return restored(attrs), manifest


def write_store(
    folder: str | os.PathLike[str],
    name: str,
    datasets: dict[str, xr.Dataset],
    attrs: dict[str, Any],
    keepbits: int | None = KEEPBITS,
) -> Path:
    """Write a complete store, or nothing. An existing store of the same name is kept.

    Parameters
    ----------
    folder : folder of the store; made if missing.
    name : name without `.zarr`, usually with a `content_hash` of all inputs.
    datasets : {group: Dataset}; "" is the root, "captures/bayer" a nested group.
    attrs : root attributes, by which the catalog finds the store.
    keepbits : mantissa bits of radiance and irradiance to keep; None keeps all.

    Returns
    -------
    Path : `<folder>/<name>.zarr`, complete.

    Raises
    ------
    CatalogError : the folder cannot be written, is full, or holds a damaged store of that name; or
        the store cannot be published in the object home that the folder belongs to.
    """
    check_path(name, single=True)
    for key in datasets:
        check_path(key)
        if key.split("/")[0] == MANIFEST:
            raise CatalogError(
                f"the group {key!r} cannot be stored: {MANIFEST!r} is the store's own"
            )
    folder = Path(folder)
    final = folder / f"{name}.zarr"
    if any(set(LIGHT) & set(ds.variables) for ds in datasets.values()):
        ledger.error(
            rounding(keepbits), "relative", "bound", "light as stored, rounded in its mantissa"
        )
    if find_complete(folder, name):
        publish_store(final)
        return final
    temporary = temporary_path(folder, name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        remove_leftovers(folder)
        _write(
            temporary,
            name,
            {key: portable(ds, keepbits) for key, ds in datasets.items()},
            jsonable(attrs),
        )
        _to_disk(temporary)
        try:
            os.rename(temporary, final)
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            # another writer of the same recipe was faster: its store is as good
            find_complete(folder, name)
    except OSError as error:
        raise _cannot_write(final, error) from error
    finally:
        # after the rename there is nothing to remove; a failure or Ctrl-C leaves the folder
        shutil.rmtree(temporary, ignore_errors=True)
    publish_store(final)
    return final


def _write(path: Path, name: str, datasets: dict[str, xr.Dataset], attrs: dict[str, Any]) -> None:
    written = write_group(path, "", {})
    for key, ds in datasets.items():
        written |= write_dataset(path, key, ds)
    for key, ds in datasets.items():
        _check_written(path, key, ds)
    root = json.loads((path / ROOT_FILE).read_bytes())["attributes"]
    written |= write_group(path, "", {**root, **attrs, "format": FORMAT, "complete": True})
    written |= consolidate(path)
    write_manifest(path, Manifest(name, written))


def _check_written(path: Path, key: str, ds: xr.Dataset) -> None:
    import zarr

    for name in set(LIGHT) & set(ds.variables):
        stored = zarr.open_array(path / key / name, mode="r")
        if stored.shape != ds.variables[name].shape:
            raise CatalogError(
                f"{path}: {key}/{name} was written as {stored.shape}, expected"
                f" {ds.variables[name].shape}; write it again"
            )
        if hole := holes(stored):
            raise CatalogError(
                f"{path}: {key}/{name} holds NaN at {hole}; expected finite light: the renderer"
                " failed, or a chunk was lost; run it again"
            )


def holes(array: Any) -> str:
    """Return the position of a NaN, the value of a missing chunk, in a zarr array of floats; "" if
    there is none.
    """
    if not array.ndim:
        return ""
    step = (array.shards or array.chunks)[0]  # one shard at a time bounds the memory
    for start in range(0, array.shape[0], step):
        missing = np.isnan(array[start : start + step])
        if missing.any():
            first = start + int(np.argwhere(missing)[0, 0])
            return f"index {first} of {array.shape[0]}"
    return ""


def _to_disk(path: Path) -> None:
    """Flush every file to disk before the rename, so that a power cut cannot leave a renamed, empty
    store.
    """
    for folder, _, files in os.walk(path):
        for file in files:
            handle = os.open(os.path.join(folder, file), os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)


def _cannot_write(final: Path, error: OSError) -> CatalogError:
    reasons = {
        errno.ENOSPC: "the disk is full",
        errno.EDQUOT: "the disk quota is used up",
        errno.EROFS: "the disk is read-only",
        errno.EACCES: "no permission to write there",
        errno.EPERM: "no permission to write there",
    }
    reason = reasons.get(error.errno or 0, str(error))
    return CatalogError(
        f"cannot write {final}: {reason}; nothing was left behind; "
        "make room or choose another folder with ISETHDR_HOME=/path"
    )


def open_store(path: str | os.PathLike[str], group: str = "") -> xr.Dataset:
    """Return one group of a complete store. Arrays are read when their values are used.

    Raises
    ------
    CatalogError : as `read_attrs`; or the group does not exist.
    """
    path = Path(path)
    root, manifest = _opened(path)
    address = home_of_stub(path)
    if manifest is None:
        source: Any = path
    elif address is not None:
        source = source_in_bucket(path, manifest, address, group)
    else:
        from .reader import ManifestStore  # needs zarr, which is slow to import

        check_metadata(path, manifest, group)
        source = ManifestStore(path, manifest)
    try:
        ds: xr.Dataset = xr.open_zarr(
            source,
            group=group or None,
            consolidated=False,
            chunks=None,
            mask_and_scale=False,
            zarr_format=3,
        )
    except CatalogError:
        raise
    except (
        Exception
    ) as error:  # zarr, xarray and json each raise their own kinds on damaged metadata
        known = ", ".join(repr(name) for name in _groups(path))
        raise CatalogError(
            f"cannot open group {group!r} of the store {path}: {error}; groups it holds: {known}; "
            "see `isethdr catalog verify`"
        ) from error
    # xarray has used the list of coordinates that a group states; it is no attribute of the data
    ds.attrs = restored(ds.attrs) if group else {k: v for k, v in root.items() if k != COORDINATES}
    for name, variable in ds.variables.items():
        variable.attrs = restored({k: v for k, v in variable.attrs.items() if k != "_FillValue"})
        if variable.dtype.kind == "T":
            ds[name] = variable.astype(object)  # as quantities.names makes them
    return ds


def _groups(path: Path) -> list[str]:
    """Return the names of the groups of a store that can be read at all."""
    if home_of_stub(path) is not None:
        nodes = json.loads((path / ROOT_FILE).read_bytes())["consolidated_metadata"]["metadata"]
        names = [name for name, node in nodes.items() if node["node_type"] == "group"]
    else:
        files = [
            file
            for file in sorted(path.glob("**/zarr.json"))
            if '"group"' in file.read_text(errors="replace")
        ]
        names = [file.parent.relative_to(path).as_posix() for file in files]
    return sorted(name for name in names if name != MANIFEST)


def open_scene(path_or_id: str | os.PathLike[str]) -> xr.Dataset:
    """Return stored scene radiance, joined with the sibling stores of its recipe that hold further
    groups or bands.

    Parameters
    ----------
    path_or_id : a path that ends in `.zarr`, or a store name, a recipe hash, or the beginning of
        either, looked up in `home()/scenes`.

    Returns
    -------
    Dataset : scene radiance and labels; only the groups, bands and tiles that are used are read.

    Raises
    ------
    CatalogError : no store or several stores have this name, or the store cannot be read.
    """
    path = _scene_path(path_or_id)
    base = open_store(path)
    siblings = _siblings(path, base.attrs.get("recipe"))
    from .join import join_scenes  # loads parts of xarray that other functions do not need

    return join_scenes([base, *map(open_store, siblings)])


def _siblings(path: Path, recipe: str | None) -> list[Path]:
    """Return the other complete stores of a recipe in the folder of a store.

    Parameters
    ----------
    path : path of the store.
    recipe : hash of the recipe that made the store; None for a store without a recipe.
    """
    if not recipe:
        return []
    # runs put the recipe first in the name: other stores, of which a dataset has many, are not read
    names = f"{recipe}-*.zarr" if path.stem.startswith(f"{recipe}-") else "*.zarr"
    complete = _complete_stores(path.parent, names)
    return [p for p, attrs in complete if p != path and attrs.get("recipe") == recipe]


def _scene_path(path_or_id: str | os.PathLike[str]) -> Path:
    path = Path(path_or_id)
    if path.suffix == ".zarr" or path.is_dir():
        return path
    follow_home(home())
    folder = home() / "scenes"
    start_of_name = str(path_or_id)
    named = folder / f"{start_of_name}.zarr"
    if named.exists():
        return named
    matches = {
        p: attrs.get("recipe") or p.name
        for p, attrs in _complete_stores(folder, "*.zarr")
        if p.stem.startswith(start_of_name)
        or str(attrs.get("recipe", "")).startswith(start_of_name)
    }
    if not matches:
        raise CatalogError(
            f"no scene in {folder} has a name that begins with {start_of_name!r}; expected such a"
            " name, or a path that ends in .zarr; `isethdr catalog find kind=scene` lists the names"
        )
    if len(set(matches.values())) > 1:
        some = ", ".join(sorted(p.stem for p in matches)[:MOST_LISTED])
        more = f" and {len(matches) - MOST_LISTED} more" if len(matches) > MOST_LISTED else ""
        raise CatalogError(
            f"{start_of_name!r} could be any of {some}{more}; type more digits of the name"
        )
    return min(matches)


def _complete_stores(folder: Path, names: str) -> list[tuple[Path, dict[str, Any]]]:
    """Return the complete stores of a folder with their root attributes.

    Parameters
    ----------
    folder : folder of the stores.
    names : pattern of their names.
    """
    stores = []
    for path in sorted(folder.glob(names)):
        try:
            stores.append((path, read_attrs(path)))
        except (
            CatalogError
        ):  # one damaged store must not hide the others; `isethdr catalog verify` names it
            pass
    return stores
