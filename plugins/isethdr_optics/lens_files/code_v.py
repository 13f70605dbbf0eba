"""CODE V .seq: a sequence of commands, S for each surface."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from isethdr_core.errors import CatalogError, ConfigError

from .lens_data import LensData, Problems, Row, integer, number, unit_mm, widest_deg

MM_PER = {"M": 1.0, "C": 10.0, "I": 25.4}
# a surface, or a range of surfaces, that a command names
ADDRESS = re.compile(r"S(O|I|\d+)(?:\.\.(\d+))?", re.IGNORECASE)
# Solves, which stand in place of a number: angles, heights and incidences of the marginal and the
# chief ray, paraxial image, pickup, aplanatic surface, reduction ratio. Any other word is an error:
# it may mean a plane, or be a misspelt number.
SOLVES = {ray + axis for ray in ("UM", "UC", "HM", "HC", "IM", "IC") for axis in "YX"}
SOLVES |= {"PIM", "PIK", "SA", "APL", "RED"}
SURFACE = re.compile(r"S(O|I|\d*)")
ASPHERE = {letter: 4 + 2 * k for k, letter in enumerate("ABCDEFGHJ")}  # a4, a6, ...; there is no I
TILTED = ("ADE", "BDE", "CDE", "XDE", "YDE", "ZDE", "DAR", "BEN", "REV", "XTI", "YTI")
OTHER_SHAPES = ("SPS", "CYL", "TOR", "AAS", "XTO", "YTO", "GRT", "HOE", "DIF", "UDS", "GRX")
# commands of a surface
OF_SURFACE = {"STO", "K", *ASPHERE, "CIR", "GLA", "RMD", "RDY", "CUY", "THI"}
OF_SURFACE |= {*TILTED, *OTHER_SHAPES}
# {command: what its solves set}
SOLVED = {"RDY": "radius", "CUY": "curvature", "THI": "thickness"}
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
    ConfigError : an entry is not a number, or the unit, a named surface or the reference
        wavelength is unknown.
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
        count = len(file.wavelengths)
        at = (count + 1) // 2 if file.reference is None else file.reference
        if not 1 <= at <= count:
            raise ConfigError(
                f"{path} names the reference wavelength {at}, and has {count} wavelengths;"
                f" expected 1 to {count} in its line REF"
            )
        lens.reference_nm = file.wavelengths[at - 1]
    lens.half_field_deg = widest_deg(file.x_deg, file.y_deg) or None
    return lens


def _words(line: str) -> list[str]:
    quoted = re.findall(r"'[^']*'|\"[^\"]*\"|\S+", line)
    return [word.strip("'\"") for word in quoted]


def _is_solve(word: str) -> bool:
    """Return whether a solve stands in place of a radius, curvature or distance."""
    return word.upper() in SOLVES


def _solvable(key: str, word: str, where: str) -> float:
    """Return the number that stands where a solve may stand.

    Raises
    ------
    ConfigError : `word` is not a number.
    """
    try:
        return number(word, where)
    except ConfigError:
        plane = "" if key == "THI" else f"{key} 0 for a plane, or "
        raise ConfigError(
            f"{where} has {word!r}; expected a number or a solve ({', '.join(sorted(SOLVES))});"
            f" type {plane}the number; or delete the command, and the number of the line S counts"
        ) from None


def _radius_mm(curvature: float) -> float:
    """Return the radius of a curvature, in the unit of the file; infinite for a plane."""
    return 1 / curvature if curvature else np.inf


class _File:
    """State while a file is read; commands act on the last surface, or on a surface that they
    name.
    """

    def __init__(self, lens: LensData, path: Path, problems: Problems) -> None:
        self.lens = lens
        self.path = path
        self.problems = problems
        self.unit = 1.0
        self.reference: int | None = None
        self.radii = True
        self.x_deg: list[float] = []  # field angles along x
        self.y_deg: list[float] = []
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
            self.unit = unit_mm(arguments[0], MM_PER, where)
        elif key == "RDM":
            self.radii = not arguments or arguments[0].upper() != "NO"
        elif key == "CUM":
            self.radii = False
        elif key == "WL":
            self.wavelengths = [number(w, where) for w in arguments]
        elif key == "REF" and arguments:
            self.reference = integer(arguments[0], where)
        elif key == "EPD" and arguments:
            self.lens.entrance_pupil_mm = number(arguments[0], where)
        elif key == "FNO" and arguments:
            self.lens.f_number = number(arguments[0], where)
        elif key == "XAN":
            self.x_deg = [number(w, where) for w in arguments]
        elif key == "YAN":
            self.y_deg = [number(w, where) for w in arguments]
        elif key in OF_SURFACE:
            self._command(key, arguments, where)

    def _command(self, key: str, arguments: list[str], where: str) -> None:
        """Apply a command of a surface to the last surface, or to those that it names."""
        named = ADDRESS.fullmatch(arguments[0]) if arguments else None
        is_glass = key == "GLA" and len(arguments) == 1  # silicon may be called SI
        if named is None or is_glass:
            if self.current is not None:
                self._of_surface(self.current, key, arguments, where)
            return
        first, last = (named[1].upper(), named[2])
        if first == "I":
            return
        if first in ("O", "0") and last is None:
            if key == "THI" and len(arguments) > 1:
                self._distance_of_object(arguments[1:], where)
            return
        low = int(first) if first.isdigit() else 0
        high = int(last) if last else low
        if not 1 <= low <= high <= len(self.lens.rows):
            raise ConfigError(
                f"{where} names {arguments[0]}; expected one of the {len(self.lens.rows)} surfaces"
                " before this line, without object and image"
            )
        for row in self.lens.rows[low - 1 : high]:
            self._of_surface(row, key, arguments[1:], where)

    def _distance_of_object(self, arguments: list[str], where: str) -> None:
        if _is_solve(arguments[0]):
            self.lens.notes.append(
                f"the object surface has the solve {' '.join(['THI', *arguments])!r}; here it keeps"
                " the distance of its line SO"
            )
        else:
            self.lens.far_object = not abs(_solvable("THI", arguments[0], where)) < FAR_MM

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
        radius = (shape or np.inf) if self.radii else _radius_mm(shape)
        row = Row(str(len(self.lens.rows) + 1), radius, distance)
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
        elif key in SOLVED and arguments and _is_solve(arguments[0]):
            # CODE V writes the solved value into the line of the surface
            self.lens.notes.append(
                f"surface {row.label} has the solve {' '.join([key, *arguments])!r}; here it keeps"
                f" the {SOLVED[key]} of its line S"
            )
        elif key == "K" and arguments:
            row.conic = number(arguments[0], where)
        elif key in ASPHERE and arguments:
            row.terms[ASPHERE[key]] = number(arguments[0], where)
        elif key == "CIR" and len(arguments) == 1:
            row.semi_diameter_mm = number(arguments[0], where)
        elif key == "GLA" and arguments:
            row.glass = self._glass(row, arguments[0])
        elif key == "RMD" and arguments:
            self._glass(row, arguments[0])
        elif key == "RDY" and arguments:
            row.radius_mm = _solvable(key, arguments[0], where) or np.inf
        elif key == "CUY" and arguments:
            row.radius_mm = _radius_mm(_solvable(key, arguments[0], where))
        elif key == "THI" and arguments:
            row.thickness_mm = _solvable(key, arguments[0], where)
        elif key in TILTED and any(number(w, where) for w in arguments[:1]):
            self.problems.add(row.label, f"{key} {arguments[0]} (tilted or decentred)")
        elif key in OTHER_SHAPES:
            self.problems.add(row.label, f"shape {' '.join([key, *arguments[:1]])}")
