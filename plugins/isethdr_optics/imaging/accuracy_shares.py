"""Accuracy shares: what a lens spends the error allowed on, as it declares it to the budget, and
how it divides what it is told over kernels, ghosts and the functionals of the spectrum.
"""

from __future__ import annotations

from isethdr_core.data.error_costs import STORE, USUAL, Cost, divided
from isethdr_core.plugins.accuracy_knobs import AccuracyKnob, ErrorShare
from isethdr_core.uncertainty.error_terms import Quantity

from ..psf.error_parts import SPREAD

# Measured (docs/explanation/budget.md): CPU seconds for a million values, tiles x bands, of a
# night drive; errors in standard deviations of the noise.
COSTS = {"kernels": Cost(0.009, 0.7), "functionals": Cost(0.002)}
FAINT_GHOSTS = 0.2  # of the fraction: ghosts that are not traced; not bought with seconds
ERROR_SHARES = (
    *(ErrorShare(name, cost) for name, cost in COSTS.items()),
    ErrorShare("faint ghosts", reserved=FAINT_GHOSTS),
)
SHARES = {  # of the fraction that a config allows
    k: e / USUAL for k, e in divided(USUAL * (1 - STORE - FAINT_GHOSTS), COSTS).items()
}

# Shares of what the lens is given. Kernels have so much at most: what kernels and ghosts do not
# take is left to the way through the lens,
KERNELS = SHARES["kernels"] / (1 - STORE)
LEFT = SHARES["functionals"] / (1 - STORE)  # which has so much at least. Shares of what is left:
FUNCTIONALS = 0.9  # of the short way, photocurrent
TRANSFORMS = 0.1  # of the short way too: rounding cannot be bought, only checked
CONVOLUTION = 1.0  # of the long way, irradiance, band by band

# the reference has kernels of a fifth of the error, from other points than all of `values`
SPECKLE_KNOB = AccuracyKnob(
    "speckle_error",
    (0.12, 0.06, 0.03, 0.015),
    Quantity.IRRADIANCE,
    COSTS["kernels"],
    part=SPREAD,
    reference=0.003,
)
# linear interpolation between places errs by the square of their distance: as many places as one
# over the error
PLACES_KNOB = AccuracyKnob(
    "error_allowed",
    (0.2, 0.1, 0.05, 0.025),
    Quantity.IRRADIANCE,
    Cost(1.0, 1.0),
    matters=lambda lens: lens.field_varies,
)
