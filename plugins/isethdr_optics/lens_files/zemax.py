"""Zemax .zmx: a text file of keywords, one block SURF for each surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from isethdr_core.errors import CatalogError, ConfigError

from .lens_data import LensData, Problems, Row, integer, number, unit_mm, widest_deg

MM_PER = {"MM": 1.0, "CM": 10.0, "IN": 25.4, "METER": 1000.0, "M": 1000.0}
# types of surfaces; the power of r of an aspheric term is this factor times the parameter's number
SHAPES = {"STANDARD": 0, "EVENASPH": 2, "ODDASPHE": 1}
ANGLES = "0"  # code of fields that are given as angles


def read(path: Path, problems: Problems) -> LensData:
    """Return the content of a .zmx file; surfaces that cannot be imported are recorded.

    Parameters
    ----------
    path : path of the file.
    problems : record of the surfaces that cannot be imported.

    Raises
    ------
    CatalogError : the file holds fewer than three surfaces: object, lens and image.
    ConfigError : an entry is not a number, or the unit or the primary wavelength is unknown.
    """
    data = path.read_bytes()
    text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8", "replace")
    head: list[list[str]] = []
    blocks: list[list[list[str]]] = []
    for line in text.splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "SURF":
            blocks.append([])
        elif line[0].isspace() and blocks:
            blocks[-1].append(words)
        else:
            head.append(words)
    if len(blocks) < 3:
        raise CatalogError(
            f"{path} holds {len(blocks)} surfaces; expected a Zemax lens with object, lens and"
            " image"
        )
    lens = LensData(path.stem, f"imported from {path.name}", [])
    unit = _apply_head(head, lens, path)
    lens.far_object = not np.isfinite(_distance(blocks[0], path))
    for label, block in enumerate(blocks[1:-1], 1):
        row = _row(str(label), block, path, problems, lens)
        row.radius_mm *= unit
        row.thickness_mm *= unit
        row.semi_diameter_mm *= unit
        row.terms = {power: a * unit ** (1 - power) for power, a in row.terms.items()}
        lens.rows.append(row)
    return lens


def _apply_head(head: list[list[str]], lens: LensData, path: Path) -> float:
    unit = 1.0
    primary: int | None = None
    wavelengths = {}
    angles: dict[str, list[float]] = {}
    kind = ANGLES
    for key, *words in head:
        where = f"{path}, {key}"
        if key == "NAME" and words:
            lens.name = " ".join(words)
        elif key == "UNIT" and words:
            unit = unit_mm(words[0], MM_PER, where)
        elif key == "ENPD" and words:
            lens.entrance_pupil_mm = number(words[0], where)
        elif key == "FNUM" and words:
            lens.f_number = number(words[0], where)
        elif key == "PWAV" and words:
            primary = integer(words[0], where)
        elif key == "WAVM" and len(words) > 1:
            wavelengths[integer(words[0], where)] = 1e3 * number(words[1], where)
        elif key == "FTYP" and words:
            kind = words[0]
        elif key in ("XFLN", "YFLN"):
            angles[key] = [number(w, where) for w in words]
    if lens.entrance_pupil_mm is not None:
        lens.entrance_pupil_mm *= unit
    if wavelengths and primary is not None and primary not in wavelengths:
        raise ConfigError(
            f"{path} names the primary wavelength {primary}, and has the wavelengths"
            f" {', '.join(map(str, wavelengths))}; expected one of them in its line PWAV"
        )
    lens.reference_nm = wavelengths.get(primary or 1, lens.reference_nm)
    if kind == ANGLES:
        lens.half_field_deg = (
            widest_deg(angles.get("XFLN", []), angles.get("YFLN", [])) or lens.half_field_deg
        )
    return unit


def _distance(block: list[list[str]], path: Path) -> float:
    for key, *words in block:
        if key == "DISZ" and words and words[0] != "INFINITY":
            return number(words[0], f"{path}, DISZ")
    return np.inf


def _row(label: str, block: list[list[str]], path: Path, problems: Problems, lens: LensData) -> Row:
    row = Row(label)
    parameters = {}
    shape = "STANDARD"
    for key, *words in block:
        where = f"{path}, surface {label}, {key}"
        if key == "TYPE" and words:
            shape = words[0]
        elif key == "STOP":
            row.is_stop = True
        elif key == "CURV" and words:
            curvature = number(words[0], where)
            row.radius_mm = 1 / curvature if curvature else np.inf
        elif key == "CONI" and words:
            row.conic = number(words[0], where)
        elif key == "PARM" and len(words) > 1:
            parameters[integer(words[0], where)] = number(words[1], where)
        elif key == "DISZ" and words:
            row.thickness_mm = np.inf if words[0] == "INFINITY" else number(words[0], where)
        elif key == "DIAM" and words:
            semi = number(words[0], where)
            row.semi_diameter_mm = semi if semi > 0 else np.inf
            row.automatic = len(words) < 2 or words[1] == "0"
        elif key == "GLAS" and words:
            row.glass = _glass(words, label, where, problems, lens)
    if shape == "COORDBRK":
        problems.add(label, "a coordinate break (tilted or decentred)")
    elif shape not in SHAPES:
        problems.add(label, f"type {shape}")
    else:
        row.terms = {SHAPES[shape] * n: a for n, a in parameters.items() if a and SHAPES[shape]}
    return row


def _glass(words: list[str], label: str, where: str, problems: Problems, lens: LensData) -> str:
    name = words[0]
    if name == "MIRROR":
        problems.add(label, "a mirror")
        return ""
    if name == "___BLANK" and len(words) > 4:  # a model glass: nd and Abbe number
        name = f"{words[3]}/{words[4]}"
        index, abbe = (number(w, where) for w in words[3:5])
        lens.glasses[name] = name if abbe else repr(index)
    return name
