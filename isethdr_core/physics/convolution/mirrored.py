"""Mirrored kernels: arrays that equal their own mirror image, kept as the half y >= 0."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin


class Mirrored(NDArrayOperatorsMixin):
    """A (y, x) array with k[y, x] = k[-y, -x] about its middle. Values of the other half are
    computed on access.

    Parameters
    ----------
    half : (y = 0 .. ry, x = -rx .. rx) values; the row y = 0 is its own mirror image.
    """

    ndim = 2

    def __init__(self, half: np.ndarray) -> None:
        self.half = half

    @property
    def shape(self) -> tuple[int, int]:
        """Shape (y, x) of the whole array."""
        return 2 * len(self.half) - 1, self.half.shape[1]

    @property
    def size(self) -> int:
        """Number of values of the whole array."""
        return self.shape[0] * self.shape[1]

    @property
    def dtype(self) -> np.dtype:
        """Type of the values."""
        return self.half.dtype

    @property
    def nbytes(self) -> int:
        """Memory of the stored half, bytes."""
        return self.half.nbytes

    def __len__(self) -> int:
        return self.shape[0]

    def __array__(self, dtype: np.dtype | None = None, copy: bool | None = None) -> np.ndarray:
        whole = np.concatenate([self.half[:0:-1, ::-1], self.half])
        return whole if dtype is None else whole.astype(dtype, copy=False)

    def __array_ufunc__(
        self, ufunc: Callable[..., Any], method: str, *inputs: Any, **kwargs: Any
    ) -> np.ndarray:
        arrays = [np.asarray(a) if isinstance(a, Mirrored) else a for a in inputs]
        return getattr(ufunc, method)(*arrays, **kwargs)

    def __getitem__(self, key: Any) -> float | np.ndarray:
        """Return values of the whole array, always a copy."""
        if not isinstance(key, tuple) or len(key) != 2:
            return np.asarray(self)[key]
        slices = [isinstance(k, slice) for k in key]
        y, x = (np.arange(n)[k] for n, k in zip(self.shape, key))
        if slices[0]:
            y = y.reshape(-1, *(1,) * np.ndim(x))
        if slices[1] and not slices[0]:
            y = np.asarray(y)[..., None]
        away = y - (len(self.half) - 1)
        return self.half[np.abs(away), np.where(away < 0, self.shape[1] - 1 - x, x)]

    def sum(self, axis: int | None = None, dtype: type | None = None) -> float | np.ndarray:
        """Return the sum over an axis, or over both axes."""
        rest = self.half[1:]
        line = self.half[0]
        if axis is None:
            return 2 * rest.sum(dtype=dtype) + line.sum(dtype=dtype)
        if axis == 0:
            above = rest.sum(axis=0, dtype=dtype)
            return above + above[::-1] + line
        rows = self.half.sum(axis=1, dtype=dtype)
        return np.concatenate([rows[:0:-1], rows])

    def squares(self) -> float:
        """Return the sum of squares, in double precision."""
        rest = self.half[1:]
        line = self.half[0].astype(float)
        return 2 * float(sum(_squares(part.astype(float)) for part in rest)) + _squares(line)

    def within(self, reach_y: int, reach_x: int) -> Mirrored:
        """Return the part within `reach_y` rows and `reach_x` columns of the middle."""
        middle = self.shape[1] // 2
        across = slice(max(0, middle - reach_x), middle + reach_x + 1)
        return Mirrored(self.half[: reach_y + 1, across])

    def beyond(self, reach_y: int, reach_x: int) -> Mirrored:
        """Return a copy that is 0 within `reach_y` rows and `reach_x` columns of the middle."""
        middle = self.shape[1] // 2
        half = self.half.copy()
        half[: reach_y + 1, max(0, middle - reach_x) : middle + reach_x + 1] = 0.0
        return Mirrored(half)


def _squares(a: np.ndarray) -> float:
    return float(np.einsum("i,i->", a, a))
