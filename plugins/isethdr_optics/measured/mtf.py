"""Point spread functions from MTF curves.

An MTF contains no phase: the point spread is assumed symmetric, as on the axis. The tangential
curve holds for detail along the radius of the field, the sagittal curve for detail across it. In
other directions their weights are cos^2 and sin^2 of the angle to the radius. A curve ends at the
diffraction limit of the lens, 1 / (wavelength x f-number), to which it is extended by a straight
line. The point spread repeats after `SIZE` samples, so that light from beyond them is folded into
them. Its share is that of a round stop without aberrations.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from isethdr_core.errors import UnitError

COLUMNS = ("field_deg", "wavelength_nm", "frequency_per_mm", "mtf_tangential", "mtf_sagittal")
SIZE = 129  # number of samples of a point spread along each axis
PER_LIMIT = 4  # samples per period of the diffraction limit: twice the necessary number
# Light of a round stop beyond a square of half width r, times r over wavelength x f-number. It is
# 2 / pi^2 for a circle (Airy), times 0.9 for a square, rounded up.
BEYOND = 0.183
LEAST_NM = 100.0  # least wavelength; lower values are in micrometres or wrong
MOST_BEYOND = 0.9  # largest share that is stated


def point_spread(
    columns: dict[str, np.ndarray], f_number: float, path: Path
) -> dict[str, np.ndarray]:
    """Return the arrays of a table of point spread functions, from columns of MTF curves.

    Parameters
    ----------
    columns : {name: values} of the table, one value per row.
    f_number : f-number of the measured lens.
    path : path of the table, for messages.

    Raises
    ------
    UnitError : a value lies outside 0 to 1; a curve has no frequency 0, or a value other than 1
        there; the curves of some field angle and wavelength are missing; or a wavelength is below
        100 nm.
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
    if not waves[0] >= LEAST_NM:
        raise UnitError(
            f"{path}: wavelength_nm holds {waves[0]:g}; expected nanometres, {LEAST_NM:g} or more,"
            " for example 550"
        )
    pitch_um = 1e-3 * waves[0] * f_number / PER_LIMIT
    psf = np.empty((len(angles), len(waves), SIZE, SIZE))
    clipped = 0.0
    half_um = SIZE / 2 * pitch_um
    beyond = np.minimum(BEYOND * 1e-3 * waves * f_number / half_um, MOST_BEYOND)
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
        "energy": np.broadcast_to(1 - beyond, psf.shape[:2]),
        "clipped": np.array(clipped),
    }


def _curves(columns: dict[str, np.ndarray], here: np.ndarray, where: str) -> np.ndarray:
    """Return (3, frequency): the frequency per mm, rising from 0, the tangential and the sagittal
    MTF.
    """
    names = ("frequency_per_mm", "mtf_tangential", "mtf_sagittal")
    rows = np.stack([columns[name][here] for name in names])
    rows = rows[:, np.argsort(rows[0])]
    if rows.shape[1] < 2 or rows[0, 0] != 0 or np.any(np.diff(rows[0]) <= 0):
        raise UnitError(
            f"{where}: the frequencies are {np.array2string(rows[0], threshold=8)} per mm; expected"
            " 0 and at least one higher frequency, each only once"
        )
    if np.any(np.abs(rows[1:, 0] - 1) > 1e-3):
        raise UnitError(
            f"{where}: the MTF at frequency 0 is {rows[1, 0]:.4g} (tangential) and"
            f" {rows[2, 0]:.4g} (sagittal); expected 1; divide each curve by its value at 0"
        )
    return rows


def _transformed(curves: np.ndarray, limit: float, pitch_um: float) -> tuple[np.ndarray, float]:
    """Return the point spread (y, x), and the share of its light that was negative."""
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
