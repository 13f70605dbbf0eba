"""Noise propagation: the variance of a picture that is a linear map of the mosaic.

Every value of a picture is a weighted sum of samples of the mosaic. Colour matrix and demosaic are
combined to one kernel per position of the filter array, so the result includes the covariance
between interpolated channels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np

# number of pixels computed at a time, so that their samples stay in the processor's cache
AT_ONCE = 1 << 14

Alike = Literal["same", "any"]


class NoisePart(NamedTuple):
    """One cause of noise: its variance in every sample, and the samples that share one deviation.

    `rows` and `columns` define these samples. "same" means that only samples of the same row or
    column share a deviation, "any" that samples of all rows or columns do. The shared deviation is
    one normal number times the square root of the variance.
    """

    variance_e2: np.ndarray  # (y, x)
    rows: Alike = "same"
    columns: Alike = "same"

    def alone(self) -> bool:
        """Return whether all samples are independent."""
        return self.rows == "same" and self.columns == "same"

    def samples(self) -> float | np.ndarray:
        """Return the noise (y, x) in the form that `weighted` needs: standard deviations if samples
        share a deviation, otherwise variances. If all samples have the same variance, return one
        standard deviation instead.
        """
        if self.variance_e2.min() == self.variance_e2.max() >= 0:
            return np.sqrt(self.variance_e2.flat[0])
        return self.variance_e2 if self.alone() else np.sqrt(self.variance_e2)

    def groups(self, places: list[tuple[int, int]]) -> list[list[int]]:
        """Return the samples at `places` (row, column) in groups that share a deviation."""
        by_deviation: dict = {}
        for number, (row, column) in enumerate(places):
            key = row * (self.rows == "same"), column * (self.columns == "same")
            by_deviation.setdefault(key, []).append(number)
        return list(by_deviation.values())

    def weighted(
        self, weights: np.ndarray, groups: list[list[int]], near: np.ndarray
    ) -> np.ndarray:
        """Return the variance (out, pixel) of weighted sums of samples.

        Parameters
        ----------
        weights : (out, sample) weights of the samples.
        groups : numbers of the samples that share a deviation, as `groups` returns them.
        near : noise (sample, pixel) of the samples of each pixel, as `samples` returns it.
        """
        if self.alone():
            return weights**2 @ near
        return sum((weights[:, group] @ near[group]) ** 2 for group in groups)

    def gain(self, weights: np.ndarray, groups: list[list[int]]) -> np.ndarray:
        """Return the variance (out,) of sums of samples of variance 1, weighted by `weights` (out,
        sample). `groups` is as in `weighted`.
        """
        return sum(weights[:, group].sum(axis=1) ** 2 for group in groups)


@dataclass(frozen=True, eq=False)
class SampleNoise:
    """The noise of the samples of a mosaic: independent causes with variances that add."""

    parts: tuple[NoisePart, ...] = ()

    def scaled(self, factor: np.ndarray) -> SampleNoise:
        """Return the noise of the samples times `factor`, (y, x) or a number."""
        square = np.square(factor)
        return SampleNoise(
            tuple(part._replace(variance_e2=part.variance_e2 * square) for part in self.parts)
        )

    def total_e2(self) -> float | np.ndarray:
        """Return the variance (y, x) of the samples, e^2; 0.0 where there is no noise."""
        return sum((part.variance_e2 for part in self.parts), 0.0)


def independent(variance_e2: np.ndarray) -> SampleNoise:
    """Return the noise of independent samples (y, x)."""
    return SampleNoise((NoisePart(np.asarray(variance_e2, float)),))


class NoiseMap(Protocol):
    """A demosaic as a linear map of the samples."""

    def variance(self, matrix: np.ndarray, noise: SampleNoise) -> np.ndarray:
        """Return the variance (out, y, x) of `matrix` (out, channel) times the interpolated
        channels.
        """


class Kernel(NamedTuple):
    """The weights from which every channel of a regular group of pixels is computed."""

    rows: np.ndarray  # rows of the pixels, at a regular distance
    columns: np.ndarray  # columns of the pixels, at a regular distance
    offsets: list[tuple[int, int]]  # (dy, dx) of each sample from the pixel
    weights: np.ndarray  # (channel, sample)

    def pixels(self) -> tuple[slice, slice]:
        """Return the slices of the pixels of this kernel."""
        return _slice(self.rows), _slice(self.columns)

    def samples(self, offset: tuple[int, int]) -> tuple[slice, slice]:
        """Return the slices of the samples at `offset` from these pixels."""
        return _slice(self.rows + offset[0]), _slice(self.columns + offset[1])

    def blocks(self) -> list[Kernel]:
        """Return the kernel in blocks of rows, of about `AT_ONCE` pixels each."""
        step = max(AT_ONCE // len(self.columns), 1)
        return [
            self._replace(rows=self.rows[start : start + step])
            for start in range(0, len(self.rows), step)
        ]


def _slice(index: np.ndarray) -> slice:
    """Return a regular index array as a slice, which gives a view instead of a copy."""
    step = int(index[1] - index[0]) if len(index) > 1 else 1
    return slice(int(index[0]), int(index[-1]) + 1, step)


@dataclass(frozen=True, eq=False)
class Kernels:
    """A linear demosaic: kernels that cover every pixel once."""

    kernels: list[Kernel]
    shape: tuple[int, int]  # rows and columns of the mosaic

    def variance(self, matrix: np.ndarray, noise: SampleNoise) -> np.ndarray:
        """Return the variance (out, y, x) of `matrix` (out, channel) times the interpolated
        channels.

        Notes
        -----
        Let k be the combined weight of a sample. The variance is the sum of k^2 Var over the
        samples. For samples that share a deviation, the sum of k sd is squared. The result is
        exact.
        """
        variance = np.zeros((len(matrix), *self.shape))
        for part in noise.parts:
            samples = part.samples()
            for kernel in self.kernels:
                composed = np.asarray(matrix) @ kernel.weights
                groups = part.groups(kernel.offsets)
                if np.ndim(samples) == 0:
                    variance[(slice(None), *kernel.pixels())] += (
                        part.gain(composed, groups)[:, None, None] * samples**2
                    )
                    continue
                for block in kernel.blocks():
                    pixels = block.pixels()
                    near = np.stack(
                        [samples[block.samples(offset)].ravel() for offset in block.offsets]
                    )
                    shape = (len(variance), len(block.rows), len(block.columns))
                    variance[(slice(None), *pixels)] += part.weighted(
                        composed, groups, near
                    ).reshape(shape)
        return variance
