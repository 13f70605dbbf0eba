"""Accuracy shares: shares of the allowed error for kernels, ghosts and functionals of the spectrum,
and the costs that a lens declares to the budget.
"""

from __future__ import annotations

from isethdr_core.data.error_costs import STORE, USUAL, Cost, divided
from isethdr_core.plugins.accuracy_knobs import AccuracyKnob, ErrorShare
from isethdr_core.uncertainty.error_terms import Quantity

from ..psf.error_parts import SPREAD

# Measured costs (docs/explanation/budget.md): CPU seconds per million values (tiles x bands) of a
# night drive; errors in standard deviations of the noise.
COSTS = {"kernels": Cost(0.009, 0.7), "functionals": Cost(0.002)}
FAINT_GHOSTS = 0.2  # share for ghosts that are not traced; more run time does not reduce it
ERROR_SHARES = (
    *(ErrorShare(name, cost) for name, cost in COSTS.items()),
    ErrorShare("faint ghosts", reserved=FAINT_GHOSTS),
)
SHARES = {  # shares of the error that a configuration allows
    k: e / USUAL for k, e in divided(USUAL * (1 - STORE - FAINT_GHOSTS), COSTS).items()
}

# Shares of the error that is allowed for the lens. Imaging gets the rest after kernels and ghosts.
KERNELS = SHARES["kernels"] / (1 - STORE)  # largest share of the kernels
LEFT = SHARES["functionals"] / (1 - STORE)  # least share of imaging
# Shares of the error that is left for imaging.
FUNCTIONALS = 0.9  # functionals of photocurrent
TRANSFORMS = 0.1  # rounding of photocurrent; it cannot be reduced, only checked
CONVOLUTION = 1.0  # convolutions of irradiance, band by band

# the reference kernels have a fifth of the smallest error, and other sample points
SPECKLE_KNOB = AccuracyKnob(
    "speckle_error",
    (0.12, 0.06, 0.03, 0.015),
    Quantity.IRRADIANCE,
    COSTS["kernels"],
    part=SPREAD,
    reference=0.003,
)
# The error of linear interpolation between field points falls with the square of their distance, so
# that the number of points is proportional to one over the error.
PLACES_KNOB = AccuracyKnob(
    "error_allowed",
    (0.2, 0.1, 0.05, 0.025),
    Quantity.IRRADIANCE,
    Cost(1.0, 1.0),
    matters=lambda lens: lens.field_varies,
)
