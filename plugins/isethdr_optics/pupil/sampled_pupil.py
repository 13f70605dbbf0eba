"""Pupils: stop, wavefront and flares of a lens put together on any grid of cells."""

from __future__ import annotations

import cmath
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.diffraction import energy_of
from isethdr_core.physics.optics import lattice as lattices
from isethdr_core.physics.optics import pupil as shapes
from isethdr_core.physics.optics.pupil import shape_sum
from isethdr_core.physics.optics.zernike import wavefront_at, wavefront_um
from isethdr_core.plugins.protocols import TransmitsPupil

from ..abilities import DrawsPupil
from . import apodization
from .pupil_map import over_pupil, stop_from_pupil
from .wavefronts import coefficients_um, slopes, steepest_um

if TYPE_CHECKING:
    from isethdr_core.physics.optics.pupil import Convex
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

CORE_SAMPLES = 768  # across the stop: kernel values to 1e-4 (L1), measured against 3072
# across the stop for a narrow image, and per wavelength x f-number of its width
FEWEST_SAMPLES = 256
BORDER = 4.0
MOST_SAMPLES = 8192
ENERGY_SAMPLES = 2048  # across the stop, where its energy is not known from shapes
# of `shape_sum.MOST_TERMS`: grains and scratches in a square around a pupil whose overlaps are still
# drawn. The usual dirt has 1.2 terms for each of them
DRAWN_EASILY = 0.7
ANY_NM = 550.0  # how shapes overlap is the same at all wavelengths
DARK = 1e-6  # of the stop's light: less is the rounding of sums over shapes
FINE_TURNS = 1 / 32  # of phase per cell at most, where amplitude and phase are multiplied
# of a point's light (L1) at most, that cells so fine put wrong: measured against cells a third as
# wide, orders 2 to 40
CELLS = 4e-4
# of a cell, per axis: half a turn per cell, the most that is not refused, takes 16
PARTS = (
    1,
    2,
    3,
    4,
    6,
    8,
    12,
    16,
)
BLOCK = 16  # cells, per axis, that are divided alike
# of a pupil's energy is left in means over cells when its phase turns a quarter wave from cell to
# cell
UNRESOLVED = 0.8


def radius_mm(lens: PupilOptics) -> float:
    """Return the radius of the round stop, mm."""
    return lens.focal_length_mm / lens.f_number / 2


def reach_mm(lens: PupilOptics) -> float:
    """Return the distance from the axis, mm, beyond which the pupil is dark: the stop's radius, or
    more where its image is larger.
    """
    return radius_mm(lens) * max(
        1.0, float(np.linalg.norm(lens.pupil_matrix, 2)) if lens.pupil_matrix else 1.0
    )


def check_dirt(lens: PupilOptics, flares: Sequence[Flare]) -> None:
    """Refuse so much dirt that its overlaps cannot be drawn, before any other work.

    It is tried where there are so many grains and scratches that seconds are well spent; few large
    ones that overlap too often are refused when the pupil is drawn.

    Raises
    ------
    ConfigError : more dirt than can be drawn.
    """
    if len(_shapes(lens, flares)[1]) > DRAWN_EASILY * shape_sum.MOST_TERMS:
        terms(lens, flares, ANY_NM)


def stop_mm2(lens: PupilOptics) -> float:
    """Return the area of the clean stop as the image sees it, mm2."""
    matrix = lens.pupil_matrix
    return np.pi * radius_mm(lens) ** 2 * (abs(float(np.linalg.det(matrix))) if matrix else 1.0)


def distance_mm(lens: PupilOptics) -> float:
    """Return the distance from the pupil to the image, mm: focal length x (1 + magnification)."""
    return lens.focal_length_mm * (1 + lens.magnification)


def scaled_nm(lens: PupilOptics, wavelength_nm: float) -> float:
    """Return the wavelength, nm, whose diffraction pattern has the size of this one's, with the
    pupil that shapes are drawn in.
    """
    return wavelength_nm / lens.pupil_scale(wavelength_nm)


