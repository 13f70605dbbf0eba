"""Measured spectra: tables of colour-science, kept on disk after their first use.

Importing that package for five tables takes more than a second. The tables are not part of this
project, because the CIE shares its tables under CC BY-SA. A file holds the tables of one version of
the package. In a folder without write permission nothing is kept.
"""

from __future__ import annotations

import json
import os
import uuid
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

import numpy as np

from isethdr_core import store
from isethdr_core.extras import needed

WAVELENGTH_NM = np.arange(380.0, 781.0, 5.0)
TABLES = {  # name: (collection of colour-science, its key)
    "led_white": ("SDS_ILLUMINANTS", "LED-B4"),
    "led_warm": ("SDS_ILLUMINANTS", "LED-B1"),
    "sodium": ("SDS_LIGHT_SOURCES", "C100S54 (HPS)"),
    "metal_halide": ("SDS_LIGHT_SOURCES", "MHC100/U/MP/4K"),
    "daylight": ("SDS_ILLUMINANTS", "D65"),
}


def measured(name: str) -> np.ndarray:
    """Return the relative spectral power (band,) of one of `TABLES` at `WAVELENGTH_NM`."""
    with needed("a lamp's measured spectrum", extra="mitsuba"):
        package_version = version("colour-science")
    path = store.home() / "spectra" / f"colour-science-{package_version}.json"
    tables = _read(path)
    if tables is None:
        tables = _from_colour_science()
        _keep(path, tables)
    return tables[name]


def _from_colour_science() -> dict[str, np.ndarray]:
    with needed("a lamp's measured spectrum", extra="mitsuba"):
        import colour

    tables = {name: getattr(colour, collection)[key] for name, (collection, key) in TABLES.items()}
    return {
        name: np.interp(WAVELENGTH_NM, table.wavelengths, table.values)
        for name, table in tables.items()
    }


def _read(path: Path) -> dict[str, np.ndarray] | None:
    """Return the numbers of a file, exact to the last bit; None if it is missing, damaged or holds
    other tables.
    """
    try:
        content = json.loads(path.read_text())
        if (
            content["tables"] != {name: list(where) for name, where in TABLES.items()}
            or content["wavelength_nm"] != WAVELENGTH_NM.tolist()
        ):
            return None
        spectra = {name: np.array(content["power"][name], float) for name in TABLES}
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return (
        spectra
        if all(p.shape == WAVELENGTH_NM.shape and np.isfinite(p).all() for p in spectra.values())
        else None
    )


def _keep(path: Path, power: dict[str, np.ndarray]) -> None:
    """Write the spectra into a file, if the folder may be written to."""
    content = {
        "tables": TABLES,
        "wavelength_nm": WAVELENGTH_NM.tolist(),
        "power": {name: values.tolist() for name, values in power.items()},
    }
    temporary = path.with_name(f".{path.name}.{os.getpid()}-{uuid.uuid4().hex[:6]}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(json.dumps(content))
        temporary.replace(path)  # any number of processes may share the folder
    except OSError:
        with suppress(OSError):
            temporary.unlink()
