"""Wings: kernels beyond the exact core, from the diffraction pattern on lattices of points.

A lattice (`physics.optics.lattice`) samples the pattern of one wavelength somewhat finer than its
speckles. Its points are weighted with a triangle, the convolution of two uniform tiles. This gives
tile means on a grid finer than the tiles. The pattern of a neighbouring wavelength is the same,
scaled about the axis. The mean over a band is therefore read from the grid at scaled tile centres.
The wavelengths are so close that no tile moves by more than half a tile from one to the next. So
speckles become radial streaks for any number of bands.

There are always two independent estimates. Half of their difference is stated as the error.

| module         | content                                                             |
|----------------|---------------------------------------------------------------------|
| `band_parts`   | number of parts of about the same phase into which a band is divided |
| `band_rings`   | the kernel of a band, finer where its error is too large            |
| `lattice_size` | extent and step of the samples of a pattern, their time and memory  |
| `patterns`     | the pattern of one wavelength on two lattices                       |
| `reading`      | the mean over a band, from tile means at scaled places              |
| `tile_means`   | the light from one tile to another, from the points of lattices     |
"""

from .band_parts import MOST_PARTS, PHASE_CHANGE, check_delay, parts_of
from .band_rings import FINEST, ring, rings
from .lattice_size import (
    REFERENCE_NM,
    WRAP,
    WRAP_SHARED,
    Grid,
    fold_seconds,
    lattice_bytes,
    samples_of,
)
from .patterns import Lattice, own, shared, shared_step_um
from .reading import reads_of
from .tile_means import tile_sums

__all__ = [
    "FINEST",
    "MOST_PARTS",
    "PHASE_CHANGE",
    "REFERENCE_NM",
    "WRAP",
    "WRAP_SHARED",
    "Grid",
    "Lattice",
    "check_delay",
    "fold_seconds",
    "lattice_bytes",
    "own",
    "parts_of",
    "reads_of",
    "ring",
    "rings",
    "samples_of",
    "shared",
    "shared_step_um",
    "tile_sums",
]
