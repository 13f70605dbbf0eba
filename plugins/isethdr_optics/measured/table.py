"""Tables of a measured lens: point spread functions per field angle and wavelength, and figures.

A .npz holds point spread functions: `psf` (field, wavelength, y, x) of any scale, the spacing of
samples `pitch_um`, `field_deg` and `wavelength_nm`. It may hold `energy` (field, wavelength), the
share of a point's light within the samples. A .csv holds MTF curves (`mtf`). The field points lie
along +x; x points right, y down; the chief ray or the centroid is at index size // 2.

Figures over the field, such as distortion, are arrays (field,) in the .npz, or columns of a
separate .csv.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from isethdr_core.data import csv_table
from isethdr_core.errors import CatalogError, ConfigError, UnitError

from .mtf import COLUMNS, point_spread

FIGURES = ("relative_illumination", "distortion_percent", "chief_ray_deg")
EXAMPLE = "example"  # name of the bundled table
MOST_DISTORTION = 90.0  # largest magnitude of distortion, percent


@dataclass(frozen=True, eq=False)
class MeasuredTable:
    """A measured lens.

    Parameters
    ----------
    psf : (field, wavelength, y, x); each sums to 1, as if no light fell beyond the samples.
    energy : (field, wavelength), the share of a point's light that lies within the samples.
    clipped : largest share of a point's light that was negative in a PSF from MTF curves.
    figures : {name of `FIGURES`: (angles deg, values)}.
    """

    psf: np.ndarray
    pitch_um: float
    field_deg: np.ndarray
    wavelength_nm: np.ndarray
    energy: np.ndarray
    clipped: float = 0.0
    figures: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)


def table_path(name: str) -> Path:
    """Return the path of a table, given its path or the name of the bundled one.

    Raises
    ------
    CatalogError : the file does not exist.
    ConfigError : the name ends neither in .npz nor in .csv.
    """
    if name == EXAMPLE:
        return Path(str(files(__package__).joinpath("example.npz")))
    path = Path(name).expanduser()
    if path.suffix.lower() not in (".npz", ".csv"):
        raise ConfigError(
            f"lens.table is {name!r}; expected {EXAMPLE!r}, or a .npz with point spread functions,"
            " or a .csv with MTF curves; type for example lens.table=lens.npz"
        )
    if not path.is_file():
        raise CatalogError(f"{path} is not a file; type lens.table=<file>")
    return path


def load(name: str, figures: str, f_number: float) -> MeasuredTable:
    """Return the checked table of a measured lens.

    Parameters
    ----------
    name : name of the table, or its path.
    figures : path of a .csv with figures over the field, or "".
    f_number : f-number of the lens; MTF curves end at its diffraction limit.

    Raises
    ------
    CatalogError : a file does not exist or cannot be read.
    ConfigError, UnitError : the format is unknown, the scale is missing, or a value is impossible
        for a lens.
    """
    path = table_path(name)
    beside = Path(figures).expanduser() if figures else None
    if beside is not None and not beside.is_file():
        raise CatalogError(f"{beside} is not a file; type lens.figures=<file>.csv")
    changed = beside.stat().st_mtime_ns if beside else 0
    return _load(path, path.stat().st_mtime_ns, beside, changed, f_number)


@lru_cache(maxsize=4)
def _load(
    path: Path, changed: int, beside: Path | None, changed_2: int, f_number: float
) -> MeasuredTable:
    if path.suffix.lower() == ".csv":
        data = point_spread(rows_of(path, COLUMNS, ",".join(COLUMNS)), f_number, path)
    else:
        data = _arrays(path)
    table = _checked(data, path)
    own = {
        name: (table.field_deg, _numbers(data[name], name, path))
        for name in FIGURES
        if name in data
    }
    for name, (angles, values) in (own | (_figures(beside) if beside else {})).items():
        _check_figure(name, angles, values, beside or path)
        table.figures[name] = (angles, values)
    return table


def rows_of(path: Path, columns: tuple[str, ...], first_line: str) -> dict[str, np.ndarray]:
    """Return the columns of a .csv, {name: values}.

    Parameters
    ----------
    path : path of the file.
    columns : names of the columns that must be present.
    first_line : example of the first line, for messages.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : the file is empty, has other separators than commas, names a column twice, lacks a
        column, or has an entry that is not a number.
    """
    try:
        found = csv_table.columns_of(csv_table.read_text(path), path, first_line)
    except OSError as err:
        raise CatalogError(f"{path} cannot be read: {err.strerror}") from None
    except ValueError as err:
        raise UnitError(f"{path} {err}") from None
    missing = [name for name in columns if name not in found]
    if missing:
        raise UnitError(
            f"{path} has the columns {', '.join(found) or 'none'} and lacks"
            f" {', '.join(missing)}; expected a first line {first_line}"
        )
    return found


def _arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        with np.load(path, allow_pickle=False) as file:
            data = {name: np.asarray(file[name]) for name in file.files}
    except Exception as err:  # noqa: BLE001 - zipfile and zlib raise their own for a cut-off file
        why = " ".join(str(err).split())
        raise CatalogError(f"{path} is not a readable .npz file ({why})") from None
    if "pitch_um" not in data:
        raise UnitError(
            f"{path} states no scale; expected pitch_um, the spacing of the samples on the sensor"
            " in micrometres; save it with np.savez(..., pitch_um=0.5)"
        )
    missing = [name for name in ("psf", "field_deg", "wavelength_nm") if name not in data]
    if missing:
        raise UnitError(
            f"{path} holds {', '.join(data)} and lacks {', '.join(missing)}; expected psf (field,"
            " wavelength, y, x), pitch_um, field_deg, wavelength_nm"
        )
    return data


def _numbers(values: np.ndarray, name: str, path: Path) -> np.ndarray:
    """Return an array of a table as float64; UnitError if it is empty or holds no real numbers."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf" or not array.size:
        raise UnitError(
            f"{path}: {name} holds {array.size} values of type {array.dtype}; expected real numbers"
        )
    return array.astype(float)


