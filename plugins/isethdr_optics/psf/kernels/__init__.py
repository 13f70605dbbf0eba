"""Kernels: the share of a tile's light that reaches every other tile of the frame, averaged over a
band.

A kernel is the point spread function averaged over the source tile and integrated over the
receiving tile. Close to the axis it is exact (`exact_core`). Farther out it is an average over many
points and wavelengths, and its sampling error is measured.

| module       | content                                                               |
|--------------|-----------------------------------------------------------------------|
| `band_plan`  | kernel of one band: an exact core and rings from lattices             |
| `computing`  | choice of the method for a request                                    |
| `core_size`  | reach of the exact core, and the fine tiles of a kernel               |
| `expected`   | CPU seconds and memory, estimated before kernels are computed         |
| `kernel_set` | kernels of all bands, their errors and their transforms               |
| `lattices`   | kernels band by band, from lattices or exact cores alone              |
| `lookup`     | kernels from this process, from disk, or else computed                |
| `patterns`   | kernels of all bands from one pattern, or from a few with a wavefront |
| `stored`     | writing kernels to disk and reading them                              |
| `wider`      | a wider exact core and finer rings for kernels from one pattern       |
"""

from ..kernel_request import KernelRequest
from .band_plan import BandPlan
from .computing import computed
from .core_size import without_lattices
from .expected import expected_s, held_bytes
from .kernel_set import Kernels, Wide, joined
from .lattices import can_be_finer, of_lattices
from .lookup import at_hand, forget, kernels
from .patterns import from_patterns
from .wider import fine_rings_fit, wider_cores, with_core

__all__ = [
    "BandPlan",
    "KernelRequest",
    "Kernels",
    "Wide",
    "at_hand",
    "can_be_finer",
    "computed",
    "expected_s",
    "fine_rings_fit",
    "forget",
    "from_patterns",
    "held_bytes",
    "joined",
    "kernels",
    "of_lattices",
    "wider_cores",
    "with_core",
    "without_lattices",
]
