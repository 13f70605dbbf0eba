"""In front: checks for flares that change the radiance in front of a lens, such as drops and
films.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import quantities
from isethdr_core.data.temporal_modulation import components
from isethdr_core.errors import ConfigError

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr


def checked_values(mixed: xr.DataArray) -> npt.NDArray[np.floating]:
    """Return the array of mixed radiance, after checks of its unit and its values.

    Parameters
    ----------
    mixed : `([component,] wavelength, y, x)`, W m-2 sr-1 nm-1.

    Raises
    ------
    UnitError : `mixed` is not mixed radiance, or holds negative or non-finite light.
    """
    for _, plane in components(mixed):
        quantities.check_mixed(plane)
    return np.asarray(mixed.values)


def check_projection(projection: str, name: str) -> None:
    """Raise ConfigError unless the tiles of a field are equidistant in tangents.

    Parameters
    ----------
    projection : projection of the field.
    name : name of the flare, for the message.
    """
    if projection != "tangent":
        raise ConfigError(
            f"flare {name} and a field in {projection!r} projection; expected tangents; remove this"
            " flare"
        )
