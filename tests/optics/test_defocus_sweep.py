"""Twenty waves of defocus at f/1.4 to f/22: kernels and their stated errors against a quadrature
over the radius of the pupil.
"""

import numpy as np
import pytest
from isethdr_optics import WavefrontLens
from isethdr_optics.psf import wings
from isethdr_optics.psf.kernels import KernelRequest, computed
from isethdr_optics.psf.kernels.core_size import CORE_SAMPLES
from scipy.special import j0

CENTRE = 550.0
WIDTH = 10.0
WAVES = 20.0
BEYOND = 20  # number of tiles from the border of the exact core to that of the kernel


def radial(radius_um, f_number, wavelength_nm):
    """Return the point spread per um2 of a round defocused pupil at `radius_um`.

    It is one integral over the radius of the pupil (Born and Wolf 1999, section 8.8).
    """
    blur = wavelength_nm * 1e-3 * f_number
    turns = 2 * WAVES + radius_um.max() / blur
    at, weight = np.polynomial.legendre.leggauss(int(3 * turns) + 60)
    rho = (at + 1) / 2
    weight = weight / 2
    pupil = 2 * rho * weight * np.exp(2j * np.pi * WAVES * CENTRE / wavelength_nm * rho**2)
    out = [
        np.abs(j0(np.pi / blur * np.outer(r, rho)) @ pupil) ** 2
        for r in np.array_split(radius_um, 1 + len(radius_um) * len(rho) // 10**6)
    ]
    return np.pi / (4 * blur**2) * np.concatenate(out)


def quadrant(f_number, pitch_um, reach, bands=5):
    """Return shares of a point's light (y, x) from tile to tile, averaged over the band.

    The tiles are those of one quadrant, from the axis to the border.
    """
    points = max(4, int(np.ceil(4 * pitch_um / (CENTRE * 1e-3 * f_number))))
    at = (np.arange((reach + 2) * points) + 0.5) / points - 1
    tiles = np.arange(reach + 1)
    weight = np.maximum(0, 1 - np.abs(at - tiles[:, None])) / points
    known = np.arange(0, 1.5 * (reach + 2) * pitch_um, CENTRE * 1e-3 * f_number / 16)
    light = 0.0
    for wave in CENTRE + ((np.arange(bands) + 0.5) / bands - 0.5) * WIDTH:
        light = light + radial(known, f_number, wave) / bands
    radius = np.hypot(at[:, None], at) * pitch_um
    return weight @ np.interp(radius, known, light) @ weight.T * pitch_um**2


def errors(f_number, pitch_um):
    """Return the stated and the measured relative L1 errors per octave of radius beyond the core,
    and the measured error of the core.

    Octaves without tiles beyond the core are left out.
    """
    half = max(
        3, int(CORE_SAMPLES / np.ceil(2 * pitch_um / (1e-3 * (CENTRE - WIDTH / 2) * f_number)))
    )
    reach = half + BEYOND
    lens = WavefrontLens(
        f_number=f_number, zernike_um={4: WAVES * CENTRE * 1e-3 / (2 * np.sqrt(3))}
    )
    made = computed(
        KernelRequest(
            lens, (), np.array([CENTRE, CENTRE + WIDTH]), (pitch_um, pitch_um), (reach, reach)
        )
    )
    want = quadrant(f_number, pitch_um, reach)
    got = made.bands[0][reach:, reach:]
    y, x = np.indices(want.shape)
    wrong = np.abs(got - want)
    core = np.maximum(y, x) <= made.core[0]
    octave = np.log2(np.maximum(np.hypot(y, x), 1)).astype(int)
    octaves = np.unique(octave[~core])
    seen = [(octave == k) & ~core for k in octaves]
    return (
        made.speckle[0][octaves],
        np.array([wrong[s].sum() / want[s].sum() for s in seen]),
        wrong[core].sum() / want[core].sum(),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "f_number, pitch_um",
    [(1.4, 0.7), (1.4, 2.0), (1.4, 6.0), (2.8, 2.0), (5.6, 6.0), (11, 2.0), (22, 6.0)],
)
def test_twenty_waves_of_defocus_are_as_wrong_as_the_ledger_says(f_number, pitch_um):
    stated, measured, core = errors(f_number, pitch_um)
    assert (stated <= 0.03).all()
    # the ledger has two rows: kernel sampling error, and light wrapped by the transform's period
    assert (measured <= stated + wings.WRAP).all()
    assert (measured < 0.01).all()  # the largest measured value is 0.6 %
    assert core < 5e-3
