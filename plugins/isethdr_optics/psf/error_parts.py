"""Error parts: names of the parts of the lens's light, keys that several modules use, and the
constructor of error terms.
"""

from __future__ import annotations

from isethdr_core.uncertainty.error_terms import ErrorTerm, How, Quantity, Source

SPREAD = "spread light"  # all light of a pixel that does not come from the tiles it images

# part for `Quantity.OTHER`: the shape of the point spread function; an error of it alone does not
# change the amount of light
POINT_SPREAD = "point spread"

# keys of the errors of kernels; `spread_errors` also gives these errors for every tile
SPECKLE = "kernel speckle"
FAR_PERIOD = "kernel far field period"
AXIS_KERNEL = "kernel of the axis"
KERNELS = (SPECKLE, FAR_PERIOD, AXIS_KERNEL)


def term(  # noqa: PLR0913 - the fields of an `ErrorTerm`, by their names
    value: float,
    unit: str,
    how: How,
    label: str,
    *,
    key: str = "",
    part: str | None = None,
    acts_on: Quantity = Quantity.IRRADIANCE,
) -> ErrorTerm:
    """Return an error term; the stage that records it becomes its source.

    Parameters
    ----------
    value, unit, how, label, part, acts_on : as in
        `isethdr_core.uncertainty.error_terms.ErrorTerm`.
    key : identifies the error within its stage.
    """
    return ErrorTerm(Source(key=key), acts_on, part, float(value), unit, how, label)
