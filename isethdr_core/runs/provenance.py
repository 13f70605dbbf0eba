"""What made a result: versions and source digests of the packages that took part."""

from __future__ import annotations

import hashlib
import os
from functools import cache
from importlib import metadata, util
from pathlib import Path

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


@cache
def source_digest(package: str) -> str:
    """Return a digest of all Python, YAML and CSV sources of an import package or module: it names
    the code that ran.

    Presets below `conf` do not enter: what was chosen from them is in the config.
    """
    spec = util.find_spec(package)
    digest = hashlib.sha256()
    if spec and not spec.submodule_search_locations and spec.has_location:  # a plugin of one file
        digest.update(Path(spec.origin).read_bytes())
    for folder in sorted(spec.submodule_search_locations or []) if spec else []:
        for path in sorted(Path(folder).rglob("*")):
            inside = path.relative_to(folder)
            if path.suffix in (".py", ".yaml", ".csv") and "conf" not in inside.parts:
                digest.update(inside.as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def fingerprint(*components, core: tuple[str, ...] = ("isethdr_core",)) -> dict[str, str]:
    """Return the source digest of each component's package, and of the parts of the core that they
    rely on.
    """
    packages = set(core) | {type(c).__module__.split(".")[0] for c in components if c is not None}
    return {name: source_digest(name) for name in sorted(packages)}


def versions() -> dict[str, str]:
    """Return the version of every library that can change a result; absent ones are left out."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def input_digests(*components) -> dict[str, str]:
    """Return a digest of every file that a component names in its method `input_files()`, by path.

    A file that is not there is left to the component, which says what it expected.
    """
    found = {}
    for component in components:
        for path in filter(os.path.isfile, getattr(component, "input_files", tuple)()):
            with open(path, "rb") as file:
                found[str(path)] = hashlib.file_digest(file, "sha256").hexdigest()[:16]
    return found
