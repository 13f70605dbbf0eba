"""Field work: the work of kernels that vary over the field, estimated before they are computed.

The grid of field points depends on errors that are measured while it is chosen. Here it is guessed
from how much the wavefront changes between its rings.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..psf import kernels
from ..pupil.wavefronts import coefficients_um
from . import field_point_psf
from .core_reach import core_reach
from .grid import AROUND
from .meridian import ALONG, meridian
from .point_choice import RINGS
from .reference_bands import WIDTH_NM

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

# share of a point's light, L1, by which the point spread of the axis differs from that of a
# wavefront a radian rms away: 0.08 to 0.4 with wide and narrow tiles
CHANGED = 0.15
# share that the mean of two point spreads, a radian rms apart, misplaces half way: 0.04 to 0.1
BETWEEN = 0.06
ALONE = 2.0  # times the seconds that kernels of many bands take per band: of a band alone


class FieldWork(NamedTuple):
    """The work of kernels that vary over the field, beside that of the kernels of the axis."""

    reach_s: float  # CPU seconds of the kernels that tell how far cores have to reach
    searched: float  # samples of the transforms that choose the field points
    cores: float  # samples of the transforms of the field points' kernels
    points: int  # field points; 1: the point spread varies less than the error allowed


def field_work(
    lens: PupilOptics,
    flares: Sequence[Flare],
    angles_rad: Sequence[float],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    shape: tuple[int, int],
) -> FieldWork:
    """Return the work of a lens whose point spread varies over the field.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    angles_rad : `ALONG` angles off the axis, from 0 to the border of the field.
    wavelength_nm : centres of the bands.
    pitch_um : (y, x) of a tile.
    shape : (y, x) tiles of the frame.

    Raises
    ------
    ConfigError : the field reaches beyond the field angles of the wavefront.
    """
    wave = np.asarray(wavelength_nm, float)
    line = meridian(lens, flares, angles_rad, wave)
    axis = line.along[0]
    border = line.along[-1]
    reach, _ = core_reach(line.along, line.references_nm, pitch_um, shape)
    ends_nm = sorted({line.references_nm[0], line.references_nm[-1]})
    reach_s = ALONE * sum(
        kernels.expected_s(
            kernels.KernelRequest(
                at, flares, (nm - WIDTH_NM / 2, nm + WIDTH_NM / 2), pitch_um, reach
            )
        )
        for nm in ends_nm
        for at in (axis, border)
    )
    rings = expected_rings(line.along, line.references_nm[0], lens.error_allowed)
    around = 0 if line.symmetric else 2 * rings
    tried = len(line.references_nm) * (2 * rings + 1 + around) + rings
    middle = float(np.median(wave))
    one = field_point_psf.transform(border, (middle, middle), pitch_um, reach).samples
    if not rings:
        return FieldWork(reach_s, one * 4 * len(line.references_nm), 0.0, 1)
    on_ring = 1 if line.symmetric else AROUND
    apart = AROUND // 4 + 1 if line.mirrors and not line.symmetric else on_ring
    each = field_point_psf.transforms(border, flares, wave, reach)
    return FieldWork(reach_s, one * tried, one * each * (1 + apart * rings), 1 + on_ring * rings)


def expected_rings(along: Sequence[PupilOptics], wavelength_nm: float, error_allowed: float) -> int:
    """Return the number of rings of field points that a lens is expected to need.

    Parameters
    ----------
    along : `ALONG` lenses of field points from the axis to the border of the field.
    wavelength_nm : at which wavefronts are compared.
    error_allowed : share of a point's light that interpolation may misplace.
    """
    waves = [coefficients_um(at, wavelength_nm) for at in along]
    turn = 2 * np.pi / (1e-3 * wavelength_nm)  # radians per um
    terms = sorted({j for one in waves for j in one} - {0})
    radians = turn * np.array([[one.get(j, 0.0) for j in terms] for one in waves])
    for rings in RINGS[1:]:
        nodes = radians[:: (ALONG - 1) // rings]
        change = float(np.linalg.norm(np.diff(nodes, axis=0), axis=1).max())
        if rings == 1 and CHANGED * change <= error_allowed:
            return 0
        if BETWEEN * change**2 <= error_allowed:
            return rings
    return RINGS[-1]
