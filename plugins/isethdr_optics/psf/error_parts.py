"""Error parts: the parts of its light that the lens declares, keys that more than one module uses,
and terms of light.
"""

from __future__ import annotations

from isethdr_core.uncertainty.error_terms import ErrorTerm, How, Quantity, Source

SPREAD = "spread light"  # all light that does not come from the tiles a pixel looks at

# of `Quantity.OTHER`: the shape of the point spread function, which changes no light by itself
POINT_SPREAD = "point spread"

# keys of the errors of kernels, which are also known tile by tile (`spread_errors`)
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
    """Return an error of light; the stage that records it becomes its source.

    Parameters
    ----------
    value, unit, how, label, part, acts_on : as in `isethdr_core.error_terms.ErrorTerm`.
    key : sets the error apart within its stage.
    """
    return ErrorTerm(Source(key=key), acts_on, part, float(value), unit, how, label)
