"""Camera rays: stratified points of a tile, wavelengths within its bands, and first directions.

The points of a tile are a low-discrepancy sequence (Roberts 2018): multiples of the powers of
1 / 1.3247, where 1.3247 is the real root of x^3 = x + 1. They are shifted by a random offset for
each tile and pass. Other numbers are sequences with random offsets as well (Richtmyer 1951):
wavelengths are multiples of the golden section, directions multiples of the square roots of 523 and
11, the lamps of candidates multiples of the square root of 2, and the choice among candidates
multiples of the square root of 83. The primes are those below 700 for which pairs of numbers cover
a square most evenly, at 16 to 1024 points, and which have no simple ratio to the others. Each point
has the same probability. All numbers are integers of 32 bits; their overflow takes the fractional
part.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from zlib import crc32

import drjit as dr
import mitsuba as mi

if TYPE_CHECKING:
    from ..world.view import View

# Steps of the points of a tile, 2^32 / 1.32472 and 2^32 / 1.32472^2; and of the wavelengths,
# 2^32 / 1.61803
ACROSS = 0xC13FA9A9
DOWN = 0x91E10DA6
ALONG = 0x9E3779B9
# Steps of the two numbers of directions: 2^32 (523^0.5 - 22) and 2^32 (11^0.5 - 3)
ASIDE = 0xDE8372EF
UP = 0x510E527F
# Steps of the lamps of candidates: 2^32 (2^0.5 - 1) from path to path, and 2^32 (7^0.5 - 2) from
# candidate to candidate
TURN = 0x6A09E667
OF_CANDIDATE = 0xA54FF53A
# Step of the choice among candidates, 2^32 (83^0.5 - 9); and step from one surface of a path to the
# next, 2^32 (19^0.5 - 4)
CHOICE = 0x1C456002
DEEPER = 0x5BE0CD19
WHOLE = 2.0**-32  # converts an integer of 32 bits to a share


class Camera:
    """A view on the device. Its values are data and not literals, so that one kernel serves all
    views.
    """

    def __init__(self, view: View) -> None:
        """Copy the grid and the pose of `view` to the device."""
        length = lambda v: dr.opaque(mi.Float, float(v))
        self.angles = view.projection == "equidistant"
        self.pitch_x = length(view.pitch_x)
        self.pitch_y = length(view.pitch_y)
        self.left = length(view.x[0] - (view.cut[1] + 0.5) * view.pitch_x)
        self.top = length(view.y[0] - (view.cut[0] + 0.5) * view.pitch_y)
        self.origin, self.right, self.down, self.forward = (
            mi.Vector3f(*map(length, v))
            for v in (view.origin_m, view.right, view.down, view.forward)
        )

    def ray(self, row: Any, column: Any, point: Any, wavelengths: Any) -> Any:
        """Return the ray through a point of a tile.

        Parameters
        ----------
        row : row of the tile in the complete grid.
        column : column of the tile in the complete grid.
        point : (x, y) position in the tile, as shares of 2^32.
        wavelengths : wavelengths of the ray, nm.
        """
        x = self.left + (mi.Float(column) + mi.Float(point.x) * WHOLE) * self.pitch_x
        y = self.top + (mi.Float(row) + mi.Float(point.y) * WHOLE) * self.pitch_y
        if self.angles:
            theta = dr.sqrt(x * x + y * y)
            # below 1e-4, the next term of the series is below the resolution of float32
            across = dr.select(theta > 1e-4, dr.sin(theta) / theta, 1)
            way = (
                self.right * (across * x) + self.down * (across * y) + self.forward * dr.cos(theta)
            )
        else:
            way = dr.normalize(self.right * x + self.down * y + self.forward)
        return mi.Ray3f(mi.Point3f(self.origin), way, 0.0, wavelengths)


def offsets(seed: Any, numbers: Any) -> tuple[Any, Any, Any, Any]:
    """Return the random offsets of tiles, as shares of 2^32: for the points (x, y), the
    wavelengths, the directions (two numbers) and the lamps (two numbers).
    """
    rng = stream(seed, numbers, "points")
    return (
        mi.Point2u(rng.next_uint32(), rng.next_uint32()),
        rng.next_uint32(),
        mi.Point2u(rng.next_uint32(), rng.next_uint32()),
        mi.Point2u(rng.next_uint32(), rng.next_uint32()),
    )


def share(numbers: Any) -> Any:
    """Return integers of 32 bits as shares of 2^32, at least 0 and below 1. Only their upper 24
    bits are used, because float32 would round the largest 32-bit integers up to 1.
    """
    return mi.Point2f(numbers >> 8) * 2.0**-24


def stream(seed: Any, numbers: Any, purpose: str) -> Any:
    """Return a random number generator with an independent stream for each of `numbers`.

    Parameters
    ----------
    seed : seed of the pass.
    numbers : number of the stream of each lane; equal numbers give equal random numbers.
    purpose : name of the purpose; streams for different purposes are independent.
    """
    a, b = mi.sample_tea_32(numbers, seed ^ crc32(purpose.encode()))
    # PCG32 adds the index in the array to state and stream; this replaces it by the given number
    moved = mi.UInt64(numbers) - dr.arange(mi.UInt64, dr.width(numbers))
    return mi.PCG32(dr.width(numbers), mi.UInt64(a) + moved, mi.UInt64(b) + moved)
