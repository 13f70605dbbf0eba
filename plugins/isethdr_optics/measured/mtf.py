"""Point spread functions of MTF curves.

An MTF contains no phase: the point spread is assumed symmetric, as on the axis. Between the
tangential curve (detail along the radius of the field) and the sagittal curve (detail across it),
the square of the cosine of the angle weights them. A curve ends at the diffraction limit of the
lens, 1 / (wavelength x f-number), to which it is extended by a straight line.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from isethdr_core.errors import UnitError

COLUMNS = (
    "field_deg",
    "wavelength_nm",
    "frequency_per_mm",
    "mtf_tangential",
    "mtf_sagittal",
)
SIZE = 129  # samples of a point spread
PER_LIMIT = 4  # samples per period of the diffraction limit: twice what it needs


def point_spread(
    columns: dict[str, np.ndarray], f_number: float, path: Path
) -> dict[str, np.ndarray]:
    """Return the arrays of a table of point spread functions, from columns of MTF curves.

    Parameters
    ----------
    columns : {name: values} of the table, one value per row.
    f_number : of the measured lens.
    path : of the table, for messages.

    Raises
    ------
    UnitError : values outside 0 to 1, a curve without frequency 0 or with a value other than 1
        there, or curves missing at some field and wavelength.
    """
    for name in ("mtf_tangential", "mtf_sagittal"):
        values = columns[name]
        if not np.all((values >= 0) & (values <= 1)):
            raise UnitError(
                f"{path}: {name} holds {values[~((values >= 0) & (values <= 1))][0]:g}; expected 0"
                " to 1"
            )
    if not np.all(columns["frequency_per_mm"] >= 0):
        raise UnitError(f"{path}: frequency_per_mm is negative; expected line pairs per mm")
    angles = np.unique(columns["field_deg"])
    waves = np.unique(columns["wavelength_nm"])
    pitch_um = 1e-3 * waves[0] * f_number / PER_LIMIT
    psf = np.empty((len(angles), len(waves), SIZE, SIZE))
    clipped = 0.0
    for k, angle in enumerate(angles):
        for j, wave in enumerate(waves):
            rows = (columns["field_deg"] == angle) & (columns["wavelength_nm"] == wave)
            curves = _curves(columns, rows, f"{path}: {angle:g} degrees and {wave:g} nm")
            limit = 1e6 / (wave * f_number)
            psf[k, j], dark = _transformed(curves, limit, pitch_um)
            clipped = max(clipped, dark)
    return {
        "psf": psf,
        "pitch_um": np.array(pitch_um),
        "field_deg": angles,
        "wavelength_nm": waves,
        "clipped": np.array(clipped),
    }


def _curves(columns: dict[str, np.ndarray], here: np.ndarray, where: str) -> np.ndarray:
    """Return (3, frequency): frequency per mm rising from 0, tangential and sagittal MTF."""
    names = ("frequency_per_mm", "mtf_tangential", "mtf_sagittal")
    rows = np.stack([columns[name][here] for name in names])
    rows = rows[:, np.argsort(rows[0])]
    if rows.shape[1] < 2 or rows[0, 0] != 0 or np.any(np.diff(rows[0]) <= 0):
        raise UnitError(f"{where}: the frequencies are {rows[0].tolist()}; expected 0 and more")
    if np.any(np.abs(rows[1:, 0] - 1) > 1e-3):
        raise UnitError(
            f"{where}: the MTF at frequency 0 is {rows[1:, 0].tolist()}; expected 1: state the"
            " scale by dividing by it"
        )
    return rows


def _transformed(curves: np.ndarray, limit: float, pitch_um: float) -> tuple[np.ndarray, float]:
    """Return the point spread (y, x) and the share of its light that was below 0."""
    frequency, tangential, sagittal = curves
    if frequency[-1] < limit:
        frequency = np.append(frequency, limit)
        tangential = np.append(tangential, 0.0)
        sagittal = np.append(sagittal, 0.0)
    axis = np.fft.fftfreq(SIZE, 1e-3 * pitch_um)
    across, down = np.meshgrid(axis, axis)
    radius = np.hypot(across, down)
    along = np.divide(across**2, radius**2, out=np.full_like(radius, 0.5), where=radius > 0)
    mtf = [np.interp(radius, frequency, v, right=0.0) for v in (tangential, sagittal)]
    spread = np.fft.fftshift(np.fft.ifft2(along * mtf[0] + (1 - along) * mtf[1]).real)
    dark = -float(np.minimum(spread, 0).sum())
    return np.maximum(spread, 0), dark
