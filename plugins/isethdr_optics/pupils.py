"""Pupils: stop, wavefront and flares of a lens put together on any grid of cells."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics import pupil as shapes
from isethdr_core.physics.zernike import steepest_slope_um, wavefront_um

CORE_SAMPLES = 768  # across the stop: kernel values to 1e-4 (L1), measured against 3072
MOST_SAMPLES = 8192
UNRESOLVED = 0.8  # of a pupil's energy is left in means over cells when its phase turns a quarter wave from cell to cell


def radius_mm(lens) -> float:
    """Return the radius of the round stop, mm."""
    return lens.focal_length_mm / lens.f_number / 2


def distance_mm(lens) -> float:
    """Return the distance from the pupil to the image, mm: focal length x (1 + magnification)."""
    return lens.focal_length_mm * (1 + lens.magnification)


def blur_um(lens, wavelength_nm: float) -> float:
    """Return wavelength x working f-number, um: the reciprocal of the highest spatial frequency."""
    return wavelength_nm * 1e-3 * distance_mm(lens) / (2 * radius_mm(lens))


def axis_mm(lens, pitch_mm: float) -> np.ndarray:
    """Return cell centres, symmetric about the axis, that cover the stop with a cell to spare on either side."""
    half = int(np.ceil(radius_mm(lens) / pitch_mm)) + 1
    return (np.arange(2 * half) - half + 0.5) * pitch_mm


def _shapes(lens, flares) -> tuple:
    """Return the stop cut by every iris, and all dirt: (opening, losses)."""
    given = [f.pupil_shapes(radius_mm(lens)) for f in flares if hasattr(f, "pupil_shapes")]
    opening = shapes.disc(0.0, 0.0, radius_mm(lens))
    for iris, _ in given:
        opening = opening & iris
    return opening, tuple(loss for _, dirt in given for loss in dirt)


def terms(lens, flares) -> list:
    """Return the stop and all flares with shapes as one sum of (shape, weight)."""
    return _terms(*_shapes(lens, flares))


_terms, _energy = lru_cache(maxsize=16)(shapes.opening), lru_cache(maxsize=16)(shapes.energy)


def amplitude(lens, flares, x_mm, y_mm, wavelength_nm: float) -> np.ndarray:
    """Return the mean amplitude transmission (y, x) of each cell, real or complex, without the wavefront."""
    out = shapes.raster(terms(lens, flares), x_mm, y_mm, chords_per_cell=2 if len(y_mm) > 2100 else 4)
    for flare in flares:
        if hasattr(flare, "pupil") and not hasattr(flare, "pupil_shapes"):
            out = out * _sampled(flare, x_mm, y_mm, wavelength_nm)
    return out


def _sampled(flare, x_mm, y_mm, wavelength_nm):
    points = 3 if len(y_mm) <= 2100 else 1  # far finer than the core's cells: their centres do
    step_x, step_y = x_mm[1] - x_mm[0], y_mm[1] - y_mm[0]
    inner = (np.arange(points) + 0.5) / points - 0.5
    mean, energy = 0.0, 0.0
    for dy in inner * step_y:
        for dx in inner * step_x:
            point = np.asarray(flare.pupil(x_mm[None, :] + dx, y_mm[:, None] + dy, wavelength_nm))
            mean, energy = mean + point, energy + float(np.mean(np.abs(point) ** 2))
    mean = mean / points**2
    if not np.isfinite(mean).all() or np.abs(mean).max() > 1 + 1e-9:
        raise ConfigError(
            f"flare {type(flare).__name__} has a pupil transmission that is not finite or above 1; "
            "expected amplitudes of at most 1 from pupil(x_mm, y_mm, wavelength_nm)"
        )
    if float(np.mean(np.abs(mean) ** 2)) < UNRESOLVED * energy / points**2:
        raise ConfigError(
            f"flare {type(flare).__name__} has a pupil that changes by more than about a quarter wave per cell of "
            f"{1e3 * max(step_x, step_y):.3g} um; expected a smoother phase, or a pupil written as shapes"
        )
    return np.broadcast_to(mean, (len(y_mm), len(x_mm)))


def has_phase(lens, flares) -> bool:
    """Return whether the pupil may be complex: without phase a point spread function equals its mirror image."""
    return bool(lens.zernike_um) or any(hasattr(f, "pupil") and not hasattr(f, "pupil_shapes") for f in flares)


def _check_phase(lens, x_mm, y_mm, wavelength_nm):
    step = max(x_mm[1] - x_mm[0], y_mm[1] - y_mm[0]) / radius_mm(lens)
    jump = steepest_slope_um(lens.zernike_um) * step / (wavelength_nm * 1e-3)
    if jump >= 0.5:
        raise ConfigError(
            f"the wavefront changes by {jump:.2f} wavelengths per pupil sample at {wavelength_nm:g} nm: its blur is wider than "
            "the image; expected smaller lens.zernike_um, or a wider field"
        )


def with_wavefront(lens, cells, x_mm, y_mm, wavelength_nm: float) -> np.ndarray:
    """Return the cells times exp(2 pi i OPD / wavelength) of the lens; refuse a phase the cells cannot follow.

    OSA's y points up, the rows of an image down.
    """
    if not lens.zernike_um:
        return cells
    radius = radius_mm(lens)
    _check_phase(lens, x_mm, y_mm, wavelength_nm)
    out = np.empty(cells.shape, np.complex64)
    for start in range(0, len(y_mm), 64):  # in blocks that stay in the processor's cache: four times faster
        rows = slice(start, start + 64)
        above = min(start, 1)  # a row more on either side: the slopes must not depend on the blocks
        around = wavefront_um(lens.zernike_um, x_mm / radius, -y_mm[start - above : start + 65] / radius) / (wavelength_nm * 1e-3)
        turns = around[above : above + 64]
        mean = phase_mean(around)[above : above + 64]
        turns = turns - np.rint(turns)  # whole turns dropped in float64: float32 then keeps 1e-7 of a turn
        angle = (2 * np.pi * turns).astype(np.float32)
        block = out[rows]
        if np.iscomplexobj(cells):
            np.cos(angle, out=block.real)
            np.sin(angle, out=block.imag)
            block *= cells[rows]
        else:
            np.multiply(np.cos(angle), cells[rows], out=block.real)
            np.multiply(np.sin(angle), cells[rows], out=block.imag)
        block *= mean
    return out


def phase_mean(turns) -> np.ndarray:
    """Return what the mean over a cell leaves of a phase of `turns` wavelengths (y, x) at its centre, float32: sinc of the slopes.

    Diffraction divides by the cell's sinc at every place of the image, since cells are means. A wavefront's slope sends light to
    just that place, so a phase that was only sampled would come out brighter, by a tenth at a quarter wave per cell.
    """
    slopes = (np.gradient(turns, axis=a) for a in (0, 1) if turns.shape[a] > 1)
    out = np.float32(1.0)
    for slope in slopes:
        t = np.square(np.pi * slope, dtype=np.float32, casting="same_kind")
        out = out * (1 - t / 6 * (1 - t / 20 * (1 - t / 42 * (1 - t / 72))))  # sinc to 1e-5 at the half wave allowed at most
    return out


def opd_um(lens, x_mm, y_mm, shortest_nm: float) -> np.ndarray:
    """Return the wavefront on a grid, float32, or 0 without one; refuse a phase that cells cannot follow at `shortest_nm`."""
    if not lens.zernike_um:
        return np.zeros((1, 1), np.float32)
    _check_phase(lens, x_mm, y_mm, shortest_nm)
    radius = radius_mm(lens)
    out = np.empty((len(y_mm), len(x_mm)), np.float32)
    for start in range(0, len(y_mm), 64):  # in blocks that stay in the processor's cache
        rows = slice(start, start + 64)
        out[rows] = wavefront_um(lens.zernike_um, x_mm / radius, -y_mm[rows] / radius)
    return out


def folded_with_wavefront(cells, opd_um, wavelength_nm: float, period, offset) -> np.ndarray:
    """Return cells times exp(2 pi i OPD / wavelength), summed modulo `period`, with the tilt that moves the image by `offset`.

    The full product is never held: blocks of rows, from the first to the last cell that passes light.
    """
    out = np.zeros(period, np.complex64)
    opd_um = np.broadcast_to(opd_um, cells.shape)
    tilt_y, tilt_x = (
        (-2 * np.pi * o / p * np.arange(n)).astype(np.float32) for o, p, n in zip(offset, period, cells.shape)
    )
    turn = np.float32(2e3 * np.pi / wavelength_nm)
    for wrap in range(0, len(cells), period[0]):
        for start in range(wrap, min(wrap + period[0], len(cells)), 32):
            rows = slice(start, min(start + 32, wrap + period[0], len(cells)))
            open_columns = np.flatnonzero(cells[rows].any(axis=0))
            if len(open_columns) == 0:
                continue
            first, last = int(open_columns[0]), int(open_columns[-1]) + 1
            block = cells[rows, first:last]
            angle = opd_um[rows, first:last] * turn
            angle += tilt_x[first:last]
            angle += tilt_y[rows, None]
            real, imag = np.cos(angle), np.sin(angle)
            if np.iscomplexobj(block):
                real, imag = real * block.real - imag * block.imag, real * block.imag + imag * block.real
            else:
                real *= block
                imag *= block
            into = out[rows.start - wrap : rows.stop - wrap]
            for left in range(first // period[1] * period[1], last, period[1]):
                a, b = max(left, first), min(left + period[1], last)
                into.real[:, a - left : b - left] += real[:, a - first : b - first]
                into.imag[:, a - left : b - left] += imag[:, a - first : b - first]
    return out


def phase_samples(lens, wavelength_nm: float) -> float:
    """Return the samples across the stop at which the wavefront changes by a quarter wave from one to the next at most."""
    return 8 * steepest_slope_um(lens.zernike_um) / (wavelength_nm * 1e-3) if lens.zernike_um else 0.0


def core_pitch_mm(lens, extent_um: float, wavelength_nm: float) -> float:
    """Return a pupil pitch that resolves the stop, an image `extent_um` wide, and the wavefront (a quarter wave per sample)."""
    diameter = 2 * radius_mm(lens)
    samples = max(CORE_SAMPLES, 2.0 * extent_um / blur_um(lens, wavelength_nm))
    samples = max(samples, phase_samples(lens, wavelength_nm))
    if samples > MOST_SAMPLES:
        raise ConfigError(
            f"the pupil would need {samples:.0f} samples across at {wavelength_nm:g} nm; expected at most {MOST_SAMPLES}: "
            "ask for a smaller image, or smaller lens.zernike_um"
        )
    return diameter / samples


def open_energy_mm2(lens, flares, wavelength_nm: float) -> float:
    """Return the integral of |a|^2 over the pupil, mm2: from areas where all is shapes.

    Else from two grids: grey border cells make a grid's sum too small by a term in 1 / samples, which two extrapolate away.
    """
    if same_at_all_wavelengths(flares):
        energy = _energy(*_shapes(lens, flares))
    else:
        fine, coarse = (_energy_on_grid(lens, flares, wavelength_nm, n) for n in (2048, 1024))
        energy = 2 * fine - coarse
    if not energy > 0:
        raise ConfigError("the flares let no light through the pupil; expected a transmission above 0 somewhere")
    return energy


def _energy_on_grid(lens, flares, wavelength_nm, samples):
    pitch = 2 * radius_mm(lens) / samples
    axis = axis_mm(lens, pitch)
    return float(np.sum(np.abs(amplitude(lens, flares, axis, axis, wavelength_nm)) ** 2, dtype=float)) * pitch**2


def same_at_all_wavelengths(flares) -> bool:
    """Return whether every pupil flare states exact shapes, which do not depend on wavelength."""
    return all(hasattr(f, "pupil_shapes") or not hasattr(f, "pupil") for f in flares)
