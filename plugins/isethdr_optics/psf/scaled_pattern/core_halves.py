"""Core halves: exact cores of all bands, from one pattern that is drawn to the scale of each."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.physics.optics import exact_tiles
from isethdr_core.physics.optics import half_plane_pattern as patterns

from ...pupil import sampled_pupil
from .rings import FINE_STRIPS

if TYPE_CHECKING:
    from ...abilities import PupilOptics
    from .frame import Frame

# wavelengths of an exact core, at Gauss's places in a band: so many per speckle that its corner
# moves, and two more. They leave 1e-5 to 1e-4, as many midpoints of equal parts 7e-3
DENSE_GAUSS = 1.0
MORE_GAUSS = 2
MOST_WAVELENGTHS = 64  # of a band, however wide


class Wavelengths(NamedTuple):
    """Wavelengths whose weighted sum stands for a band."""

    nm: np.ndarray
    weight: np.ndarray  # sum 1


def exact_halves(
    frame: Frame,
    reach: tuple[int, int],
    apply: Callable = map,
    strips: float = FINE_STRIPS,
) -> np.ndarray:
    """Return (band, y = 0 .. reach, x = -reach .. reach), integrated exactly over tiles and
    averaged over wavelengths of each band.

    The pattern is sampled once, where samples carry all of it; each wavelength weights the samples
    drawn to its scale.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    reach : (y, x) tiles from the axis. `apply` : `map`, or the `map` of a pool of threads.
    strips : of a cell of the pupil.
    """
    blur = frame.blur_um
    lattice = exact_tiles.exact_lattice(frame.pitch_um, reach, blur, strips)
    wave = frame.scaled_nm
    pattern = patterns.half_pattern(frame.pupil(frame.shortest_nm), wave, lattice, apply)
    tiles = exact_tiles.ExactTiles(pattern, frame.pitch_um, reach)

    def one(band_nm: np.ndarray) -> np.ndarray:
        rule = gauss_wavelengths(frame.lens, band_nm, frame.pitch_um, reach)
        return sum(
            np.float32(share) * tiles.at(sampled_pupil.scaled_nm(frame.lens, w))
            for w, share in zip(*rule)
        )

    return np.stack(list(apply(one, frame.edges_nm)))


def gauss_wavelengths(
    lens: PupilOptics, band_nm: np.ndarray, pitch_um: tuple[float, float], reach: tuple[int, int]
) -> Wavelengths:
    """Return the Gauss-Legendre wavelengths, nm, in a band for a core of `reach`.

    The pattern is a band-limited function of the wavelength, which they integrate almost exactly.

    Parameters
    ----------
    lens : a lens of this package. `band_nm` : (low, high). `pitch_um` : (y, x) of a tile.
    reach : (y, x) tiles of the core.
    """
    low, high = band_nm
    middle = (low + high) / 2
    width = high - low
    moved = float(np.hypot(*(r * p for r, p in zip(reach, pitch_um)))) * width / middle
    speckles = moved / sampled_pupil.blur_um(lens, middle)
    count = int(min(np.ceil(DENSE_GAUSS * speckles) + MORE_GAUSS, MOST_WAVELENGTHS))
    place, weight = np.polynomial.legendre.leggauss(count)
    return Wavelengths(middle + place * width / 2, weight / 2)


def exact_sums(frame: Frame, reach: tuple[int, int]) -> float:
    """Return the multiplications that `exact_halves` takes.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    reach : (y, x) tiles from the axis to the border of the exact core.
    """
    wave = frame.shortest_nm
    step = exact_tiles.STEP * sampled_pupil.blur_um(frame.lens, wave)
    rows, columns = ((2 * r + 3) * p / step for r, p in zip(reach, frame.pitch_um))
    tall, wide = (
        (exact_tiles.BLOCK + 2) * p / step + 2 * exact_tiles.SUPPORT for p in frame.pitch_um
    )
    waves = sum(
        len(gauss_wavelengths(frame.lens, b, frame.pitch_um, reach).nm) for b in frame.edges_nm
    )
    return waves * (reach[1] + 1.0) * (wide * rows + (2 * reach[0] + 1) * tall)