def blur_um(lens: PupilOptics, wavelength_nm: float) -> float:
    """Return wavelength x working f-number, um: the reciprocal of the highest spatial frequency."""
    return scaled_nm(lens, wavelength_nm) * 1e-3 * distance_mm(lens) / (2 * radius_mm(lens))


def axis_mm(lens: PupilOptics, pitch_mm: float) -> np.ndarray:
    """Return cell centres, symmetric about the axis, that cover the pupil with a cell to spare on
    either side.
    """
    half = int(np.ceil(reach_mm(lens) / pitch_mm)) + 1
    return (np.arange(2 * half) - half + 0.5) * pitch_mm


def _shapes(lens: PupilOptics, flares: Sequence[Flare]) -> tuple:
    """Return the stop cut by rims and every iris, and all dirt: (opening, ((shape, loss of
    amplitude, delay um or nothing), ...)).
    """
    shapes_of_flares = [
        f.pupil_shapes(radius_mm(lens)) for f in flares if isinstance(f, DrawsPupil)
    ]
    opening = shapes.disc(0.0, 0.0, radius_mm(lens))
    for rim in lens.rims:
        opening = opening & shapes.disc(*(radius_mm(lens) * v for v in rim))
    for iris, _ in shapes_of_flares:
        opening = opening & iris
    return opening, tuple(loss for _, dirt in shapes_of_flares for loss in dirt)


def terms(lens: PupilOptics, flares: Sequence[Flare], wavelength_nm: float | None = None) -> list:
    """Return the stop and all flares with shapes as one sum of (shape, weight); weights are complex
    where dirt delays light.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : nm, of dirt that delays light; None: without delays.
    """
    opening, dirt = _shapes(lens, flares)
    try:
        return _terms(opening, dirt, wavelength_nm if _delays(dirt) else None, lens.pupil_matrix)
    except ValueError as err:
        square_mm2 = (2 * radius_mm(lens)) ** 2
        allowed = min(DRAWN_EASILY * shape_sum.MOST_TERMS, len(dirt) / 2) / square_mm2
        raise ConfigError(
            f"{err}; this pupil is {2 * radius_mm(lens):.3g} mm wide: expected at most about"
            f" {allowed:.2g} grains and scratches per mm2; type for example"
            f" flare.NAME.dust_per_mm2={0.8 * allowed:.2g}"
            f" flare.NAME.scratches_per_mm2={0.2 * allowed:.2g}, or a larger lens.f_number"
        ) from None


_overlaps = lru_cache(maxsize=16)(shapes.overlaps)
_energy = lru_cache(maxsize=16)(shapes.energy)


@lru_cache(maxsize=16)
def _terms(
    opening: Convex,
    dirt: Sequence[Any],
    wavelength_nm: float | None,
    pupil_matrix: tuple[tuple[float, float], tuple[float, float]] | None,
) -> list[tuple[Convex, complex]]:
    parts = _overlaps(opening, tuple(d[0] for d in dirt))
    if pupil_matrix is not None:
        parts = [(part.mapped(pupil_matrix), shapes_inside) for part, shapes_inside in parts]
    return shapes.weighted(parts, [_loss(*d[1:], wavelength_nm=wavelength_nm) for d in dirt])


def _loss(loss: float, delay_um: float = 0.0, *, wavelength_nm: float | None) -> complex:
    """Return 1 - transmission of one shape of dirt; complex where it delays light."""
    return (
        1 - (1 - loss) * cmath.exp(2j * cmath.pi * 1e3 * delay_um / wavelength_nm)
        if delay_um
        else loss
    )


def delays_um(lens: PupilOptics, flares: Sequence[Flare]) -> set[float]:
    """Return the optical path differences, um, that shapes of dirt add; none where all dirt takes
    amplitude alone.
    """
    return _delays(_shapes(lens, flares)[1])


def _delays(dirt: tuple[Any, ...]) -> set[Any] | set[float]:
    return {d[2] for d in dirt if len(d) > 2 and d[2]}


