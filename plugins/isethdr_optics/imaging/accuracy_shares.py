"""Accuracy shares: how a lens divides the error that it is allowed over kernels, ghosts and the
functionals of the spectrum, at the least cost.
"""

from __future__ import annotations

from isethdr_core.uncertainty.budget import STORE, Cost, divided

# Measured (docs/explanation/budget.md): CPU seconds for a million values, tiles x bands, of a
# night drive; errors in standard deviations of the noise.
COSTS = {"kernels": Cost(0.009, 0.7), "functionals": Cost(0.002)}
STORE_COST = Cost(
    0.007
)  # of the rounding of stored radiance, which the core's share was found with
FAINT_GHOSTS = 0.2  # of the fraction: ghosts that are not traced; not bought with seconds
# fraction for which it is divided: what little the shares change with it is worth no seconds
USUAL = 0.1
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