def _checked(data: dict[str, np.ndarray], path: Path) -> MeasuredTable:
    psf = _numbers(data["psf"], "psf", path)
    angles = np.atleast_1d(_numbers(data["field_deg"], "field_deg", path))
    waves = np.atleast_1d(_numbers(data["wavelength_nm"], "wavelength_nm", path))
    if psf.ndim != 4 or psf.shape[:2] != (len(angles), len(waves)):
        raise UnitError(
            f"{path}: psf is {' x '.join(map(str, psf.shape))}; expected (field, wavelength, y, x),"
            f" here {len(angles)} x {len(waves)} x y x x"
        )
    pitch = float(np.ravel(_numbers(data["pitch_um"], "pitch_um", path))[0])
    if not 0 < pitch < 1e4:
        raise UnitError(f"{path}: pitch_um is {pitch:g}; expected micrometres, more than 0")
    if not np.isfinite(psf).all() or psf.min() < 0:
        wrong = np.argwhere(~(psf >= 0) | np.isinf(psf))[0]
        raise UnitError(
            f"{path}: psf holds {psf[tuple(wrong)]:g} at {angles[wrong[0]]:g} degrees and"
            f" {waves[wrong[1]]:g} nm, sample ({wrong[2]}, {wrong[3]}); expected light, finite and"
            " 0 or more; subtract the background and set what is left below 0 to 0"
        )
    with np.errstate(over="ignore"):
        total = psf.sum((2, 3))
    if not np.all(total > 0):
        raise UnitError(f"{path}: a point spread function is dark; expected light in each")
    if not np.isfinite(total).all():  # values near the largest float
        psf = psf / psf.max((2, 3), keepdims=True)
        total = psf.sum((2, 3))
    rising = np.all(np.diff(angles) > 0) and np.all(np.diff(waves) > 0)
    if not rising or angles[0] != 0 or not angles[-1] < 90:
        raise UnitError(
            f"{path}: field_deg is {np.array2string(angles, threshold=8)}, wavelength_nm"
            f" {np.array2string(waves, threshold=8)}; expected degrees that rise from 0 to below"
            " 90, and nanometres that rise"
        )
    if not (waves[0] >= 100 and np.isfinite(waves).all()):
        raise UnitError(f"{path}: wavelength_nm begins at {waves[0]:g}; expected nanometres")
    energy = _numbers(data.get("energy", 1.0), "energy", path)
    try:
        energy = np.broadcast_to(energy, total.shape)
    except ValueError:
        raise UnitError(
            f"{path}: energy is {' x '.join(map(str, energy.shape))}; expected (field, wavelength),"
            f" here {len(angles)} x {len(waves)}"
        ) from None
    if not np.all((energy > 0) & (energy <= 1)):
        raise UnitError(f"{path}: energy is not within 0 to 1; expected the share within samples")
    scaled = psf / total[:, :, None, None]
    clipped = float(np.ravel(data.get("clipped", 0.0))[0])
    return MeasuredTable(scaled, pitch, angles, waves, np.array(energy), clipped)


def _figures(path: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    columns = rows_of(path, ("field_deg",), "field_deg,distortion_percent")
    tables = {name: (columns["field_deg"], columns[name]) for name in FIGURES if name in columns}
    unknown = [name for name in columns if name not in (*FIGURES, "field_deg")]
    if unknown or not tables:
        raise UnitError(
            f"{path} has the columns {', '.join(columns)}; expected field_deg and some of"
            f" {', '.join(FIGURES)}"
        )
    return tables


def _check_figure(name: str, angles: np.ndarray, values: np.ndarray, path: Path) -> None:
    ranges = {
        "relative_illumination": (0.0, 10.0),
        "distortion_percent": (-MOST_DISTORTION, MOST_DISTORTION),
        "chief_ray_deg": (-90.0, 90.0),
    }
    low, high = ranges[name]
    fits = values.shape == angles.shape and len(angles) > 1
    if not fits or angles[0] != 0 or not np.all(np.diff(angles) > 0):
        raise UnitError(
            f"{path}: {name} has {values.size} values for the angles"
            f" {np.array2string(angles, threshold=8)}; expected one for each of two or more angles"
            " that rise from 0"
        )
    if not np.all((values >= low) & (values <= high)):
        raise UnitError(
            f"{path}: {name} holds {values[~((values >= low) & (values <= high))][0]:g}; expected"
            f" {low:g} to {high:g}"
        )
    if name == "relative_illumination" and values[0] == 0:
        raise UnitError(f"{path}: {name} is 0 on the axis; expected light there")
    # a cubic spline between the entries needs two of them off the axis; they become tangents
    if name == "distortion_percent" and not (len(angles) > 2 and angles[-1] < 90):
        raise UnitError(
            f"{path}: {name} has {len(angles)} angles up to {angles[-1]:g} degrees; expected three"
            " or more, below 90"
        )