def amplitude(
    lens: PupilOptics,
    flares: Sequence[Flare],
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
    points: int = 3,
) -> np.ndarray:
    """Return the mean amplitude transmission (y, x) of each cell, real or complex, without the
    wavefront.

    Parameters
    ----------
    lens, flares : the lens and its flare components.
    x_mm, y_mm : evenly spaced centres of the cells.
    wavelength_nm : of the light.
    points : samples per cell and axis of a third-party pupil.
    """
    low = y_mm[0] - (y_mm[1] - y_mm[0])
    high = y_mm[-1] + (y_mm[1] - y_mm[0])
    terms_near = [
        t for t in terms(lens, flares, wavelength_nm) if t[0].low < high and t[0].high > low
    ]
    out = shapes.raster(terms_near, x_mm, y_mm)
    for flare in flares:
        if isinstance(flare, TransmitsPupil) and not isinstance(flare, DrawsPupil):
            out = out * _sampled(flare, lens.pupil_matrix, x_mm, y_mm, wavelength_nm, points)
    return out


def _sampled(
    flare: TransmitsPupil,
    pupil_matrix: tuple[tuple[float, float], tuple[float, float]] | None,
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
    points: int,
) -> np.ndarray:
    """Return the means over cells of a third-party pupil, which is asked at places of the stop."""
    (xx, xy), (yx, yy) = np.linalg.inv(pupil_matrix) if pupil_matrix is not None else np.eye(2)
    step_x = x_mm[1] - x_mm[0]
    step_y = y_mm[1] - y_mm[0]
    inner = (np.arange(points) + 0.5) / points - 0.5
    mean = 0.0
    energy = 0.0
    for dy in inner * step_y:
        for dx in inner * step_x:
            x = x_mm[None, :] + dx
            y = y_mm[:, None] + dy
            stop = (xx * x + xy * y, yx * x + yy * y) if pupil_matrix is not None else (x, y)
            point = np.asarray(flare.pupil(*stop, wavelength_nm))
            mean = mean + point
            energy = energy + float(np.mean(np.abs(point) ** 2))
    mean = mean / points**2
    if not np.isfinite(mean).all() or np.abs(mean).max() > 1 + 1e-9:
        raise ConfigError(
            f"flare {type(flare).__name__} has a pupil transmission that is not finite or above 1; "
            "expected amplitudes of at most 1 from pupil(x_mm, y_mm, wavelength_nm)"
        )
    if float(np.mean(np.abs(mean) ** 2)) < UNRESOLVED * energy / points**2:
        raise ConfigError(
            f"flare {type(flare).__name__} has a pupil that changes by more than about a quarter"
            f" wave per cell of {1e3 * max(step_x, step_y):.3g} um; expected a smoother phase, or a"
            " pupil written as shapes"
        )
    return np.broadcast_to(mean, (len(y_mm), len(x_mm)))


def has_phase(lens: PupilOptics, flares: Sequence[Flare]) -> bool:
    """Return whether the pupil may be complex: without phase a point spread function equals its
    mirror image.
    """
    return bool(
        lens.zernike_um or lens.focal_shift_um or lens.traced or delays_um(lens, flares)
    ) or not all_shapes(flares)


def round_and_clean(lens: PupilOptics, flares: Sequence[Flare]) -> bool:
    """Return whether the pupil is the round stop alone, without phase, rims, blades or dirt: its
    point spread has a closed form.
    """
    changed = lens.rims or lens.uneven or lens.pupil_matrix
    return not (
        has_phase(lens, flares) or changed or any(isinstance(f, DrawsPupil) for f in flares)
    )


