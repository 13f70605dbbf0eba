"""Defocus of a thin lens: blur of a point as a function of its distance.

The sensor lies at the image of the focus distance s: v = f s / (s - f). The cone of light of a
point at distance d has the diameter of the entrance pupil, A = f / N, at the lens, and a diameter
of A v |1/d - 1/s| at the sensor (Kingslake 1992, chapter 5). Distances are along the axis.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

CUTS = 32  # number of lines per tile that give the area of a disc in it, to 8e-3 of a tile


def blur_diameter_m(
    focal_length_m: float, f_number: float, focus_m: float, depth_m: npt.ArrayLike
) -> npt.NDArray[np.float64]:
    """Return the geometric blur diameter of points, metres on the sensor.

    Parameters
    ----------
    focal_length_m : focal length f, m.
    f_number : f over the diameter of the entrance pupil.
    focus_m : distance that is in focus, above f; may be infinite.
    depth_m : distances of the points, an array; may be infinite.

    Returns
    -------
    Diameters with the shape of `depth_m`, positive for points nearer than the focus distance, which
    are imaged behind the sensor, and negative for points beyond it.
    """
    pupil_m = focal_length_m / f_number
    image_m = focal_length_m / (1.0 - focal_length_m / focus_m)
    return pupil_m * image_m * (1.0 / np.asarray(depth_m, float) - 1.0 / focus_m)


def hyperfocal_m(focal_length_m: float, f_number: float, blur_m: float) -> float:
    """Return the nearest focus distance at which infinity is blurred by at most `blur_m`, m.

    All points from half of this distance on are then blurred by at most `blur_m`: f^2 / (N c) + f
    (Kingslake 1992, chapter 5).

    Parameters
    ----------
    focal_length_m : focal length f, m.
    f_number : focal length / diameter of the entrance pupil, N.
    blur_m : largest diameter of the blur on the sensor, c, m.
    """
    return focal_length_m**2 / (f_number * blur_m) + focal_length_m


def disc_on_tiles(diameter: float) -> npt.NDArray[np.float64]:
    """Return the shares of a uniform disc of light on square tiles; its centre is that of a tile.

    The second moment along x and y is that of the disc, d^2 / 16, for tiles of any width. Below a
    diameter of two tiles, three shares along each axis give this moment. Otherwise the shares are
    the areas of a smaller disc, because the tiles add to the moment.

    Parameters
    ----------
    diameter : diameter of the disc, tiles.

    Returns
    -------
    (n, n), n odd; the sum is 1.
    """
    if diameter < 2.0:
        beside = diameter**2 / 32.0
        line = np.array([beside, 1.0 - 2.0 * beside, beside])
        return np.outer(line, line)
    low = 0.0
    high = diameter / 2.0
    while high - low > 1e-9 * diameter:
        middle = (low + high) / 2.0
        if _second_moment(_areas(middle)) < diameter**2 / 16.0:
            low = middle
        else:
            high = middle
    return _areas(high)


def _areas(radius: float) -> npt.NDArray[np.float64]:
    """Return the shares (n, n) of a disc on tiles; their sum is 1.

    Areas are right to 8e-3 of a tile. The error is largest in the outermost tiles of wide discs.
    """
    reach = max(int(np.ceil(radius - 0.5)), 0)
    fine = (np.arange((2 * reach + 1) * CUTS) + 0.5) / CUTS - (reach + 0.5)
    chord = np.sqrt(np.maximum(radius**2 - fine**2, 0.0))  # half of each chord; exact along x
    ends = np.arange(-reach, reach + 2) - 0.5
    filled = np.clip(ends, -chord[:, None], chord[:, None])
    shares = np.diff(filled, axis=1).reshape(2 * reach + 1, CUTS, -1).sum(axis=1)
    return np.asarray((shares + shares.T) / (2.0 * shares.sum()))


def _second_moment(shares: npt.NDArray[np.float64]) -> float:
    """Return the second moment along x of shares (n, n) around their middle, tiles^2."""
    at = np.arange(len(shares)) - len(shares) // 2
    return float((shares.sum(axis=0) * at**2).sum())
