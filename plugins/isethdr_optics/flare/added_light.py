"""Added light: a flare's irradiance on the sensor plane, with the attributes of a lens's
irradiance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import quantities

if TYPE_CHECKING:
    import xarray as xr

    from ..abilities import LensOptics


def added_light(lens: LensOptics, mixed: xr.DataArray, irradiance: np.ndarray) -> xr.DataArray:
    """Return light that a flare adds as a DataArray (wavelength, y, x), W m-2 nm-1.

    Parameters
    ----------
    lens : a lens of this package.
    mixed : mixed radiance, which gives the grid.
    irradiance : (wavelength, y, x), W m-2 nm-1.
    """
    f_m = 1e-3 * lens.focal_length_mm
    full = quantities.full_field(mixed)
    width = mixed.attrs.get("field_width") or full[0]
    height = mixed.attrs.get("field_height") or full[1]
    return quantities.plane(
        irradiance,
        mixed.wavelength.values.astype(float),
        mixed.x.values.astype(float) * f_m,
        mixed.y.values.astype(float) * f_m,
        quantities.IRRADIANCE,
        f_number=lens.f_number,
        focal_length_mm=lens.focal_length_mm,
        throughput_sr=lens.throughput_sr(),
        falloff=lens.falloff,
        field_width=width * f_m,
        field_height=height * f_m,
        pitch_x=quantities.tile_pitch(mixed, "x") * f_m,
        pitch_y=quantities.tile_pitch(mixed, "y") * f_m,
    )