def phase_change(
    lens: PupilOptics, flares: Sequence[Flare], first_nm: float, last_nm: float
) -> float:
    """Return by how much the phase of lens and dirt differs between two wavelengths, radians rms
    over the pupil (piston apart).

    Dirt counts with all of its phase, wherever it lies: far from the axis its light is alone.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    first_nm : wavelength, nm.
    last_nm : the other wavelength, nm.
    """
    first, last = (coefficients_um(lens, w) for w in (first_nm, last_nm))
    waves = [
        1e3 * (first.get(j, 0.0) / first_nm - last.get(j, 0.0) / last_nm)
        for j in {*first, *last} - {0}
    ]
    waves += [1e3 * d * (1 / first_nm - 1 / last_nm) for d in delays_um(lens, flares)]
    return 2 * np.pi * float(np.sqrt(np.sum(np.square(waves))))


def _turns_per_cell(lens: PupilOptics, step_mm: float, wavelength_nm: float) -> float:
    return steepest_um(lens, wavelength_nm) * step_mm / radius_mm(lens) / (wavelength_nm * 1e-3)


def with_wavefront(
    lens: PupilOptics,
    cells: np.ndarray,
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
) -> np.ndarray:
    """Return the cells times exp(2 pi i OPD / wavelength) of the lens; refuse a phase the cells
    cannot follow.

    Parameters
    ----------
    lens : a lens of this package.
    cells : (y, x) amplitude.
    x_mm : centres of the cells along x, mm, evenly spaced, rising.
    y_mm : the same along y.
    wavelength_nm : wavelength, nm.
    """
    wavefront = coefficients_um(lens, wavelength_nm)
    if not (wavefront or lens.uneven):
        return cells
    jump = _turns_per_cell(lens, max(x_mm[1] - x_mm[0], y_mm[1] - y_mm[0]), wavelength_nm)
    if jump >= 0.5:
        raise ConfigError(
            f"the wavefront changes by {jump:.2f} wavelengths per pupil sample at {wavelength_nm:g}"
            " nm: its blur is wider than the image; expected smaller lens.zernike_um, or a wider"
            " field"
        )
    out = np.empty(cells.shape, np.complex64)
    # in blocks that stay in the processor's cache: four times faster
    for start in range(0, len(y_mm), 64):
        rows = slice(start, start + 64)
        out[rows] = _turned(lens, wavefront, cells[rows], x_mm, y_mm[rows], wavelength_nm)
    return out


def _turned(
    lens: PupilOptics,
    wavefront: dict[int, float],
    cells: np.ndarray,
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
) -> np.ndarray:
    """Return rows of cells times the phase at their centres and what the mean over a cell leaves of
    it.

    OSA's y points up, the rows of an image down.
    """
    radius = radius_mm(lens)
    step = x_mm[1] - x_mm[0]
    tall = y_mm[1] - y_mm[0] if len(y_mm) > 1 else step
    # a cell more on every side: slopes do not depend on the blocks
    x = np.concatenate([[x_mm[0] - step], x_mm, [x_mm[-1] + step]])
    y = np.concatenate([[y_mm[0] - tall], y_mm, [y_mm[-1] + tall]])
    turns = _opd_um(lens, wavefront, x / radius, -y / radius) / (wavelength_nm * 1e-3)
    steep = _turns_per_cell(lens, max(step, tall), wavelength_nm) > 1 / 128
    # below that the mean leaves all but 1e-4
    mean = phase_mean(turns)[1:-1, 1:-1] if steep else np.float32(1.0)
    turns = turns[1:-1, 1:-1]
    turns -= np.rint(turns)  # whole turns dropped in float64: float32 then keeps 1e-7 of a turn
    angle = (2 * np.pi * turns).astype(np.float32)
    out = np.empty(cells.shape, np.complex64)
    np.cos(angle, out=out.real)
    np.sin(angle, out=out.imag)
    out *= cells * mean
    if lens.uneven:
        out *= _uneven_amplitude(lens, x_mm, y_mm)
    return out


