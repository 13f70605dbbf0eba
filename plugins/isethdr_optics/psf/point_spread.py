"""Point spread functions for users: at single wavelengths, on a square grid of samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from isethdr_core.physics.diffraction import psf_from_pupil

from ..pupil import fine_cells, pupil_energy, pupil_grid, pupil_size
from . import memory, scatter

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics, PupilOptics


def point_spread(
    lens: PupilOptics,
    wavelength_nm: float | list[float],
    pitch_um: float,
    size: int,
    flares: Sequence[Flare],
    integrated: bool | None,
) -> xr.DataArray:
    """Return the point spread function of a lens with flares; see `DiffractionLimitedLens.psf`.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    wavelength_nm : one or more wavelengths, nm.
    pitch_um : distance of the samples, um.
    size : number of samples along each axis.
    integrated : whether samples are integrals over their squares; None: if `pitch_um` is at least
        wavelength x working f-number.
    """
    waves = np.atleast_1d(np.asarray(wavelength_nm, float))
    memory.check_psf(waves, pitch_um, size)
    if integrated is None:
        integrated = bool(pitch_um >= min(pupil_size.blur_um(lens, w) for w in waves))
    out = []
    for wave in waves:
        pitch_mm = pupil_grid.core_pitch_mm(lens, (size + 8) * pitch_um, wave)
        axis = pupil_grid.axis_mm(lens, pitch_mm)
        pupil = fine_cells.resolved(lens, flares, axis, axis, wave)
        psf = psf_from_pupil(
            pupil,
            None,
            pupil_size.scaled_nm(lens, wave),
            pitch_mm,
            pupil_size.distance_mm(lens),
            pitch_um,
            size,
            pupil_energy.open_energy_mm2(lens, flares, wave),
            cell_means=True,
            integrated=integrated,
        )
        out.append(scatter.mix(psf, flares, wave, (pitch_um, pitch_um), lens.focal_length_mm))
    return psf_array(np.stack(out), waves, pitch_um, lens, integrated)


def psf_array(
    values: np.ndarray,
    wavelength_nm: ArrayLike,
    pitch_um: float,
    lens: LensOptics,
    integrated: bool = True,
) -> xr.DataArray:
    """Return point spread functions as a labelled DataArray, y and x in metres.

    Parameters
    ----------
    values : (wavelength, y, x), the axis at index size // 2.
    wavelength_nm : one or more wavelengths, nm.
    pitch_um : distance of the samples, um.
    lens : a lens of this package.
    integrated : whether samples are integrals over their squares.
    """
    at = (np.arange(values.shape[-1]) - values.shape[-1] // 2) * pitch_um * 1e-6
    return xr.DataArray(
        values,
        dims=("wavelength", "y", "x"),
        coords={"wavelength": np.atleast_1d(np.asarray(wavelength_nm, float)), "y": at, "x": at},
        attrs={
            "units": "1",
            "f_number": lens.f_number,
            "focal_length_mm": lens.focal_length_mm,
            "sample": "integral" if integrated else "point",
        },
    )
