"""Field work: the work of kernels that vary over the field, estimated before they are computed.

The grid of field points depends on errors that are measured while it is chosen. Here it is
estimated from the change of the wavefront between its rings.
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

# L1 difference between the point spread of the axis and that of a wavefront that differs by 1 rad
# rms, as a share of a point's light; 0.08 to 0.4 were found with wide and narrow tiles
CHANGED = 0.15
# L1 error, half way between two point spreads, of their mean, if their wavefronts differ by 1 rad
# rms; a share of a point's light; 0.04 to 0.1 were found
BETWEEN = 0.06
# CPU time of a kernel that is computed for one band alone, over the time per band of many bands
ALONE = 1.5


class FieldWork(NamedTuple):
    """The work of kernels that vary over the field, in addition to that of the axis' kernels."""

    reach_s: float  # CPU seconds of the kernels from which the reach of the cores is decided
    searched: float  # number of samples in the transforms that choose the field points
    cores: float  # number of samples in the transforms of the field points' kernels
    points: int  # number of field points; 1: the point spread varies less than the error allowed


def field_work(
    lens: PupilOptics,
    flares: Sequence[Flare],
    angles_rad: Sequence[float],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    shape: tuple[int, int],
) -> FieldWork:
    """Return the work of a lens with a point spread that varies over the field.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    angles_rad : `ALONG` field angles from 0 to the border of the field, rad.
    wavelength_nm : (band,) centres of the bands, nm.
    pitch_um : (y, x) pitch of the tiles, um.
    shape : (y, x) number of tiles of the frame.

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
    wavelength_nm : wavelength at which wavefronts are compared, nm.
    error_allowed : largest share of a point's light that interpolation may misplace.
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
