"""Diffraction: the point spread function of any complex pupil, on the same image grid for every
wavelength.

Fraunhofer diffraction (Goodman 2005, Introduction to Fourier Optics, eq. 5-14): the field at image
position u is the Fourier transform of the pupil at u / (wavelength * distance), and the point
spread function is the squared magnitude of the field. A value is a fraction of the light that
passed the pupil; the rest to a sum of 1 lies beyond the grid. Sign: an optical path difference W
sends light to u = +distance * dW/dx, so that tilt along +x moves the image to +x.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import scipy.fft as sf
from scipy.special import j1

Pair = Sequence[float]  # (y, x)
Counts = Sequence[int]  # (y, x)
# number of extra rectangles around an integrated point spread. The integration is circular, so that
# these rectangles are wrong; they are removed.
MARGIN = 3


def psf_from_pupil(  # noqa: PLR0913 - plugins call it with these arguments
    amplitude: npt.ArrayLike,
    opd_um: npt.ArrayLike | None,
    wavelength_nm: npt.ArrayLike,
    pupil_pitch_mm: float,
    focal_length_mm: float,
    pitch_um: float,
    size: int,
    energy_mm2: float | None = None,
    cell_means: bool = False,
    integrated: bool = False,
) -> np.ndarray:
    """Return the point spread function of a sampled pupil, exactly, at any pitch.

    Parameters
    ----------
    amplitude : (y, x) amplitude transmission, real or complex, on square cells of `pupil_pitch_mm`.
    opd_um : (y, x) optical path difference in micrometres, or 0 or None for none.
    wavelength_nm : one wavelength, or several.
    pupil_pitch_mm : side of a cell of the pupil, mm.
    focal_length_mm : distance from the pupil to the image, mm.
    pitch_um : distance of the image samples, um.
    size : number of image samples along each axis; the optical axis is at index size // 2.
    energy_mm2 : the integral of |amplitude|^2, mm2; None: from `energy_of`, which has an error of
        2e-4 for means over 400 cells across.
    cell_means : whether `amplitude` holds means over cells (antialiased) and not samples. The loss
        of light off the axis and of energy by averaging is then corrected.
    integrated : False: intensity at the sample times the sample's area. True: integral over the
        sample's square.

    Returns
    -------
    (y, x), or (wavelength, y, x) for several wavelengths; fraction of the energy per sample.

    Raises
    ------
    ValueError : the pupil is too coarse for the image grid or for the phase; the message says how
        fine it has to be. Or no light passes the pupil.
    """
    amplitude = np.asarray(amplitude)
    opd_um = (
        None
        if opd_um is None or (np.ndim(opd_um) == 0 and opd_um == 0)
        else np.broadcast_to(opd_um, amplitude.shape)
    )
    if energy_mm2 is None:
        energy_mm2 = energy_of(amplitude, pupil_pitch_mm, cell_means)
    if not energy_mm2 > 0:
        raise ValueError("the pupil lets no light through; expected an amplitude above 0 somewhere")
    out = []
    for wavelength in np.atleast_1d(np.asarray(wavelength_nm, float)):
        pupil = amplitude if opd_um is None else amplitude * phase(opd_um, wavelength, amplitude)
        grid = (size, size), (pitch_um, pitch_um)
        if integrated:
            psf = integrated_psf(
                pupil,
                wavelength,
                (pupil_pitch_mm,) * 2,
                focal_length_mm,
                *grid,
                energy_mm2,
                cell_means,
            )
        else:
            psf = sampled_psf(
                pupil,
                wavelength,
                (pupil_pitch_mm,) * 2,
                focal_length_mm,
                *grid,
                energy_mm2,
                cell_means,
            )
        out.append(psf)
    return out[0] if np.ndim(wavelength_nm) == 0 else np.stack(out)


def energy_of(amplitude: npt.ArrayLike, pupil_pitch_mm: float, cell_means: bool = False) -> float:
    """Return the integral of |amplitude|^2 over a sampled pupil, mm2.

    The squares of samples are summed. With cell means this gives too little at the border of the
    pupil, because the square of a mean is less than the mean of squares: a share of about 0.6 /
    (cells across) is missing. The missing energy is proportional to the width of a cell. It is
    found from the same sum over cells twice as wide, and added.

    Parameters
    ----------
    amplitude : (y, x) amplitude transmission, real or complex, on square cells.
    pupil_pitch_mm : side of a cell of the pupil, mm.
    cell_means : whether `amplitude` holds means over cells (antialiased) and not samples.
    """
    amplitude = np.asarray(amplitude)
    fine = _squares(amplitude)
    if not cell_means:
        return fine * pupil_pitch_mm**2
    coarse = []
    # mean over the four ways to pair cells, because each alone depends on the border's position
    for down in (
        0,
        1,
    ):
        for right in (0, 1):
            rows, columns = (
                (offset, (n + offset) % 2) for n, offset in zip(amplitude.shape, (down, right))
            )
            padded = np.pad(amplitude, (rows, columns))
            coarse.append(
                _squares(
                    (padded[::2, ::2] + padded[1::2, ::2] + padded[::2, 1::2] + padded[1::2, 1::2])
                    / 2
                )
            )
    return (2 * fine - float(np.mean(coarse))) * pupil_pitch_mm**2


def _squares(amplitude: np.ndarray) -> float:
    return float(np.sum(amplitude.real**2 + amplitude.imag**2, dtype=float))


def phase(
    opd_um: npt.ArrayLike, wavelength_nm: float, amplitude: npt.ArrayLike | None = None
) -> np.ndarray:
    """Return exp(2 pi i OPD / wavelength).

    Parameters
    ----------
    opd_um : (y, x) optical path difference, um.
    wavelength_nm : wavelength, nm.
    amplitude : (y, x) amplitude transmission; jumps are checked only where it is not 0. None:
        everywhere.

    Raises
    ------
    ValueError : the path difference of neighbours in the pupil differs by half a wavelength or
        more.
    """
    opd_um = np.asarray(opd_um)
    inside = np.ones(opd_um.shape, bool) if amplitude is None else np.abs(amplitude) > 0
    steps = [np.where(_both(inside, a), np.abs(np.diff(opd_um, axis=a)), 0.0) for a in (0, 1)]
    jump = max((float(s.max()) for s in steps if s.size), default=0.0) / (wavelength_nm * 1e-3)
    if jump >= 0.5:
        raise ValueError(
            f"the wavefront changes by {jump:.2f} wavelengths ({wavelength_nm:g} nm) between pupil"
            f" samples; expected less than 0.5: sample the pupil {np.ceil(jump / 0.25):.0f} times"
            " finer"
        )
    return np.exp(2j * np.pi / (wavelength_nm * 1e-3) * opd_um)


def _both(inside: np.ndarray, axis: int) -> np.ndarray:
    first = np.delete(inside, -1, axis)
    second = np.delete(inside, 0, axis)
    return first & second


def sampled_psf(  # noqa: PLR0913 - plugins call it with these arguments
    pupil: np.ndarray,
    wavelength_nm: float,
    pupil_pitch_mm: Pair,
    distance_mm: float,
    count: Counts,
    pitch_um: Pair,
    energy_mm2: float,
    cell_means: bool = False,
) -> np.ndarray:
    """Return intensity times sample area, as a fraction of the energy, on a (y, x) grid of samples
    with the axis at count // 2.

    A chirp-z transform (Bluestein 1970; Jurling 2018, Appl. Opt. 57, 8655) is used along each axis.
    It needs no interpolation and allows any pitch.

    Parameters
    ----------
    pupil : (y, x) complex amplitude in the pupil, including its phase.
    wavelength_nm : wavelength, nm.
    pupil_pitch_mm : (y, x) pupil sampling, mm.
    distance_mm : distance from the pupil to the image, mm.
    count : (y, x) number of image samples.
    pitch_um : (y, x) distance between image samples, um.
    energy_mm2 : energy of the pupil, the integral of |amplitude|^2, mm2.
    cell_means : whether `pupil` holds means over cells (antialiased) and not samples.
    """
    field = np.asarray(pupil)
    loss: list[np.ndarray] = []
    area = 1.0
    for axis in (1, 0):
        # cycles per pupil sample and image sample
        turn = pupil_pitch_mm[axis] * pitch_um[axis] / (wavelength_nm * 1e-3 * distance_mm)
        if abs(turn) * count[axis] > 1.0:
            raise ValueError(
                f"the image grid, {count[axis] * pitch_um[axis]:.6g} um, is wider than the"
                f" {pitch_um[axis] / turn:.6g} um of a pupil pitch of {pupil_pitch_mm[axis]:.4g} mm"
                f" at {wavelength_nm:g} nm; expected a pupil pitch below"
                f" {pupil_pitch_mm[axis] / (turn * count[axis]):.4g} mm"
            )
        first = -(count[axis] // 2)
        field = _chirp_z(field, axis, turn, first, count[axis])
        # means over cells multiply the field by the sinc of the cell; this is divided out
        loss.insert(
            0,
            (
                np.sinc((first + np.arange(count[axis])) * turn) ** -2
                if cell_means
                else np.ones(count[axis])
            ),
        )
        area *= pupil_pitch_mm[axis] * turn
    return (
        (field.real**2 + field.imag**2) * (area / energy_mm2) * loss[0][:, None] * loss[1][None, :]
    )


def _chirp_z(a: np.ndarray, axis: int, turn: float, first: float, count: int) -> np.ndarray:
    """Return the sum over n of a[n] exp(-2 pi i turn n (first + k)) for k < count, with 2 n k =
    n^2 + k^2 - (k - n)^2.
    """
    n = np.arange(a.shape[axis])
    k = np.arange(count)
    size = sf.next_fast_len(len(n) + count - 1)
    lag = np.arange(-(len(n) - 1), count)
    chirp = sf.fft(
        np.roll(np.pad(np.exp(1j * np.pi * turn * lag**2), (0, size - len(lag))), -(len(n) - 1))
    )
    before = np.exp(-1j * np.pi * turn * (n * n + 2 * first * n))
    after = np.exp(-1j * np.pi * turn * k * k)
    if axis == 0:
        before = before[:, None]
        chirp = chirp[:, None]
        after = after[:, None]
    spectrum = sf.fft(a * before, size, axis=axis, overwrite_x=True)
    spectrum *= chirp
    out = sf.ifft(spectrum, axis=axis, overwrite_x=True)
    return (out[:count] if axis == 0 else out[:, :count]) * after


def integrated_psf(  # noqa: PLR0913 - plugins call it with these arguments
    pupil: np.ndarray,
    wavelength_nm: float,
    pupil_pitch_mm: Pair,
    distance_mm: float,
    count: Counts,
    pitch_um: Pair,
    energy_mm2: float,
    cell_means: bool = False,
    boxes: int = 1,
) -> np.ndarray:
    """Return the fraction of the energy on each rectangle of an image grid, the axis at count // 2.

    The function is sampled finer than half of wavelength * f-number, so that the samples hold all
    of it. Its spectrum is multiplied by the sinc of the rectangle. This is exact; the error of sums
    of samples would fall only with the square of their pitch.

    Parameters
    ----------
    pupil : (y, x) complex amplitude in the pupil, including its phase.
    wavelength_nm : wavelength, nm.
    pupil_pitch_mm : (y, x) pupil sampling, mm.
    distance_mm : distance from the pupil to the image, mm.
    count : (y, x) number of rectangles of the image.
    pitch_um : (y, x) sides of a rectangle, um.
    energy_mm2 : energy of the pupil, the integral of |amplitude|^2, mm2.
    cell_means : whether `pupil` holds means over cells (antialiased) and not samples.
    boxes : 1: light of a point, integrated over a rectangle. 2: light of a uniform rectangle of the
        same size, integrated over one.
    """
    extent = [
        np.ptp(np.flatnonzero(np.any(pupil, axis=1 - a))) + 1 if np.any(pupil) else 1
        for a in (0, 1)
    ]
    cutoff_um = [
        wavelength_nm * 1e-3 * distance_mm / (n * p) for n, p in zip(extent, pupil_pitch_mm)
    ]
    wide, fine = _fine_grid(count, pitch_um, cutoff_um)
    psf = sampled_psf(
        pupil,
        wavelength_nm,
        pupil_pitch_mm,
        distance_mm,
        wide,
        [p / q for p, q in zip(pitch_um, fine)],
        energy_mm2,
        cell_means,
    )
    spectrum = sf.rfft2(psf)
    spectrum *= (np.sinc(sf.fftfreq(wide[0]) * fine[0]) ** boxes)[:, None] * (
        np.sinc(sf.rfftfreq(wide[1]) * fine[1]) ** boxes
    )
    spectrum *= fine[0] * fine[1]
    blurred = sf.irfft2(spectrum, s=psf.shape)
    out = blurred[MARGIN * fine[0] :: fine[0], MARGIN * fine[1] :: fine[1]][: count[0], : count[1]]
    return _not_negative(out, pitch_um)


def integrated_airy(
    radius_mm: float,
    wavelength_nm: float,
    distance_mm: float,
    count: Counts,
    pitch_um: Pair,
    boxes: int = 1,
) -> np.ndarray:
    """Return the result of `integrated_psf` for a clean round stop, from the closed form of its
    point spread. It needs no pupil cells and a tenth of the time.

    The intensity is pi (R / (wavelength distance))^2 (2 J1(v) / v)^2 with v = 2 pi R r /
    (wavelength distance) (Airy 1835; Goodman 2005, eq. 4-31).

    Parameters
    ----------
    radius_mm : radius R of the stop, mm.
    wavelength_nm : wavelength, nm.
    distance_mm : distance from the stop to the image, mm.
    count : (y, x) number of rectangles of the image, the axis at count // 2.
    pitch_um : (y, x) sides of a rectangle, um.
    boxes : 1: light of a point, integrated over a rectangle. 2: light of a uniform rectangle of the
        same size, integrated over one.
    """
    per_um = 2 * np.pi * radius_mm / (wavelength_nm * 1e-3 * distance_mm)
    wide, fine = _fine_grid(count, pitch_um, [np.pi / per_um] * 2)
    y, x = (np.arange(n // 2 + 1) * per_um * p / q for n, p, q in zip(wide, pitch_um, fine))
    v = np.hypot(y[:, None], x)
    v[0, 0] = 1.0
    field = j1(v) / v
    field[0, 0] = 0.5
    quarter = field**2 * (y[1] * x[1] / np.pi)
    down, across = (_rectangles(*axis, boxes) for axis in zip(count, wide, fine))
    return _not_negative(down @ quarter @ across.T, pitch_um)


def _fine_grid(count: Counts, pitch_um: Pair, cutoff_um: Pair) -> tuple[list[int], list[int]]:
    """Return ((y, x) number of samples, (y, x) samples per rectangle) that hold all of a point
    spread and its margin.
    """
    # an even number: the sinc is 0 at the highest frequency, so that there is no ringing
    fine = [2 * int(np.ceil(p / c)) for p, c in zip(pitch_um, cutoff_um)]
    return [2 * (n // 2 + MARGIN) * q + 1 for n, q in zip(count, fine)], fine


def _rectangles(count: int, wide: int, fine: int, boxes: int) -> np.ndarray:
    """Return the weights (rectangle, sample) of samples from the axis on, and of their mirror
    images. They are the factor sinc^boxes of `integrated_psf`, written as sums over samples.

    Parameters
    ----------
    count : number of rectangles.
    wide : number of samples.
    fine : number of samples per rectangle.
    boxes : as in `integrated_psf`.
    """
    weights = sf.irfft(np.sinc(sf.rfftfreq(wide) * fine) ** boxes, wide) * fine
    middle = wide // 2
    lag = (MARGIN + np.arange(count)[:, None]) * fine - np.arange(wide)
    both = weights[np.abs(lag)]
    both[:, middle + 1 :] += both[:, middle - 1 :: -1]
    return both[:, middle:]


def _not_negative(out: np.ndarray, pitch_um: Pair) -> np.ndarray:
    """Return the light with negative values set to 0. Rounding and the circular border leave about
    -1e-9 of the peak; larger negative values are refused.
    """
    lowest = float(out.min())
    if lowest < -1e-6 * float(out.max()):
        raise ValueError(
            f"integration over {pitch_um[0]:.4g} x {pitch_um[1]:.4g} um gave negative light, down"
            f" to {lowest:.3g}; expected 0 or more; sample the pupil or the image more finely"
        )
    return np.maximum(out, 0.0)


def diffraction_mtf(
    frequency_per_um: npt.ArrayLike, wavelength_nm: float, f_number: float
) -> np.ndarray:
    """Return the modulation transfer function of a perfect round pupil (Goodman 2005, eq. 6-31).

    Parameters
    ----------
    frequency_per_um : spatial frequency on the image, cycles per um, any shape.
    wavelength_nm : wavelength, nm.
    f_number : focal length / diameter of the pupil.
    """
    v = np.minimum(np.abs(frequency_per_um) * wavelength_nm * 1e-3 * f_number, 1.0)
    return 2 / np.pi * (np.arccos(v) - v * np.sqrt(1 - v * v))
