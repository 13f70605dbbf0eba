"""Transforms of padded images, in blocks of rows and columns that stay in the processor's cache.

The padded image and its whole spectrum are never in memory; only the transforms along x of the
image's rows are. The spectrum of a point spread function is stored as blocks of columns, (block,
sy, COLUMNS), in the order of reading, so that a memory-mapped file can be used. Functions accept
arrays of any library with the Python array API (`fourier`) unless they name NumPy.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from scipy.fft import next_fast_len

from ..arrays import device, namespace
from . import fourier

# number of rows and of columns that are transformed at a time
ROWS = 16
COLUMNS = 32


def sizes(shape: Sequence[int], kernel: Sequence[int]) -> tuple[int, int]:
    """Return the (y, x) sizes of a transform for which only cropped pixels wrap around."""
    y, x = (
        next_fast_len(max(n + k - 1 - k // 2, k // 2 + n, k), real=True)
        for n, k in zip(shape, kernel)
    )
    return y, x


def spectrum(psf: np.ndarray, size: tuple[int, int], peak: float, mirrored: bool) -> np.ndarray:
    """Return the transform of psf / peak, centred on [0, 0], in blocks of columns; it is real if
    psf equals its mirror image.

    Parameters
    ----------
    psf : (ky, kx) array, its centre at (ky // 2, kx // 2), not larger than `size`.
    size : (sy, sx) of the transform, pixels.
    peak : largest value of `psf`, by which it is divided.
    mirrored : whether `psf` equals its mirror image about the centre; its spectrum is then real.
    """
    xp = namespace(psf)
    ky, kx = psf.shape
    sy, sx = size
    cy = ky // 2
    cx = kx // 2
    # if mirrored, the transforms of the rows above the centre are conjugates of those below
    first = cy if mirrored else 0
    half = xp.empty((ky, sx // 2 + 1), dtype=xp.complex128, device=device(psf))
    for start in range(first, ky, ROWS):
        rows = slice(start, min(start + ROWS, ky))
        padded = xp.zeros((rows.stop - rows.start, sx), dtype=xp.float64, device=device(psf))
        padded[:, : kx - cx] = xp.astype(psf[rows, cx:], xp.float64) / peak
        if cx:
            padded[:, sx - cx :] = xp.astype(psf[rows, :cx], xp.float64) / peak
        fourier.rfft(padded, half[rows, :])
    if mirrored:
        half[:first, :] = xp.conj(xp.flip(half[ky - first :, :], axis=0))
    count = _blocks(size)
    out = xp.zeros(
        (count, sy, COLUMNS), dtype=xp.float64 if mirrored else xp.complex128, device=device(psf)
    )
    for block in range(count):
        part = half[:, block * COLUMNS : min((block + 1) * COLUMNS, half.shape[1])]
        padded = xp.zeros((sy, part.shape[1]), dtype=xp.complex128, device=device(psf))
        padded[: ky - cy, :] = part[cy:, :]
        if cy:
            padded[sy - cy :, :] = part[:cy, :]
        padded = fourier.fft(padded)
        out[block, :, : part.shape[1]] = xp.real(padded) if mirrored else padded
    return out


def mirrored_spectrum(half: np.ndarray, size: tuple[int, int], peak: float) -> np.ndarray:
    """Return the result of `spectrum` for a kernel that equals its mirror image, from one half, a
    NumPy array.

    The transforms along x of rows at y and -y are complex conjugates. The transform along y of such
    Hermitian columns is real, and needs only one half of them.

    Parameters
    ----------
    half : (cy + 1, kx) rows y = 0 .. cy of the kernel, the row of its centre first.
    size : (sy, sx) of the transform, pixels.
    peak : largest value of the kernel, by which it is divided.
    """
    rows, kx = half.shape
    sy, sx = size
    middle = kx // 2
    count = _blocks(size)
    lines = np.zeros((rows, count * COLUMNS), complex)
    for start in range(0, rows, ROWS):
        cut = slice(start, min(start + ROWS, rows))
        padded = np.zeros((cut.stop - cut.start, sx))
        padded[:, : kx - middle] = half[cut, middle:]
        padded[:, sx - middle :] = half[cut, :middle]
        padded /= peak
        fourier.rfft(padded, lines[cut, : sx // 2 + 1])
    out = np.empty((count, sy, COLUMNS))
    for block, values in enumerate(out):
        padded = np.zeros((sy // 2 + 1, COLUMNS), complex)
        padded[:rows] = lines[:, block * COLUMNS : (block + 1) * COLUMNS]
        values[...] = fourier.hermitian(padded, sy)
    return out


def whole_spectrum(blocks: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Return the blocks of `spectrum` as one (sy, sx // 2 + 1) array."""
    return np.moveaxis(blocks, 0, 1).reshape(size[0], -1)[:, : size[1] // 2 + 1]


def rows_of(ny: int, size: tuple[int, int], like: np.ndarray, single: bool = False) -> np.ndarray:
    """Return an empty array for the transforms along x of one plane: (block of columns, y, column).

    Parameters
    ----------
    ny : rows of the image.
    size : (sy, sx) of the transform, pixels.
    like : an array of the library and the device to use.
    single : whether the whole computation is in single precision (complex64), not double.
    """
    xp = namespace(like)
    return xp.empty(
        (_blocks(size), ny, COLUMNS),
        dtype=xp.complex64 if single else xp.complex128,
        device=device(like),
    )


def forward(
    read: Callable[..., Any],
    halves: list[np.ndarray],
    size: tuple[int, int],
    nx: int,
    apply: Callable[..., Any] = map,
) -> float:
    """Fill `halves`, one array of `rows_of` per plane, with the transforms along x. Return the sum
    of squares of all values.

    Parameters
    ----------
    read : function(rows, out) that writes these rows of every plane into `out`, (plane, rows, nx).
    halves : one array per plane.
    size : (y, x) size of the transforms.
    nx : columns of the image.
    apply : `map`, or the `map` of a pool of threads.
    """
    xp = namespace(halves[0])
    count, ny, _ = halves[0].shape
    width = size[1] // 2 + 1
    local = threading.local()

    def block(start: int) -> float:
        cut = slice(start, min(start + ROWS, ny))
        high = cut.stop - cut.start
        padded = _thread_array(
            local, "rows", (len(halves), high, size[1]), _real(halves[0], xp), halves[0]
        )
        values = padded[:, :, :nx]
        read(cut, values)
        total = squares(values, xp)
        if total == 0 and not xp.any(values):  # rows without light need no transform
            for half in halves:
                half[:, cut, :] = 0.0
            return 0.0
        line = _thread_array(local, "line", (high, count * COLUMNS), halves[0].dtype, halves[0])
        for plane, half in enumerate(halves):
            fourier.rfft(padded[plane, ...], line[:, :width])
            half[:, cut, :] = xp.permute_dims(xp.reshape(line, (high, count, COLUMNS)), (1, 0, 2))
        return total

    return float(sum(apply(block, range(0, ny, ROWS))))


def columns(
    halves: list[np.ndarray],
    multiply: Callable[..., Any],
    size: tuple[int, int],
    apply: Callable[..., Any] = map,
) -> None:
    """Transform planes along y, combine them, and transform back.

    Parameters
    ----------
    halves : planes transformed along x. The first of them are overwritten with the results.
    multiply : function(block, planes) -> transforms of the outputs, at most as many as `planes`.
        `block` is the number of a block of columns; `planes` are its transforms, a list of arrays
        (sy, columns) that the function may overwrite.
    size : (sy, sx) of the padded image.
    apply : `map`, or the `map` of a pool of threads.
    """
    count, ny, _ = halves[0].shape
    local = threading.local()

    def block(number: int) -> None:
        parts = []
        for plane, half in enumerate(halves):
            padded = _thread_array(local, plane, (size[0], COLUMNS), half.dtype, half)
            padded[:ny, :] = half[number, ...]
            padded[ny:, :] = 0.0
            parts.append(fourier.fft(padded))
        for half, part in zip(halves, multiply(number, parts)):
            half[number, ...] = fourier.ifft(part)[:ny, :]

    list(apply(block, range(count)))


def back(
    half: np.ndarray,
    write: Callable[..., Any],
    size: tuple[int, int],
    nx: int,
    apply: Callable[..., Any] = map,
) -> list:
    """Transform the rows of one plane back, and return the results of `write`, block by block.

    Parameters
    ----------
    half : (block of columns, y, column) transforms along x, an array of `rows_of`.
    write : function(rows, values) that takes each block of rows: a slice, and values (rows, nx).
    size : (sy, sx) size of the transform, pixels.
    nx : columns of the image.
    apply : `map`, or the `map` of a pool of threads.
    """
    xp = namespace(half)
    count, ny, _ = half.shape
    local = threading.local()

    def block(start: int) -> float | tuple[float, float] | None:
        cut = slice(start, min(start + ROWS, ny))
        high = cut.stop - cut.start
        line = xp.reshape(xp.permute_dims(half[:, cut, :], (1, 0, 2)), (high, count * COLUMNS))
        values = _thread_array(local, "rows", (high, size[1]), _real(half, xp), half)
        fourier.irfft(line[:, : size[1] // 2 + 1], values)
        return write(cut, values[:, :nx])

    return list(apply(block, range(0, ny, ROWS)))


def _real(a: np.ndarray, xp: ModuleType) -> Any:
    """Return the real type with the precision of a complex array."""
    return xp.float32 if a.dtype == xp.complex64 else xp.float64


def _blocks(size: tuple[int, int]) -> int:
    return -(-(size[1] // 2 + 1) // COLUMNS)


def error(product: float, norm: float, size: tuple[int, int], single: bool = False) -> float:
    """Return ten standard deviations of the rounding errors of a transform, taken as white noise.

    This bounds the error of any pixel if light lies in many rows. The rounding errors of a few
    small lamps are not white: they are largest in the rows of the lamps and next to them. There, 1
    to 3 lamps of one pixel in 1080 x 1920 dark pixels cause errors of up to 14 times this value,
    and 30 lamps up to 5 times (measured, in double and in single precision).

    Parameters
    ----------
    product : product of the norms (roots of sums of squares) of image and kernel.
    norm : norm of the result.
    size : (y, x) of the transforms.
    single : whether the transforms are in single precision.
    """
    count = float(np.prod(size))
    return (
        10
        * (6e-8 if single else 1.2e-16)
        * (product + norm)
        / np.sqrt(count)
        * np.log2(count) ** 0.5
    )


def times(spectrum: np.ndarray) -> Callable[..., Any]:
    """Return the argument `multiply` of `columns` that filters one plane with a spectrum."""

    def multiply(block: int, parts: list[np.ndarray]) -> list[np.ndarray]:
        parts[0] *= spectrum[block, ...]
        return parts

    return multiply


def convolved(
    image: np.ndarray, spectrum: np.ndarray, size: tuple[int, int]
) -> tuple[np.ndarray, float]:
    """Return the convolution of a NumPy image (y, x) with a kernel's spectrum, and the root of the
    sum of the image's squares.

    Parameters
    ----------
    image : (y, x) NumPy array, any unit.
    spectrum : transform of the kernel in blocks of columns, as `spectrum` returns.
    size : (sy, sx) of the transform, pixels.
    """

    def read(rows: slice, values: np.ndarray) -> None:
        values[0] = image[rows]

    def write(rows: slice, values: np.ndarray) -> None:
        out[rows] = values

    half = rows_of(len(image), size, image)
    out = np.empty(image.shape)
    norm = forward(read, [half], size, image.shape[1]) ** 0.5
    columns([half], times(spectrum), size)
    back(half, write, size, image.shape[1])
    return out, norm


def _thread_array(
    local: threading.local,
    name: int | str,
    shape: Sequence[int],
    dtype: np.dtype | type,
    like: np.ndarray,
) -> np.ndarray:
    """Return this thread's scratch array of one name and shape. A new array for each call would
    cost as much as the transforms.
    """
    arrays = local.__dict__.setdefault("arrays", {})
    if (name, shape) not in arrays:
        arrays[name, shape] = namespace(like).zeros(shape, dtype=dtype, device=device(like))
    return arrays[name, shape]


def squares(a: np.ndarray, xp: ModuleType) -> float:
    """Return the sum of squares of an array of the library `xp`."""
    if xp is np:
        axes = "abc"[: a.ndim]
        # BLAS is not used, because its threads would compete with the transforms
        return float(np.einsum(f"{axes},{axes}->", a, a))
    return float(xp.sum(a * a))
