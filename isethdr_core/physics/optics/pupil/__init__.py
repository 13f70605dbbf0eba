"""Pupil: blades, dust and scratches of an aperture, averaged over the cells of any grid.

Every shape is convex, so a horizontal line cuts it in one chord. Means over cells are exact along
x, and take a few lines per cell along y. Where dirt overlaps, its transmissions multiply: `opening`
expands the product of all transmissions into a sum over shapes and their intersections. Lengths are
in millimetres, with the origin on the axis, x right and y down as in the image.

| module              | content                                                                   |
|---------------------|---------------------------------------------------------------------------|
| `convex`            | convex shapes, their intersections, and their chords on level lines       |
| `shapes`            | discs, irises of blades, and rectangles                                   |
| `random_dirt`       | dust and scratches at random positions                                    |
| `shape_sum`         | the transmission as a sum of shapes and of their intersections            |
| `transmitted_light` | the amplitude at points of the pupil, and the energy of all of it         |
| `strip_chords`      | chords through horizontal strips, for all shapes of a sum                 |
| `row_chords`        | chords in rows, which are divided where a side is slanted or turns        |
| `cell_means`        | the mean amplitude of each cell of a grid                                 |
"""

from .cell_means import raster
from .convex import Convex, Matrix
from .random_dirt import Dust, Scratches, dirt
from .row_chords import Chords, gauss_chords
from .shape_sum import opening, overlaps, weighted
from .shapes import blades, disc, strip
from .strip_chords import GAUSS, chord_ends, strip_blocks
from .transmitted_light import energy, transmission

__all__ = [
    "Chords",
    "Convex",
    "Dust",
    "GAUSS",
    "Matrix",
    "Scratches",
    "blades",
    "chord_ends",
    "dirt",
    "disc",
    "energy",
    "gauss_chords",
    "opening",
    "overlaps",
    "raster",
    "strip",
    "strip_blocks",
    "transmission",
    "weighted",
]
