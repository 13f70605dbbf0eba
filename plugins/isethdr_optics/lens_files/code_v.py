"""CODE V .seq: a sequence of commands, S for each surface."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from isethdr_core.errors import CatalogError

from .lens_data import LensData, Problems, Row, number

MM_PER = {"M": 1.0, "C": 10.0, "I": 25.4}
SURFACE = re.compile(r"S(O|I|\d*)")
ASPHERE = {letter: 4 + 2 * k for k, letter in enumerate("ABCDEFGHJ")}  # a4, a6, ...; there is no I
TILTED = ("ADE", "BDE", "CDE", "XDE", "YDE", "ZDE", "DAR", "BEN", "REV", "XTI", "YTI")
OTHER_SHAPES = ("SPS", "CYL", "TOR", "AAS", "XTO", "YTO", "GRT", "HOE", "DIF", "UDS", "GRX")
FAR_MM = 1e9  # least distance of a distant object; CODE V writes 1e13


def read(path: Path, problems: Problems) -> LensData:
    """Return the content of a .seq file; surfaces that cannot be imported are recorded.

    Parameters
    ----------
    path : path of the file.
    problems : record of the surfaces that cannot be imported.

    Raises
    ------
    CatalogError : the file holds no surfaces.
    ConfigError : an entry is not a number.
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    text = re.sub(r"!.*", "", text).replace("&\n", " ")
    lens = LensData(path.stem, f"imported from {path.name}", [])
    file = _File(lens, path, problems)
    for line in re.split(r"[;\n]", text):
        words = _words(line)
        if words:
            file.take(words)
    if not lens.rows or file.current is not None:
        raise CatalogError(f"{path} holds no lens; expected CODE V commands SO, S and SI")
    for row in lens.rows:
        row.radius_mm *= file.unit
        row.thickness_mm *= file.unit
        row.semi_diameter_mm *= file.unit
        row.terms = {power: a * file.unit ** (1 - power) for power, a in row.terms.items()}
    if lens.entrance_pupil_mm is not None:
        lens.entrance_pupil_mm *= file.unit
    if file.wavelengths:
        middle = file.reference or (len(file.wavelengths) + 1) // 2
        lens.reference_nm = file.wavelengths[min(middle, len(file.wavelengths)) - 1]
    return lens


def _words(line: str) -> list[str]:
    quoted = re.findall(r"'[^']*'|\"[^\"]*\"|\S+", line)
    return [word.strip("'\"") for word in quoted]


class _File:
    """State while a file is read; commands act on the last surface."""

    def __init__(self, lens: LensData, path: Path, problems: Problems) -> None:
        self.lens = lens
        self.path = path
        self.problems = problems
        self.unit = 1.0
        self.reference = 0
        self.radii = True
        self.widest_deg = 0.0  # largest field angle along x or y
        self.wavelengths: list[float] = []
        self.current: Row | None = None

    def take(self, words: list[str]) -> None:
        """Apply one command."""
        key, *arguments = words
        key = key.upper()
        where = f"{self.path}, {' '.join(words)!r}"
        if SURFACE.fullmatch(key):
            self._surface(key, arguments, where)
        elif key == "TITLE" or key == "TIT":
            self.lens.name = " ".join(arguments)
        elif key == "DIM" and arguments:
            self.unit = MM_PER.get(arguments[0].upper(), 1.0)
        elif key == "RDM":
            self.radii = not arguments or arguments[0].upper() != "NO"
        elif key == "CUM":
            self.radii = False
        elif key == "WL":
            self.wavelengths = [number(w, where) for w in arguments]
        elif key == "REF" and arguments:
            self.reference = int(number(arguments[0], where))
        elif key == "EPD" and arguments:
            self.lens.entrance_pupil_mm = number(arguments[0], where)
        elif key == "FNO" and arguments:
            self.lens.f_number = number(arguments[0], where)
        elif key in ("YAN", "XAN") and arguments:
            self.widest_deg = max(self.widest_deg, *(abs(number(w, where)) for w in arguments))
            self.lens.half_field_deg = self.widest_deg or None
        elif self.current is not None:
            self._of_surface(self.current, key, arguments, where)

    def _surface(self, key: str, arguments: list[str], where: str) -> None:
        if key == "SI":
            self.current = None
            return
        values = [number(w, where) for w in arguments[:2]]
        shape = values[0] if values else 0.0
        distance = values[1] if len(values) > 1 else 0.0
        if key == "SO":
            self.lens.far_object = not abs(distance) < FAR_MM
            return
        radius = shape if self.radii else (1 / shape if shape else 0.0)
        row = Row(str(len(self.lens.rows) + 1), radius or np.inf, distance)
        if len(arguments) > 2:
            row.glass = self._glass(row, arguments[2])
        self.current = row
        self.lens.rows.append(row)

    def _glass(self, row: Row, name: str) -> str:
        if name.upper() in ("REFL", "REFR", "TIRO"):
            if name.upper() != "REFR":
                self.problems.add(row.label, "a mirror")
            return ""
        return "" if name.upper() == "AIR" else name

    def _of_surface(self, row: Row, key: str, arguments: list[str], where: str) -> None:
        if key == "STO":
            row.is_stop = True
        elif key == "K" and arguments:
            row.conic = number(arguments[0], where)
        elif key in ASPHERE and arguments:
            row.terms[ASPHERE[key]] = number(arguments[0], where)
        elif key == "CIR" and len(arguments) == 1:
            row.semi_diameter_mm = number(arguments[0], where)
        elif key == "GLA" and arguments:
            row.glass = self._glass(row, arguments[0])
        elif key == "THI" and arguments:
            row.thickness_mm = number(arguments[0], where)
        elif key in TILTED and any(number(w, where) for w in arguments[:1]):
            self.problems.add(row.label, f"{key} {arguments[0]} (tilted or decentred)")
        elif key in OTHER_SHAPES:
            self.problems.add(row.label, f"shape {' '.join([key, *arguments[:1]])}")