def _opd_um(
    lens: PupilOptics, wavefront: dict[int, float], x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return the optical path difference (y, x) in the open part of every cell, micrometres; `x`
    and `y` in pupil radii, y up.

    Polynomials grow without limit beyond the rim, the more the higher their order. Cells that the
    rim crosses take the value at the middle of what lies inside, cells beyond it the value at the
    rim. Along the radius a cell reaches `half` either way.
    """
    out = wavefront_um(over_pupil(lens, wavefront), x, y)
    step_x = abs(x[1] - x[0])
    step_y = abs(y[1] - y[0])
    to_stop = stop_from_pupil(lens)
    stop_x = to_stop[0, 0] * x + to_stop[0, 1] * y[:, None]
    stop_y = to_stop[1, 0] * x + to_stop[1, 1] * y[:, None]
    widest = np.hypot(step_x, step_y) / 2 * np.linalg.norm(to_stop, 2)
    beside = stop_x**2 + stop_y**2 > max(1 - widest, 0.0) ** 2
    at = np.stack([stop_x[beside], stop_y[beside]])
    rho = np.hypot(*at)
    half = (np.abs(to_stop.T @ at) * np.array([[step_x], [step_y]])).sum(axis=0) / (2 * rho)
    middle = np.where(rho + half <= 1, rho, np.where(rho - half >= 1, 1.0, (1 + rho - half) / 2))
    out[beside] = wavefront_at(wavefront, *(at * middle / rho))
    return out


def _uneven_amplitude(lens: PupilOptics, x_mm: np.ndarray, y_mm: np.ndarray) -> np.ndarray:
    """Return the amplitude (y, x) of light that does not fill the stop evenly, over cells of the
    pupil.
    """
    terms = tuple(over_pupil(lens, dict(lens.uneven)).items())
    return apodization.amplitude(terms, x_mm / radius_mm(lens), y_mm / radius_mm(lens))


def resolved(
    lens: PupilOptics,
    flares: Sequence[Flare],
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
    cells: np.ndarray | None = None,
) -> np.ndarray:
    """Return the means over cells of amplitude times phase, from cells as fine as the wavefront
    asks.

    At the rim the product of two means is not the mean of the product: a quarter wave per cell
    makes the light on the axis of a strongly defocused point wrong by a fifth. The error falls with
    the square of the step: 0.3 % at `FINE_TURNS` per cell.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    x_mm : centres of the cells along x, mm, evenly spaced, rising.
    y_mm : the same along y.
    wavelength_nm : wavelength, nm.
    cells : the amplitude's means, where they are known.
    """
    step = max(x_mm[1] - x_mm[0], y_mm[1] - y_mm[0])
    if _turns_per_cell(lens, step, wavelength_nm) <= FINE_TURNS:
        cells = amplitude(lens, flares, x_mm, y_mm, wavelength_nm) if cells is None else cells
        return with_wavefront(lens, cells, x_mm, y_mm, wavelength_nm)
    return _finely(lens, flares, x_mm, y_mm, wavelength_nm)


def _finely(
    lens: PupilOptics,
    flares: Sequence[Flare],
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
) -> np.ndarray:
    """Return the means over cells of products on finer cells, as fine as the wavefront asks in each
    block.
    """
    out = np.zeros((len(y_mm), len(x_mm)), np.complex64)
    for first in range(0, len(y_mm), BLOCK):
        rows = slice(first, first + BLOCK)
        for columns, parts in _runs(lens, x_mm, y_mm[rows], wavelength_nm):
            part = [x_mm[columns], y_mm[rows]]
            fine_x, fine_y = (
                ((np.arange(parts) + 0.5) / parts - 0.5) * (a[1] - a[0]) + b[:, None]
                for a, b in zip((x_mm, y_mm), part)
            )
            product = _product(lens, flares, fine_x.ravel(), fine_y.ravel(), wavelength_nm)
            out[rows, columns] = product.reshape(len(fine_y), parts, len(fine_x), parts).mean(
                (1, 3)
            )
    return out


def _runs(lens: PupilOptics, x_mm: np.ndarray, y_mm: np.ndarray, wavelength_nm: float) -> Any:
    """Return [(columns, parts), ...] of a strip of rows: blocks side by side that are divided
    alike, those beyond the rim left out.
    """
    radius = radius_mm(lens)
    step = x_mm[1] - x_mm[0]
    tall = y_mm[1] - y_mm[0] if len(y_mm) > 1 else step
    rho, slope_um = slopes(lens, wavelength_nm)
    turns = slope_um * max(step, tall) / radius / (wavelength_nm * 1e-3)
    matrix = np.eye(2) if lens.pupil_matrix is None else np.array(lens.pupil_matrix)
    # from a distance to one in the stop
    bounds = (
        1 / np.linalg.norm(matrix, 2),
        np.linalg.norm(np.linalg.inv(matrix), 2),
    )
    # never a last block of one column: its width would not be known
    starts = np.arange(0, max(len(x_mm) - 1, 1), BLOCK)
    ends = np.append(starts[1:], len(x_mm))
    along_y = _distances(y_mm[0] - tall / 2, y_mm[-1] + tall / 2)
    runs = []
    for start, end in zip(starts, ends):
        along_x = _distances(x_mm[start] - step / 2, x_mm[end - 1] + step / 2)
        near, far = (
            np.hypot(*pair) / radius * more for pair, more in zip(zip(along_x, along_y), bounds)
        )
        if near >= 1:
            continue
        within = slice(max(np.searchsorted(rho, near) - 1, 0), np.searchsorted(rho, far) + 1)
        parts = next((p for p in PARTS if turns[within].max() <= p * FINE_TURNS), PARTS[-1])
        if runs and runs[-1][1] == parts and runs[-1][0].stop == start:
            start = runs.pop()[0].start
        runs.append((slice(int(start), int(end)), parts))
    return runs


def _distances(low: float, high: float) -> tuple[float, float]:
    """Return the least and the largest distance from 0 of an interval."""
    return (0.0 if low <= 0 <= high else min(abs(low), abs(high))), max(abs(low), abs(high))


def _product(
    lens: PupilOptics,
    flares: Sequence[Flare],
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
) -> np.ndarray:
    """Return amplitude times phase on a block of fine cells."""
    cells = amplitude(lens, flares, x_mm, y_mm, wavelength_nm, points=1)
    wavefront = coefficients_um(lens, wavelength_nm)
    return (
        _turned(lens, wavefront, cells, x_mm, y_mm, wavelength_nm)
        if wavefront or lens.uneven
        else cells
    )


def folded(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: float,
    cells_mm: tuple[float, float],
    period: tuple[int, int],
    offsets: tuple[tuple[float, float], tuple[float, float]],
) -> list[np.ndarray]:
    """Return the pupil with its wavefront in smooth cells, summed modulo `period`, for several
    offsets; see `lattice.fold_cells`.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : wavelength, nm.
    cells_mm : (y, x) of a cell, mm.
    period : (y, x) period of the result, cells.
    offsets : several (y, x) offsets, each the point between image samples, -1 to 1.
    """
    half_y, half_x = (c / 2 for c in cells_mm)
    fine = _turns_per_cell(lens, max(half_y, half_x), wavelength_nm) > FINE_TURNS
    count_y, count_x = (2 * (int(np.ceil(reach_mm(lens) / c)) + 1) for c in cells_mm)
    x, y = ((np.arange(2 * n) + 0.5 - n) * h for n, h in ((count_x, half_x), (count_y, half_y)))

    def blocks() -> Iterator[tuple[int, int, np.ndarray]]:
        for start in range(0, len(y), 64):
            rows = y[start : start + 64]
            nearest = 0.0 if rows[0] * rows[-1] <= 0 else min(abs(rows[0]), abs(rows[-1])) - half_y
            reach = np.sqrt(max(reach_mm(lens) ** 2 - nearest**2, 0.0)) + half_x
            inside = slice(*np.searchsorted(x, (-reach, reach)))
            if inside.stop > inside.start + 1:
                arguments = lens, flares, x[inside], rows, wavelength_nm
                yield (
                    start,
                    inside.start,
                    _finely(*arguments) if fine and len(rows) > 1 else _product(*arguments),
                )

    return lattices.fold_cells(blocks(), (len(y), len(x)), period, offsets)


def phase_mean(turns: np.ndarray) -> np.ndarray | float:
    """Return what the mean over a cell leaves of a phase of `turns` wavelengths (y, x) at its
    centre, float32: sinc of the slopes.

    Diffraction divides by the cell's sinc at every place of the image, since cells are means. A
    wavefront's slope sends light to just that place, so a phase that was only sampled would come
    out brighter, by a tenth at a quarter wave per cell.
    """
    out = np.float32(1.0)
    for axis in (0, 1):
        if turns.shape[axis] > 2:
            t = np.square(
                np.pi * np.gradient(turns, axis=axis), dtype=np.float32, casting="same_kind"
            )
            # sinc to 1e-5 at the half wave allowed at most
            out = out * (1 - t / 6 * (1 - t / 20 * (1 - t / 42 * (1 - t / 72))))
    return np.broadcast_to(out, turns.shape)


def phase_samples(lens: PupilOptics, wavelength_nm: float) -> float:
    """Return the samples across the stop at which the wavefront changes by a quarter wave from one
    to the next at most.
    """
    return 8 * steepest_um(lens, wavelength_nm) / (wavelength_nm * 1e-3)


def core_pitch_mm(
    lens: PupilOptics, extent_um: float, wavelength_nm: float, least: int = CORE_SAMPLES
) -> float:
    """Return a pupil pitch that resolves the stop, an image `extent_um` wide, and the wavefront (a
    quarter wave per sample).

    With less than `CORE_SAMPLES` as the `least` samples across the stop, a narrow image has no more
    than it needs to be as exact at its border as a wide one: 2e-3 of what is there (measured
    against 2304; 5e-3 in the widest).

    Parameters
    ----------
    lens : a lens of this package.
    extent_um : width of the image, um.
    wavelength_nm : wavelength, nm.
    least : samples across the stop, at least.
    """
    diameter = 2 * radius_mm(lens)
    across = extent_um / blur_um(lens, wavelength_nm)
    samples = max(least, min(CORE_SAMPLES, BORDER * across), 2.0 * across)
    samples = max(samples, phase_samples(lens, wavelength_nm))
    if samples > MOST_SAMPLES:
        raise ConfigError(
            f"the pupil would need {samples:.0f} samples across at {wavelength_nm:g} nm; expected"
            f" at most {MOST_SAMPLES}: ask for a smaller image, or smaller lens.zernike_um"
        )
    return diameter / samples


def open_energy_mm2(lens: PupilOptics, flares: Sequence[Flare], wavelength_nm: float) -> float:
    """Return the integral of |a|^2 over the pupil, mm2: from areas where all is shapes.

    Else from a grid of means over cells, `diffraction.energy_of`.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : wavelength, nm.
    """
    if all_shapes(flares):
        terms(lens, flares, wavelength_nm)  # refuses more dirt than can be drawn
        opening, dirt = _shapes(lens, flares)
        dirt = tuple(d[:2] for d in dirt)  # a delay takes no light away
        energy = _energy(opening, dirt) * (
            apodization.share(lens.uneven, opening, dirt, radius_mm(lens)) if lens.uneven else 1.0
        )
        energy *= stop_mm2(lens) / (np.pi * radius_mm(lens) ** 2)
    else:
        pitch = 2 * radius_mm(lens) / ENERGY_SAMPLES
        axis = axis_mm(lens, pitch)
        cells = amplitude(lens, flares, axis, axis, wavelength_nm)
        cells = cells * _uneven_amplitude(lens, axis, axis) if lens.uneven else cells
        energy = energy_of(cells, pitch, cell_means=True)
    if not energy > DARK * stop_mm2(lens):
        raise ConfigError(
            "the flares let no light through the pupil; expected a transmission above 0 somewhere;"
            " type less dirt, as flare.NAME.dust_per_mm2=40"
        )
    return energy


def all_shapes(flares: Sequence[Flare]) -> bool:
    """Return whether every pupil flare states exact shapes."""
    return all(isinstance(f, DrawsPupil) or not isinstance(f, TransmitsPupil) for f in flares)
