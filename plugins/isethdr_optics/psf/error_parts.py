"""Error parts: the parts of its light that the lens declares, and keys that more than one module
uses.
"""

from __future__ import annotations

SPREAD = "spread light"  # all light that does not come from the tiles a pixel looks at

# keys of the errors of kernels, which are also known tile by tile (`spread_errors`)
SPECKLE = "kernel speckle"
FAR_PERIOD = "kernel far field period"
AXIS_KERNEL = "kernel of the axis"
KERNELS = (SPECKLE, FAR_PERIOD, AXIS_KERNEL)
