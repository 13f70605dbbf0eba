"""Fourier transforms along one axis, by the fastest installed library.

NumPy arrays are transformed by ducc0 if it is installed (extra `fast`), otherwise by SciPy. ducc0
takes about half the time, because SciPy's builds use only the vector instructions that every
processor has. Both have errors of about 1e-16 of the largest value. Arrays of another library with
the Python array API are transformed by that library.
"""

from __future__ import annotations

import numpy as np
import scipy.fft as sf

from ..arrays import namespace

try:
    import ducc0.fft as duccs
except ImportError:
    duccs = None


def rfft(rows: np.ndarray, out: np.ndarray) -> None:
    """Write the transforms of the real float64 `rows` (row, n) into `out`, (row, n // 2 + 1)
    complex.
    """
    xp = namespace(rows)
    if xp is np and duccs:
        duccs.r2c(rows, axes=(1,), out=out)
    else:
        out[...] = sf.rfft(rows, axis=1) if xp is np else xp.fft.rfft(rows, axis=1)


def irfft(lines: np.ndarray, out: np.ndarray) -> None:
    """Write the real rows (row, n) with the transforms `lines`, (row, n // 2 + 1), into `out`."""
    xp = namespace(lines)
    n = out.shape[1]
    if xp is np and duccs:
        duccs.c2r(lines, axes=(1,), lastsize=n, forward=False, inorm=2, out=out)
    else:
        out[...] = sf.irfft(lines, n, axis=1) if xp is np else xp.fft.irfft(lines, n=n, axis=1)


def fft(columns: np.ndarray) -> np.ndarray:
    """Return the transforms of the complex `columns` (n, column), which may be overwritten."""
    xp = namespace(columns)
    if xp is np and duccs:
        return duccs.c2c(columns, axes=(0,), out=columns)
    return sf.fft(columns, axis=0, overwrite_x=True) if xp is np else xp.fft.fft(columns, axis=0)


def hermitian(columns: np.ndarray, n: int) -> np.ndarray:
    """Return the real transforms (n, column) of Hermitian columns.

    Parameters
    ----------
    columns : (n // 2 + 1, column), a NumPy array: the first values of each column. The others are
        the conjugates of these in reverse order.
    n : length of a full column.
    """
    if duccs:
        return duccs.c2r(columns, axes=(0,), lastsize=n, forward=True)
    return sf.hfft(columns, n, axis=0)


def fft_rows(rows: np.ndarray) -> np.ndarray:
    """Return the transforms of the complex `rows` (row, n), a NumPy array, which may be
    overwritten.
    """
    if duccs:
        return duccs.c2c(rows, axes=(1,), out=rows)
    return sf.fft(rows, axis=1, overwrite_x=True)


def ifft(columns: np.ndarray) -> np.ndarray:
    """Return the inverse transforms of the complex `columns` (n, column), which may be
    overwritten.
    """
    xp = namespace(columns)
    if xp is np and duccs:
        return duccs.c2c(columns, axes=(0,), forward=False, inorm=2, out=columns)
    return sf.ifft(columns, axis=0, overwrite_x=True) if xp is np else xp.fft.ifft(columns, axis=0)
