"""Scaled pattern: the kernels of all bands from one diffraction pattern, for pupils without phase.

The pattern of such a pupil keeps its shape and grows in proportion to the wavelength. So it is
computed at one wavelength, and scaled for all others.

Close to the axis, tiles are integrated exactly, by weights on band-limited samples (`exact_tiles`).
Farther out, means over tiles and bands are read ring by ring from running sums along rays
(`ray_sums`). Inner rings use finer lattices: a band moves their light by so little that few
speckles are averaged.

| module          | content                                                             |
|-----------------|---------------------------------------------------------------------|
| `column_errors` | errors of kernels, from direct sums in a few columns of tiles       |
| `core_halves`   | exact cores of all bands, from one pattern scaled to each band      |
| `core_sizes`    | exact cores beyond the usual size, their errors, and possible sizes |
| `frame`         | bands and tiles of kernels, and the size of their exact core        |
| `limits`        | lenses and frames that one pattern serves, and its memory           |
| `read_rings`    | kernels of all bands, read ring by ring around their exact core     |
| `rings`         | sampling of the pattern and of the rings beyond the exact core      |
"""

from .column_errors import (
    Checked,
    Errors,
    checked_columns,
    columns_together,
    direct_sums,
    errors,
    of_whole_kernels,
    wrong_columns,
)
from .core_halves import core_wavelengths, exact_halves, exact_sums
from .core_sizes import FINE_COLUMNS, Core, CoreSize, wider_core, wider_cores
from .frame import Frame
from .limits import LEAST_CORE, lattices_fit, memory_bytes, serves
from .read_rings import fine_enough, halves
from .rings import (
    FINE,
    FINE_STRIPS,
    USUAL,
    WRAP,
    Level,
    Rings,
    fine_rings,
    finer_rings,
    lattice,
    places,
    rays_per_tile,
    reaches,
    usual_rings,
    wrap,
)

__all__ = [
    "Checked",
    "Core",
    "CoreSize",
    "Errors",
    "FINE",
    "FINE_COLUMNS",
    "FINE_STRIPS",
    "Frame",
    "LEAST_CORE",
    "Level",
    "Rings",
    "USUAL",
    "WRAP",
    "checked_columns",
    "columns_together",
    "core_wavelengths",
    "direct_sums",
    "errors",
    "exact_halves",
    "exact_sums",
    "fine_enough",
    "fine_rings",
    "finer_rings",
    "halves",
    "lattice",
    "lattices_fit",
    "memory_bytes",
    "of_whole_kernels",
    "places",
    "rays_per_tile",
    "reaches",
    "serves",
    "usual_rings",
    "wider_core",
    "wider_cores",
    "wrap",
    "wrong_columns",
]
