"""Import of a lens file as a prescription: its surfaces, its figures, and its YAML."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import yaml

from isethdr_core.cli.terminal import number_of
from isethdr_core.errors import CatalogError, ConfigError, did_you_mean
from isethdr_core.physics.optics import paraxial
from isethdr_core.physics.optics.ray_trace import collimated, follow, sequential
from isethdr_core.storage.atomic_write import write_text

from ..prescription.figures import spot
from ..prescription.prescription import Prescription, parse
from . import code_v, glasses, pbrt, zemax
from .lens_data import LensData, Problems, Row

Reader: TypeAlias = Callable[[Path, Problems], LensData]
READERS: dict[str, Reader] = {".zmx": zemax.read, ".seq": code_v.read, ".dat": pbrt.read}
# lowest and highest power of r of an asphere
LOWEST = 3
HIGHEST = 30
# factor on semi-diameters that the other program computed, so that rounding stops no ray
CLEARANCE = 1.01
FIELDS = (0.0, 0.7, 1.0)  # shares of the half field at which spots are computed
ASSUMED_HALF_FIELD_DEG = 20.0  # of a file that states no field angles
RAYS = 200  # rays along the radius of the beam, to find the surface that stops them
WIDEST_DEG = 75.0  # widest half field in tangents, which prescriptions are traced in


@dataclass(frozen=True)
class Figures:
    """Figures of a lens at its reference wavelength.

    Parameters
    ----------
    spots : ((field angle deg, rms spot radius um, distance of its centroid from the axis mm), ...),
        on the sensor; the radius is about the centroid. The centroid is NaN if no light of that
        angle passes the lens.
    """

    focal_length_mm: float
    back_focus_mm: float
    f_number: float
    reference_nm: float
    spots: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Imported:
    """A lens file as a prescription."""

    table: dict[str, Any]  # content of the YAML
    lens: Prescription
    notes: tuple[str, ...]  # differences from the file


def imported(path: Path, glass: Sequence[str] = ()) -> Imported:
    """Return the prescription of a lens file.

    Parameters
    ----------
    path : path of the lens file.
    glass : catalogue files .agf, NAME=nd/Vd, or NAME=index.

    Raises
    ------
    ConfigError : the format or a glass is unknown, a surface is not supported, the lens forms no
        image, or no ray along the axis passes it.
    CatalogError : a file does not exist, or holds no lens.
    """
    if path.suffix.lower() not in READERS:
        raise ConfigError(
            f"{path} ends in {path.suffix!r}{did_you_mean(path.suffix, READERS)}; expected a lens"
            " file of one of these programs"
        )
    if not path.is_file():
        raise CatalogError(f"{path} is not a file; type isethdr lens import <file>")
    problems = Problems()
    data = READERS[path.suffix.lower()](path, problems)
    glasses_of_name = glasses.stated(glass) | data.glasses
    notes = list(data.notes)
    rows = _with_stop(data.rows, problems, notes)
    half_field_deg = _half_field_deg(data, notes)
    table = {
        "name": data.name or path.stem,
        "source": data.source,
        "f_number": 1.0,
        "half_field_deg": half_field_deg,
        "reference_nm": float(data.reference_nm),
        "surfaces": [_table_row(row, glasses_of_name, problems) for row in rows],
    }
    problems.refuse(path)
    if not data.far_object:
        table["surfaces"][-1].pop("thickness_mm", None)
        notes.append("the file focuses on a near object; here the sensor is in the far focus")
    elif rows[-1].thickness_mm <= 0:
        table["surfaces"][-1].pop("thickness_mm", None)
    _open_stop(table, data)
    lens = parse(table)
    if np.isnan(spot(lens, 0.0).centroid_mm):
        row = rows[_blocking(lens)]
        size = f"{row.semi_diameter_mm:g} mm" if np.isfinite(row.semi_diameter_mm) else "not stated"
        raise ConfigError(
            f"{path}: no ray along the axis passes surface {row.label} (radius {row.radius_mm:g}"
            f" mm, semi-diameter {size}, conic {row.conic:g}); expected a surface as wide as the"
            " beam; correct its semi-diameter, conic or asphere in the file"
        )
    return Imported(table, lens, tuple(notes))


def _blocking(lens: Prescription) -> int:
    """Return the index of the surface that stops the last of the rays that are parallel to the
    axis.
    """
    indices = lens.indices(lens.reference_nm)
    _, pupil_radius = paraxial.entrance_pupil(lens.surfaces[:-1], indices)
    x = pupil_radius * (np.arange(RAYS) + 0.5) / RAYS
    start = collimated(x, 0 * x, lens.surfaces[0].z_mm, 0.0, 0.0)
    passing = [
        np.sum(follow(lens.surfaces, indices, sequential(k), start).margin > 0)
        for k in range(1, len(lens.surfaces))
    ]
    return int(np.argmin(passing))  # the first one of equal numbers


def figures(lens: Prescription) -> Figures:
    """Return the figures of a lens."""
    optics = lens.surfaces[:-1]
    indices = lens.indices(lens.reference_nm)
    spots = []
    for part in FIELDS:
        angle_deg = part * lens.half_field_deg
        found = spot(lens, float(np.tan(np.radians(angle_deg))))
        spots.append((angle_deg, 1e3 * found.radius_mm, found.centroid_mm))
    pupil = paraxial.entrance_pupil(optics, indices)[1]
    focal = paraxial.focal_length_mm(optics, indices)
    back = paraxial.back_focus_mm(optics, indices)
    return Figures(focal, back, focal / (2 * pupil), lens.reference_nm, tuple(spots))


def run(file: str, glass: Sequence[str], out: str) -> None:
    """Import a lens file, write its YAML, and print its figures.

    Parameters
    ----------
    file : path of the lens file.
    glass : catalogue files .agf, NAME=nd/Vd, or NAME=index.
    out : path of the YAML; empty: the file's name in this folder.
    """
    path = Path(file).expanduser()
    target = Path(out).expanduser() if out else Path(f"{path.stem}.yaml")
    if target.suffix not in (".yaml", ".yml"):
        raise ConfigError(f"--out is {out!r}; expected a .yaml file; type --out {path.stem}.yaml")
    lens = imported(path, glass)
    values = figures(lens.lens)
    write_text(target, yaml.safe_dump(lens.table, sort_keys=False, default_flow_style=None))
    print(f"{lens.lens.name}: {number_of(len(lens.lens.surfaces) - 1, 'surface')}")
    print(f"effective focal length  {values.focal_length_mm:.5g} mm at {values.reference_nm:g} nm")
    print(f"back focus              {values.back_focus_mm:.5g} mm")
    print(f"f-number                {values.f_number:.4g}")
    for angle_deg, radius_um, centroid_mm in values.spots:
        if np.isnan(centroid_mm):
            print(f"rms spot radius         no light passes at {angle_deg:.3g} degrees")
            continue
        print(
            f"rms spot radius         {radius_um:.4g} um at {angle_deg:.3g} degrees,"
            f" {abs(centroid_mm):.4f} mm from the axis"
        )
    for note in lens.notes:
        print(f"note: {note}")
    print("prescription:")
    print(target)
    print("run:")
    print(
        f"isethdr run lens=prescription {_typed('lens.prescription', target)}"
        f" lens.focal_length_mm={values.focal_length_mm:.4g}"
        f" lens.f_number={np.ceil(1e3 * values.f_number) / 1e3:g}"
    )


def _typed(key: str, path: Path) -> str:
    """Return a setting of a path as one word of a shell; Hydra needs quotes of its own around
    special characters.
    """
    text = str(path)
    if re.fullmatch(r"[\w./-]+", text):
        return f"{key}={text}"
    quoted = text.replace("\\", "\\\\").replace("'", "\\'")
    return shlex.quote(f"{key}='{quoted}'")


def _half_field_deg(data: LensData, notes: list[str]) -> float:
    """Return the half field of the design, degrees, and note where it is not that of the file."""
    if data.half_field_deg is None:
        notes.append(
            f"the file states no field angle above 0: a half field of {ASSUMED_HALF_FIELD_DEG:g}"
            " degrees is assumed; if the design has another, change half_field_deg in the YAML file"
        )
        return ASSUMED_HALF_FIELD_DEG
    if data.half_field_deg > WIDEST_DEG:
        notes.append(
            f"the field of the file reaches {data.half_field_deg:g} degrees off the axis; here the"
            f" design field ends at {WIDEST_DEG:g}"
        )
    return min(float(data.half_field_deg), WIDEST_DEG)


def _with_stop(rows: list[Row], problems: Problems, notes: list[str]) -> list[Row]:
    """Return rows in which the stop is a separate plane in air."""
    stops = [k for k, row in enumerate(rows) if row.is_stop]
    if len(stops) != 1:
        problems.add("of the stop", f"the file names {len(stops)} stops")
        return rows
    at = stops[0]
    row = rows[at]
    before = rows[at - 1].glass if at else ""
    if np.isinf(row.radius_mm) and row.glass == before and not row.terms:
        if before:
            problems.add(row.label, f"the stop lies inside {before}")
        return rows
    if before and row.glass:
        problems.add(row.label, "the stop lies between two glasses")
        return rows
    plane = Row(row.label, semi_diameter_mm=row.semi_diameter_mm, is_stop=True)
    surface = replace(row, is_stop=False)
    notes.append(f"the stop is a plane through the vertex of surface {row.label}")
    if not before:
        return [*rows[:at], plane, surface, *rows[at + 1 :]]
    plane.thickness_mm = row.thickness_mm
    surface.thickness_mm = 0.0
    return [*rows[:at], surface, plane, *rows[at + 1 :]]


def _table_row(row: Row, glasses_of_name: dict[str, str], problems: Problems) -> dict[str, Any]:
    if row.is_stop:
        return {"stop": True, "thickness_mm": float(row.thickness_mm), "semi_diameter_mm": 1.0}
    table: dict[str, Any] = {"radius_mm": float(row.radius_mm)}
    table["thickness_mm"] = float(row.thickness_mm)
    if row.glass:
        table["glass"] = glasses.resolve(row.glass, glasses_of_name, row.label, problems)
    if row.conic:
        table["conic"] = float(row.conic)
    for power in row.terms:
        if not LOWEST <= power <= HIGHEST:
            problems.add(row.label, f"a term in r^{power} of the asphere")
    for key, first in (("odd_aspheric", 3), ("aspheric", 4)):
        mine = [p for p, a in row.terms.items() if a and p >= first and (p - first) % 2 == 0]
        if mine:
            powers = range(first, max(mine) + 1, 2)
            table[key] = [float(row.terms.get(power, 0.0)) for power in powers]
    if np.isfinite(row.semi_diameter_mm):
        table["semi_diameter_mm"] = row.semi_diameter_mm * (CLEARANCE if row.automatic else 1.0)
    if not 0 <= row.thickness_mm < np.inf:
        problems.add(row.label, f"a thickness of {row.thickness_mm:g} mm")
    return table


def _open_stop(table: dict[str, Any], data: LensData) -> None:
    """Set the stop's semi-diameter and the f-number from the file's aperture."""
    lens = parse(table)
    optics = lens.surfaces[:-1]
    indices = lens.indices(lens.reference_nm)
    focal = paraxial.focal_length_mm(optics, indices)
    # radius of the entrance pupil for a stop with a semi-diameter of 1 mm
    per_stop = paraxial.entrance_pupil(optics, indices)[1]
    stop = next(row for row in table["surfaces"] if row.get("stop"))
    own = next(row.semi_diameter_mm for row in data.rows if row.is_stop)
    if data.f_number is not None:
        diameter = focal / data.f_number if data.f_number else np.inf
    elif data.entrance_pupil_mm is not None:
        diameter = data.entrance_pupil_mm
    elif np.isfinite(own):
        diameter = 2 * per_stop * own
    else:
        raise ConfigError(
            f"{table['name']!r} states neither an entrance pupil, nor an f-number, nor the size of"
            " its stop; expected one of them in the file"
        )
    if not 0 < diameter < np.inf:
        raise ConfigError(
            f"{table['name']!r} has an entrance pupil of {diameter:g} mm; expected a diameter above"
            " 0 in the file"
        )
    stop["semi_diameter_mm"] = float(diameter / 2 / per_stop)
    table["f_number"] = float(focal / diameter)
