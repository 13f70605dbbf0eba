"""Accuracy shares: how a lens divides the error allowed over kernels, ghosts and the functionals
of the spectrum, and the costs that it declares to the budget.
"""

from __future__ import annotations

from isethdr_core.data.error_costs import STORE, USUAL, Cost, divided
from isethdr_core.plugins.accuracy_knobs import AccuracyKnob, ErrorShare
from isethdr_core.uncertainty.error_terms import Quantity

from ..psf.error_parts import SPREAD

# Measured (docs/explanation/budget.md): CPU seconds for a million values, tiles x bands, of a
# night drive; errors in standard deviations of the noise.
COSTS = {"kernels": Cost(0.009, 0.7), "functionals": Cost(0.002)}
FAINT_GHOSTS = 0.2  # share for ghosts that are not traced; more run time does not reduce it
ERROR_SHARES = (
    *(ErrorShare(name, cost) for name, cost in COSTS.items()),
    ErrorShare("faint ghosts", reserved=FAINT_GHOSTS),
)
SHARES = {  # of the error that a config allows
    k: e / USUAL for k, e in divided(USUAL * (1 - STORE - FAINT_GHOSTS), COSTS).items()
}

# Shares of the error that the lens may make. Imaging gets what kernels and ghosts leave over.
KERNELS = SHARES["kernels"] / (1 - STORE)  # at most
LEFT = SHARES["functionals"] / (1 - STORE)  # for imaging, at least
# Shares of the error left for imaging.
FUNCTIONALS = 0.9  # of photocurrent
TRANSFORMS = 0.1  # of photocurrent: rounding cannot be reduced, only checked
CONVOLUTION = 1.0  # of irradiance, band by band

# the reference kernels have a fifth of the smallest error, and other sample points
SPECKLE_KNOB = AccuracyKnob(
    "speckle_error",
    (0.12, 0.06, 0.03, 0.015),
    Quantity.IRRADIANCE,
    COSTS["kernels"],
    part=SPREAD,
    reference=0.003,
)
# the error of linear interpolation between field points falls with the square of their distance:
# the number of points is proportional to one over the error
PLACES_KNOB = AccuracyKnob(
    "error_allowed",
    (0.2, 0.1, 0.05, 0.025),
    Quantity.IRRADIANCE,
    Cost(1.0, 1.0),
    matters=lambda lens: lens.field_varies,
)
