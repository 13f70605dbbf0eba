"""Ideal: the inverse of an ideal sensor, without regard to noise and saturation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from isethdr_core.errors import UnitError

from .develop import PictureNoise, develop, finish, picture_attrs, solve_matrix
from .development_fields import Development
from .readout.captures_check import check_captures
from .readout.combine import single_capture
from .readout.electrons import chosen, falloff, readouts
from .spectra import light

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class IdealIsp:
    """Inverse of the ideal sensor: least-squares colour matrix, and no demosaic if every pixel
    samples every channel.
    """

    THREAD_SAFE: ClassVar[bool] = True

    def __call__(self, captures: xr.Dataset) -> xr.Dataset:
        """Return the picture. It is exact if the channels span the colour matching functions and
        there is no filter array.

        Without a filter array, every capture is one channel at every pixel. With a filter array,
        the first capture is demosaiced. The colour matrix ignores noise.
        """
        check_captures(captures)
        filters = captures["filter"].values
        alone = np.all(filters == filters[0, 0])
        if not alone:
            captures = chosen(captures, "")
        elif captures.sizes["channel"] > 1:
            raise UnitError(
                f"the filter array samples only one of {captures.sizes['channel']} channels;"
                " expected at least one whole period of the pattern; crop it less"
            )
        wavelength_nm = captures.wavelength.values
        reads = readouts(captures, light("daylight", wavelength_nm))
        mosaics = [single_capture(read) for read in reads]
        how = Development(design_snr=np.inf)
        if not alone:
            return develop(mosaics[0], reads[:1], captures, how, how.balance)
        response = np.stack([r.response[filters[0, 0]] for r in reads])
        level = falloff(captures)
        lit = level > 0  # other pixels get no light through the lens, and are not valid
        level = np.where(lit, level, 1.0)
        matrix = solve_matrix(response, wavelength_nm, how.balance, how.design_snr)
        # captures of one photodiode would share its fixed pattern; an ideal sensor has none, so
        # captures count as independent
        fixed = np.array([np.broadcast_to(m.fixed.total_e2(), level.shape) for m in mosaics])
        temporal = np.array([m.variance_e2 for m in mosaics])
        noise = PictureNoise(
            *(np.tensordot(matrix**2, values / level**2, axes=1) for values in (temporal, fixed))
        )
        planes = np.stack([m.signal_e for m in mosaics]) / level
        valid = np.all([m.valid for m in mosaics], axis=0) & lit
        return finish(
            matrix,
            planes,
            noise,
            valid,
            captures,
            picture_attrs(captures, response, how, how.balance),
        )
