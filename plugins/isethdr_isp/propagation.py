"""Noise propagation: the variance that a linear map of the mosaic leaves in the picture.

Every value of a picture is a weighted sum of samples of the mosaic. Colour matrix and demosaic are composed to
one kernel per place of the filter array, so the covariance between interpolated channels is part of the result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np

Alike = Literal["same", "any", "place"]


class NoisePart(NamedTuple):
    """One cause of noise: its variance in every sample, and which samples of a neighbourhood deviate alike.

    Samples deviate alike when their rows and their columns agree: "same" asks for the same row or column, "any" for
    none, "place" for the same place in the cell of the filter array. Their deviations are one normal number times
    the square root of the variance.
    """

    variance_e2: np.ndarray     # (y, x)
    rows: Alike = "same"
    columns: Alike = "same"

    def alone(self) -> bool:
        """Return whether every sample deviates by itself."""
        return self.rows == "same" and self.columns == "same"

    def group(self, row: int, column: int, cell: tuple[int, int]) -> tuple[int, int]:
        """Return a key that is equal for samples that deviate alike; row and column count from the cell's first."""
        return _agreeing(self.rows, row, cell[0]), _agreeing(self.columns, column, cell[1])


def _agreeing(rule: Alike, index: int, period: int) -> int:
    return {"same": index, "any": 0, "place": index % period}[rule]


@dataclass(frozen=True, eq=False)
class SampleNoise:
    """The noise of the samples of a mosaic: independent causes, whose variances add."""

    parts: tuple[NoisePart, ...] = ()

    def scaled(self, factor) -> SampleNoise:
        """Return the noise of the samples times `factor`, (y, x) or a number."""
        square = np.square(factor)
        return SampleNoise(tuple(part._replace(variance_e2=part.variance_e2 * square) for part in self.parts))

    def total_e2(self):
        """Return the variance (y, x) of the samples, e^2; 0.0 where there is no noise."""
        return sum((part.variance_e2 for part in self.parts), 0.0)


def independent(variance_e2) -> SampleNoise:
    """Return the noise of samples (y, x) that deviate each by itself."""
    return SampleNoise((NoisePart(np.asarray(variance_e2, float)),))


class NoiseMap(Protocol):
    """A demosaic as a linear map of the samples."""

    def variance(self, matrix, noise: SampleNoise) -> np.ndarray:
        """Return the variance (out, y, x) of `matrix` (out, channel) times the interpolated channels."""


class Kernel(NamedTuple):
    """The weights that make every channel of the pixels at `rows` x `columns`; both are regular index arrays."""

    rows: np.ndarray
    columns: np.ndarray
    offsets: list[tuple[int, int]]      # (dy, dx) of each sample from the pixel
    weights: np.ndarray                 # (channel, sample)

    def pixels(self) -> tuple[slice, slice]:
        """Return the slices of the pixels of this kernel."""
        return _slice(self.rows), _slice(self.columns)

    def samples(self, offset: tuple[int, int]) -> tuple[slice, slice]:
        """Return the slices of the samples at `offset` from these pixels."""
        return _slice(self.rows + offset[0]), _slice(self.columns + offset[1])


def _slice(index) -> slice:
    """Return a regular index array as a slice: a view instead of a copy."""
    step = int(index[1] - index[0]) if len(index) > 1 else 1
    return slice(int(index[0]), int(index[-1]) + 1, step)


@dataclass(frozen=True, eq=False)
class Kernels:
    """A linear demosaic: kernels that cover every pixel once."""

    kernels: list[Kernel]
    shape: tuple[int, int]      # rows and columns of the mosaic
    cell: tuple[int, int]       # rows and columns after which the filter array repeats

    def variance(self, matrix, noise: SampleNoise) -> np.ndarray:
        """Return the variance (out, y, x) of `matrix` (out, channel) times the channels that the kernels make.

        Notes
        -----
        With the composed weight k of a sample, the variance is the sum of k^2 Var over the samples. Of samples that
        deviate alike, the sum of k sd is squared. Nothing is approximated.
        """
        out = np.zeros((len(matrix), *self.shape))
        for part in noise.parts:
            add = _add_alone if part.alone() else self._add_alike
            values = part.variance_e2 if part.alone() else np.sqrt(part.variance_e2)
            for kernel in self.kernels:
                here = kernel.pixels()
                for total, weights in zip(out, np.asarray(matrix) @ kernel.weights):
                    add(total[here], kernel, weights, values, part)
        return out

    def _add_alike(self, total, kernel: Kernel, weights, deviation, part: NoisePart) -> None:
        """Add to `total`, a view, the variance of a weighted sum of samples of which some deviate alike."""
        sums: dict = {}
        for offset, weight in zip(kernel.offsets, weights):
            if weight:
                group = part.group(int(kernel.rows[0]) + offset[0], int(kernel.columns[0]) + offset[1], self.cell)
                sums[group] = sums.get(group, 0.0) + weight * deviation[kernel.samples(offset)]
        for together in sums.values():
            total += together**2


def _add_alone(total, kernel: Kernel, weights, variance, part: NoisePart) -> None:
    """Add to `total`, a view, the variance of a weighted sum of samples that deviate each by itself."""
    for offset, weight in zip(kernel.offsets, weights):
        if weight:
            total += weight**2 * variance[kernel.samples(offset)]
