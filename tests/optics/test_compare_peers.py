"""Point spread functions against prysm and GalSim. The extra `compare` installs both; without it,
the tests are skipped with a message.
"""

import numpy as np
import pytest
from isethdr_optics import WavefrontLens

from isethdr_core.physics.diffraction import psf_from_pupil
from isethdr_core.physics.optics.pupil import disc, opening, raster
from isethdr_core.physics.optics.zernike import wavefront_um

ABERRATED = {4: 0.05, 8: 0.03, 12: 0.02, 5: -0.03}  # {OSA index: um rms}
WHY = "install it with: pip install isethdr[compare]"


def circle(samples, obscured=0.0):
    """Return the area-weighted cells of a round pupil of 1 mm, and their positions along an axis,
    mm."""
    axis = (np.arange(samples + 2) - (samples + 1) / 2) / samples
    losses = [(disc(0, 0, obscured / 2), 1.0)] if obscured else []
    return raster(opening(disc(0, 0, 0.5), losses), axis, axis).astype(float), axis


@pytest.mark.parametrize(
    "zernike_um, obscured", [({}, 0.0), ({}, 0.4), (ABERRATED, 0.0), (ABERRATED, 0.4)]
)
def test_prysm_of_the_same_pupil(zernike_um, obscured):
    """Both transform the same samples of the pupil; prysm's wavefront is from its own
    polynomials."""
    polynomials = pytest.importorskip("prysm.polynomials", reason=WHY)
    from prysm.propagation import focus_fixed_sampling

    from isethdr_core.physics.optics.zernike import order

    cells, axis = circle(300, obscured)
    x, y = np.meshgrid(axis / 0.5, axis / 0.5)
    opd = sum(
        (
            c * polynomials.zernike_nm(*order(j), np.hypot(x, y), np.arctan2(y, x), norm=True)
            for j, c in zernike_um.items()
        ),
        0 * x,
    )
    pitch_um = 0.5
    size = 128
    ours = psf_from_pupil(
        cells,
        wavefront_um(zernike_um, axis / 0.5, axis / 0.5),
        550.0,
        axis[1] - axis[0],
        4.0,
        pitch_um,
        size,
    )
    field = focus_fixed_sampling(
        cells * np.exp(-2j * np.pi / 0.55 * opd), axis[1] - axis[0], 4.0, 0.55, pitch_um, size
    )
    theirs = np.abs(field) ** 2
    # prysm's phase has the opposite sign, which turns the image by 180 degrees about the axis
    theirs = np.roll(theirs[::-1, ::-1], 1, axis=(0, 1))
    # After the turn, the border row and column have no counterpart. 1e-9: both are sums of the same
    # products and differ by rounding only.
    ours, theirs = (p[1:, 1:] / p[1:, 1:].sum() for p in (ours, theirs))
    assert np.abs(ours - theirs).sum() < 1e-9


def test_prysm_from_its_own_mask():
    """Compare a whole lens with prysm's own circle and polynomials.

    prysm's pupil has cells of 1/2000 of the stop, each either open or closed.
    """
    geometry = pytest.importorskip("prysm.geometry", reason=WHY)
    from prysm.polynomials import zernike_nm
    from prysm.propagation import focus_fixed_sampling

    from isethdr_core.physics.optics.zernike import order

    axis = (np.arange(2002) - 1000.5) / 2000
    x, y = np.meshgrid(axis, axis)
    r = np.hypot(x, y)
    t = np.arctan2(y, x)
    opd = sum(c * zernike_nm(*order(j), r / 0.5, t, norm=True) for j, c in ABERRATED.items())
    field = focus_fixed_sampling(
        geometry.circle(0.5, r) * np.exp(2j * np.pi / 0.55 * opd),
        axis[1] - axis[0],
        4.0,
        0.55,
        0.5,
        65,
    )
    theirs = np.abs(field[::-1]) ** 2  # y points up in the standard, down in rows of a kernel
    ours = WavefrontLens(zernike_um=ABERRATED).psf(550.0, 0.5, 65, integrated=False).values[0]
    forms = [np.abs(ours / ours.sum() - p / p.sum()).sum() for p in (theirs, theirs[::-1, ::-1])]
    assert min(forms) < 1e-4  # hard mask 2000^-1.5; area-weighted cells 4e-5


@pytest.mark.parametrize("obscured", [0.0, 0.3])
@pytest.mark.filterwarnings(
    "ignore:Input pupil_plane_scale"
)  # a pupil plane 4 times as wide as the stop sets the sampling of the image
def test_galsim_of_the_same_pupil(obscured):
    """Compare with GalSim's OpticalPSF, which has its own Zernike polynomials and transform, and
    an annulus of cells that are either open or closed.
    """
    galsim = pytest.importorskip("galsim", reason=WHY)
    noll = {4: 4, 5: 6, 8: 8, 12: 11}  # OSA index: Noll index, which GalSim uses
    waves = np.zeros(12)
    for j, c in ABERRATED.items():
        waves[noll[j]] = c / 0.55
    aperture = galsim.Aperture(
        diam=1.0, lam=550.0, obscuration=obscured, pupil_plane_scale=1 / 512, pupil_plane_size=4.0
    )
    pitch_um = 0.5
    size = 65
    # GalSim's stop is 1 m wide, so 550e-9 rad there are 2.2 um here. GalSim interpolates its image
    # between samples of wavelength x f-number / 4; a Lanczos kernel of order 31 keeps the error of
    # that below the tolerance.
    profile = galsim.OpticalPSF(
        lam=550.0,
        diam=1.0,
        aper=aperture,
        aberrations=waves,
        obscuration=obscured,
        scale_unit=galsim.radians,
        interpolant=galsim.Lanczos(31),
        suppress_warning=True,
    )
    theirs = profile.drawImage(
        nx=size, ny=size, scale=pitch_um / 2.2 * 550e-9, method="no_pixel", dtype=float
    ).array[::-1, ::-1]
    axis = np.unique(aperture.u_illuminated.round(9))
    step = np.diff(axis).min()
    low = axis[0]
    high = axis[-1]
    whole = np.arange(round((high - low) / step) + 1) * step + low
    cells = np.zeros((len(whole), len(whole)))
    cells[
        np.rint((aperture.v_illuminated - low) / step).astype(int),
        np.rint((aperture.u_illuminated - low) / step).astype(int),
    ] = 1.0
    opd = wavefront_um(ABERRATED, whole / 0.5, whole / 0.5)
    # GalSim's axis lies on a sample, the axis here between two samples. A shift of the pupil by
    # half a sample only changes the phase of the field, not the light.
    ours = psf_from_pupil(cells, opd, 550.0, step, 4.0, pitch_um, size)
    assert np.abs(ours / ours.sum() - theirs / theirs.sum()).sum() < 1e-4
