"""Hermite-Gauss channels of an object's box: the observer's input from a window.

The channels are products of Hermite-Gauss functions He_n(u) exp(-u^2 / 4) of both axes, with u the
distance from the middle of the box over 0.4 of its width or height. All products up to a total
order are taken: 3 channels up to order 1, 10 up to order 3, 21 up to order 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.hermite_e import hermeval

SCALE = 0.4  # one unit of u, as a share of the width or height of a box
# half size of a window over size of the box; there, at u = 3.25, order 3 is < 0.1 of peak
REACH = 1.3


@dataclass(frozen=True, eq=False)
class Channels:
    """Separable channels on a window: Hermite-Gauss functions along y and along x.

    Parameters
    ----------
    rows : (y, order + 1) functions along y, each of unit length.
    columns : (x, order + 1) functions along x, each of unit length.
    pairs : (channel, 2) order along y and order along x of each channel.
    """

    rows: np.ndarray
    columns: np.ndarray
    pairs: np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """The size (y, x) of the window."""
        return len(self.rows), len(self.columns)

    def of(self, windows: np.ndarray) -> np.ndarray:
        """Return the channel outputs of windows.

        Parameters
        ----------
        windows : (..., colour, y, x) values of the windows.

        Returns
        -------
        (..., colour * channel) outputs.
        """
        return self.chosen(self.rows.T @ windows @ self.columns)

    def chosen(self, products: np.ndarray) -> np.ndarray:
        """Return the outputs (..., colour * channel) of the channels, from those of all pairs of
        functions.

        Parameters
        ----------
        products : (..., colour, order along y, order along x) outputs of all pairs of functions.
        """
        chosen = products[..., self.pairs[:, 0], self.pairs[:, 1]]
        # the length is spelt out because there may be no window at all
        return chosen.reshape(*chosen.shape[:-2], chosen.shape[-2] * chosen.shape[-1])

    def noise(self, colours: int) -> np.ndarray:
        """Return the covariance U'U of the outputs for independent noise of 1 in each pixel.

        Parameters
        ----------
        colours : number of colours, whose noise is independent.
        """
        of_rows = self.rows.T @ self.rows
        of_columns = self.columns.T @ self.columns
        down = self.pairs[:, 0]
        across = self.pairs[:, 1]
        one = of_rows[np.ix_(down, down)] * of_columns[np.ix_(across, across)]
        return np.kron(np.eye(colours), one)


def channels(
    shape: tuple[int, int], middle: tuple[float, float], box: tuple[float, float], order: int
) -> Channels:
    """Return the channels of a box on a window.

    Parameters
    ----------
    shape : (y, x) size of the window, pixels.
    middle : (y, x) middle of the box, pixels from the outer border of the window's first pixel.
    box : (height, width) of the box, pixels.
    order : largest total order.
    """
    rows, columns = (
        _functions(size, centre, length, order)
        for size, centre, length in zip(shape, middle, box, strict=True)
    )
    pairs = [(m, n) for m in range(order + 1) for n in range(order + 1 - m)]
    return Channels(rows, columns, np.array(pairs))


def count(order: int) -> int:
    """Return the number of channels up to a total order."""
    return (order + 1) * (order + 2) // 2


def _functions(size: int, centre: float, length: float, order: int) -> np.ndarray:
    u = (np.arange(size) + 0.5 - centre) / (SCALE * length)
    values = np.stack(
        [hermeval(u, np.eye(order + 1)[n]) * np.exp(-(u**2) / 4) for n in range(order + 1)], 1
    )
    lengths = np.linalg.norm(values, axis=0)
    return values / np.where(lengths > 0, lengths, 1.0)
