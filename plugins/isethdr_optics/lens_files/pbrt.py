"""PBRT .dat: radius, thickness, index and diameter of each surface, in millimetres, front first.

A radius of 0 marks the stop. The last thickness is the distance to the film.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from isethdr_core.errors import CatalogError

from .lens_data import LensData, Problems, Row, number


def read(path: Path, problems: Problems) -> LensData:
    """Return the content of a .dat file.

    Raises
    ------
    CatalogError : the file is not a table of four columns.
    ConfigError : an entry is not a number.
    """
    lens = LensData(path.stem, f"imported from {path.name}", [])
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        words = line.partition("#")[0].split()
        if not words:
            continue
        label = str(len(lens.rows) + 1)
        if len(words) != 4:
            raise CatalogError(
                f"{path}, surface {label} has {len(words)} numbers; expected radius, thickness,"
                " index and diameter, as PBRT lenses have them"
            )
        where = f"{path}, surface {label}"
        radius, thickness, index, diameter = (number(w, where) for w in words)
        row = Row(label, radius or np.inf, thickness, semi_diameter_mm=diameter / 2 or np.inf)
        row.is_stop = radius == 0
        if index not in (0.0, 1.0) and not row.is_stop:
            row.glass = words[2]
            lens.glasses[row.glass] = row.glass
        lens.rows.append(row)
    if not lens.rows:
        raise CatalogError(f"{path} holds no surface; expected a PBRT lens")
    return lens
