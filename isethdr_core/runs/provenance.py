"""Provenance: the code of the components of a run, library versions, and input files."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Iterator
from dataclasses import asdict
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from ..errors import PluginError
from ..identity.code_digest import Code, code_of, frame_code, keep
from ..plugins import registry
from ..plugins.protocols import ReadsFiles, RunsPrograms

CORE = "core"  # name of the frame, as `kind/name` is that of a component
LIBRARIES = (
    "isethdr",
    "numpy",
    "scipy",
    "xarray",
    "zarr",
    "hydra-core",
    "mitsuba",
    "drjit",
    "colour-science",
)


def identity(component: object) -> str:
    """Return `kind/name` under which a component's class is registered.

    A class without a registered name has its own name. A class with several has the first of them.
    """
    cls = type(component)
    names = sorted(
        f"{kind}/{name}"
        for (kind, name), offered in registry.components().items()
        if offered.class_name == cls.__name__ and offered.cls is cls
    )
    return names[0] if names else cls.__qualname__


def described(component: object, without: Collection[str] = ()) -> dict[str, Any]:
    """Return a component's identity (kind and registered name) and fields as plain data.

    Parameters
    ----------
    without : fields that are left out.
    """
    fields = {k: v for k, v in asdict(component).items() if k not in without}
    return {"component": identity(component), **fields}


def fingerprint(*components: object, frame: bool = False) -> dict[str, str]:
    """Return the digest of the code of each component by its identity; None is left out.

    Parameters
    ----------
    frame : whether the part of the core that runs the chain is added, as `core`.
    """
    return {name: code.digest for name, code in _codes(components, frame).items()}


def have_source(*components: object) -> bool:
    """Return whether the code of all components can be identified in another process."""
    return all(code_of(component).has_source for component in components)


def libraries(*components: object, frame: bool = False) -> dict[str, str]:
    """Return the version of each library that the code of components imports, by distribution, and
    of each program that they start.
    """
    versions: dict[str, str] = {}
    for code in _codes(components, frame).values():
        versions |= code.libraries
    for component in components:
        if isinstance(component, RunsPrograms):
            versions |= component.programs()
    return dict(sorted(versions.items()))


def _codes(components: tuple[object, ...], frame: bool) -> dict[str, Code]:
    codes = {identity(c): code_of(c) for c in components if c is not None}
    if frame:
        codes[CORE] = frame_code()
    keep()
    return dict(sorted(codes.items()))


def versions() -> dict[str, str]:
    """Return the versions that are stored with results, for people; absent ones are left out."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    versions = {}
    for name in LIBRARIES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


def input_digests(*components: Any) -> dict[str, str]:
    """Return a digest of every file that a component names in its method `input_files()`, by path.

    A folder stands for all files below it, also in linked folders. A missing file is skipped here:
    the component itself raises an error that says what it expected.

    Raises
    ------
    PluginError : a component returns one path instead of several.
    """
    digests = {}
    for component in components:
        for path in _input_files(component):
            with open(path, "rb") as file:
                digests[str(path)] = hashlib.file_digest(file, "sha256").hexdigest()[:16]
    return digests


def _input_files(component: Any) -> Iterator[str | Path]:
    """Yield the files that a component names, and those below the folders that it names."""
    named = component.input_files() if isinstance(component, ReadsFiles) else ()
    if isinstance(named, str | bytes | os.PathLike):  # a text would be read letter by letter
        raise PluginError(
            f"{identity(component)}: input_files() returned the single path"
            f" {os.fspath(named)!r}; expected several paths; type `return (path,)` with a comma"
        )
    for path in map(os.fsdecode, named):
        if os.path.isdir(path):
            yield from _files_below(Path(path))
        elif os.path.isfile(path):
            yield path


def _files_below(folder: Path, above: tuple[str, ...] = ()) -> Iterator[Path]:
    """Yield the files in a folder and in all folders below it, also in linked ones.

    Parameters
    ----------
    folder : folder to read. One that may not be read has no files: its component says so.
    above : true paths of the folders above it. A link to one of them is not followed.
    """
    true_path = os.path.realpath(folder)
    if true_path in above or not os.access(folder, os.R_OK | os.X_OK):
        return
    for path in sorted(folder.iterdir()):
        if path.is_dir():
            yield from _files_below(path, (*above, true_path))
        elif path.is_file():
            yield path
