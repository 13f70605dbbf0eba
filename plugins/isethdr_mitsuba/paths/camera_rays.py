"""Camera rays: stratified points of a tile, wavelengths within its bands, and first directions.

The points of a tile are a low-discrepancy sequence (Roberts 2018: multiples of the powers of 1 /
1.3247, the real root of x^3 = x + 1), moved by a random offset of each tile and pass. The
wavelengths are multiples of the golden section, the directions multiples of the roots of 523 and
11, the lamps that candidates lie on multiples of the root of 2, and the candidate that is kept
multiples of the root of 83 (Richtmyer 1951), with offsets too. The roots are those of primes below
700 whose pairs are spread most evenly over squares, at 16 to 1024 points, and that have no simple
ratio to the others. Each point has the same probability. All numbers are integers of 32 bits, which
wrap around by themselves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from zlib import crc32

import drjit as dr
import mitsuba as mi

if TYPE_CHECKING:
    from ..world.view import View

# 2^32 / 1.32472, / 1.32472^2, / 1.61803
ACROSS = 0xC13FA9A9
DOWN = 0x91E10DA6
ALONG = 0x9E3779B9
# 2^32 (523^0.5 - 22), (11^0.5 - 3)
ASIDE = 0xDE8372EF
UP = 0x510E527F
# 2^32 (2^0.5 - 1), (7^0.5 - 2)
TURN = 0x6A09E667
OF_CANDIDATE = 0xA54FF53A
# 2^32 (83^0.5 - 9), and (19^0.5 - 4): from one surface of a path to the next
CHOICE = 0x1C456002
DEEPER = 0x5BE0CD19
WHOLE = 2.0**-32


class Camera:
    """A view on the device. Its values are data and not literals, so that one kernel serves all
    views.
    """

    def __init__(self, view: View) -> None:
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
        """Return the ray through `point` (x, y, of 2^32) of a tile.

        Parameters
        ----------
        row : of the tile, in the complete grid.
        column : of the tile, in the complete grid.
        point : (x, y) of 2^32, place in the tile.
        wavelengths : of the ray, nm.
        """
        x = self.left + (mi.Float(column) + mi.Float(point.x) * WHOLE) * self.pitch_x
        y = self.top + (mi.Float(row) + mi.Float(point.y) * WHOLE) * self.pitch_y
        if self.angles:
            theta = dr.sqrt(x * x + y * y)
            # 1e-4: the series' next term is below float32
            across = dr.select(theta > 1e-4, dr.sin(theta) / theta, 1)
            way = (
                self.right * (across * x) + self.down * (across * y) + self.forward * dr.cos(theta)
            )
        else:
            way = dr.normalize(self.right * x + self.down * y + self.forward)
        return mi.Ray3f(mi.Point3f(self.origin), way, 0.0, wavelengths)


def offsets(seed: Any, numbers: Any) -> tuple[Any, Any, Any, Any]:
    """Return the random offsets of tiles: of the points (x, y), of the wavelengths, of the
    directions (two numbers) and of the lamps (two numbers), of 2^32.
    """
    rng = stream(seed, numbers, "points")
    return (
        mi.Point2u(rng.next_uint32(), rng.next_uint32()),
        rng.next_uint32(),
        mi.Point2u(rng.next_uint32(), rng.next_uint32()),
        mi.Point2u(rng.next_uint32(), rng.next_uint32()),
    )


def share(numbers: Any) -> Any:
    """Return whole numbers, of 2^32, as shares from 0 to below 1, which 32 bits would be rounded up
    to.
    """
    return mi.Point2f(numbers >> 8) * 2.0**-24


def stream(seed: Any, numbers: Any, purpose: str) -> Any:
    """Return random numbers for `purpose`, independent per number.

    Parameters
    ----------
    seed : of the pass.
    numbers : one for each lane; equal numbers give equal random numbers.
    purpose : name of what they are for.
    """
    a, b = mi.sample_tea_32(numbers, seed ^ crc32(purpose.encode()))
    # PCG32 adds the place in the array: the number given counts instead
    moved = mi.UInt64(numbers) - dr.arange(mi.UInt64, dr.width(numbers))
    return mi.PCG32(dr.width(numbers), mi.UInt64(a) + moved, mi.UInt64(b) + moved)
