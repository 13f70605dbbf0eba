"""Demosaic methods by name: a bilinear and a guided rule for any array, two published rules for
Bayer arrays, and a learned rule.

| method     | arrays | variance                                                      |
|------------|--------|---------------------------------------------------------------|
| `bilinear` | any    | exact                                                         |
| `guided`   | any    | not stated: the slopes depend on the noise                    |
| `malvar`   | Bayer  | exact: the filters are linear                                 |
| `menon`    | Bayer  | not stated: the directions depend on the noise                |
| `learned`  | Bayer, RG/WB, RGBW 4 x 4 | not stated: the choice of filters depends on the noise |
| `automatic` | any   | that of the method that `chosen` returns for the array        |
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError, UnitError, did_you_mean
from isethdr_core.extras import needed

from ..readout.noise_propagation import Kernels, NoiseMap
from . import learned
from .guided_colour import guided_colour
from .interpolation import (
    array_period,
    bilinear,
    demosaic,
    folded,
    interpolated,
    places,
    using_invalid,
)

BAYER_ALONE = ("malvar", "menon")
BAYER = ("RGGB", "BGGR", "GRBG", "GBRG")
METHODS = ("bilinear", "guided", "malvar", "menon", "learned")
AUTOMATIC = "automatic"  # `chosen` replaces it by one of the methods
FOLLOWS_VARIANCE = ("guided", "learned")  # methods that use the variance of the mosaic
STATES_VARIANCE = ("bilinear", "malvar")
# pixels on each side of the centre of the guided method's window, which contains at least 4 samples
# of every channel of a 4 x 4 array
RADIUS = 3
REACH = 2  # reach of Malvar's 5 x 5 filters and of Menon's final step, pixels
GUIDE_REACH = 3  # largest distance from a pixel of the guide to a sample that it depends on, pixels


class Interpolated(NamedTuple):
    """A demosaiced mosaic."""

    planes: np.ndarray  # (channel, y, x)
    invalid: np.ndarray  # (y, x) bool, pixels that depend on a sample that is not valid
    # propagation of the samples' noise; None if the method does not state it
    noise_map: NoiseMap | None


def interpolate(
    method: str,
    mosaic: np.ndarray,
    filters: np.ndarray,
    names: list[str],
    variance: np.ndarray,
    bad: np.ndarray,
) -> Interpolated:
    """Return a demosaiced mosaic.

    Parameters
    ----------
    method : one of `METHODS`.
    mosaic : electrons (y, x).
    filters : (y, x) number of the channel that each pixel samples.
    names : name of each channel.
    variance : temporal variance of the mosaic (y, x), e^2.
    bad : (y, x) bool, the samples that are not valid.

    Raises
    ------
    ConfigError : the method is unknown.
    UnitError : the method does not work on this filter array.
    """
    if method not in METHODS:
        raise ConfigError(f"isp demosaic {method!r} is unknown{did_you_mean(method, METHODS)}")
    if method == "learned" and len(names) > 1:
        _state_unknown_variance(method)
        return _learned(mosaic, filters, names, variance, bad)
    if method == "malvar":
        planes = bayer(method, mosaic, filters, names)
        return Interpolated(planes, _dilated(bad, REACH), malvar_kernels(filters, names))
    if method == "menon":
        _state_unknown_variance(method)
        return Interpolated(bayer(method, mosaic, filters, names), _dilated(bad, REACH), None)
    rule = bilinear(filters, len(names))
    planes = interpolated(rule, mosaic)
    invalid = using_invalid(rule, bad)
    if method == "guided" and len(names) > 1:
        lead = leading_channel(filters, len(names))
        if lead is None:
            ledger.left_out(
                "guide of the demosaic",
                "no channel is sampled more than the others; the bilinear rule is used",
                np.nan,
                "",
            )
            return Interpolated(planes, invalid, rule)
        _state_unknown_variance(method)
        guided = _guided(mosaic, planes, filters, variance, lead)
        if bad.any():  # the fits around a sample that is not valid have no meaning
            fitted = GUIDE_REACH + RADIUS + max(array_period(filters))
            guided = np.where(_dilated(bad, fitted), planes, guided)
        return Interpolated(guided, invalid, None)
    return Interpolated(planes, invalid, rule)


def chosen(method: str, filters: np.ndarray, names: list[str]) -> str:
    """Return the method itself, or the one that "automatic" stands for: `learned` if filters are
    trained for the filter array, otherwise `guided`.

    Parameters
    ----------
    method : one of `METHODS`, or "automatic".
    filters : (y, x) number of the channel that each pixel samples.
    names : name of each channel.
    """
    if method != AUTOMATIC:
        return method
    filters = np.asarray(filters)
    rows, columns = array_period(filters)
    cell = ["".join(names[k] for k in row) for row in filters[:rows, :columns]]
    trained = any(learned.is_shifted(cell, array) for array in learned.arrays())
    return "learned" if trained and min(filters.shape) >= learned.SIDE else "guided"


def check_array(method: str, cell: Sequence[str]) -> None:
    """Raise ConfigError if a demosaic method does not work on a filter array.

    Parameters
    ----------
    method : one of `METHODS`, or "automatic".
    cell : rows of the array's repeated cell, one letter per pixel.
    """
    is_mosaic = len(set("".join(cell))) > 1  # else every pixel samples the only channel
    if method == "learned" and is_mosaic:
        arrays = learned.arrays()
        if not any(learned.is_shifted(cell, array) for array in arrays):
            raise ConfigError(
                f"isp.demosaic is 'learned' and the filter array {'/'.join(cell)}, for which no "
                f"filters are trained; expected one of {', '.join(arrays)}, shifted or not; "
                "type isp.demosaic=guided"
            )
    if method in BAYER_ALONE and "".join(cell) not in BAYER:
        raise ConfigError(
            f"isp.demosaic is {method!r} and the filter array {'/'.join(cell)}; "
            "expected a Bayer array, for example RG/GB; type isp.demosaic=guided"
        )


def _learned(
    mosaic: np.ndarray, filters: np.ndarray, names: list[str], variance: np.ndarray, bad: np.ndarray
) -> Interpolated:
    """Return the planes of the learned filters. Pixels with an invalid sample in their filter use
    the bilinear rule, which needs fewer samples. If no channel is sampled more than the others,
    `guided_colour` is applied at the end.
    """
    planes = learned.learned(mosaic, filters, names, variance)
    rule = bilinear(filters, len(names))
    usable = ~_dilated(bad, learned.RADIUS)
    if bad.any():
        planes = np.where(usable, planes, interpolated(rule, mosaic))
    if leading_channel(filters, len(names)) is None:
        planes = guided_colour(planes, variance, usable)
        planes = learned.within_samples(planes, mosaic, filters)
    return Interpolated(planes, using_invalid(rule, bad), None)


def _state_unknown_variance(method: str) -> None:
    ledger.left_out(
        f"variance of demosaic {method}",
        "the method depends on the noise, so the picture states no variance",
        np.nan,
        "",
    )


def bayer(method: str, mosaic: np.ndarray, filters: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Return planes (channel, y, x) by a method of the package colour-demosaicing.

    Parameters
    ----------
    method : "malvar" (Malvar, He, Cutler 2004) or "menon" (Menon, Andriani, Calvagno 2007).
    mosaic : electrons (y, x).
    filters : (y, x) number of the channel that each pixel samples.
    names : name of each channel.

    Raises
    ------
    UnitError : the array is no Bayer array.
    """
    pattern = "".join(names[k] for k in np.asarray(filters)[:2, :2].ravel())
    if sorted(names) != ["B", "G", "R"] or pattern not in BAYER or not _repeats(filters):
        raise UnitError(
            f"demosaic {method} is for Bayer arrays; this one begins with {pattern}; use"
            " isp.demosaic=guided"
        )
    with needed(f"demosaic {method} (isp.demosaic=bilinear does not)", extra="demosaic"):
        import colour_demosaicing
    rule = {
        "malvar": colour_demosaicing.demosaicing_CFA_Bayer_Malvar2004,
        "menon": colour_demosaicing.demosaicing_CFA_Bayer_Menon2007,
    }[method]
    if method == "malvar":
        # A mirror that does not repeat the outermost sample keeps the phase of the array. The
        # package repeats it, and so mixes the colours at the border.
        rgb = rule(np.pad(mosaic, REACH, mode="reflect"), pattern)[REACH:-REACH, REACH:-REACH]
    else:
        rgb = rule(mosaic, pattern)
    return np.stack([rgb[..., "RGB".index(name)] for name in names])


def _dilated(bad: np.ndarray, reach: int) -> np.ndarray:
    """Return which pixels (y, x) lie within `reach` rows and columns of a bad pixel."""
    if not bad.any():
        return bad
    near = bad
    for axis in (0, 1):
        lines = np.moveaxis(near, axis, 0)
        wide = lines.copy(order="K")
        for k in range(1, min(reach, len(lines) - 1) + 1):
            wide[k:] |= lines[:-k]
            wide[:-k] |= lines[k:]
        near = np.moveaxis(wide, 0, axis)
    return near


def _repeats(filters: np.ndarray) -> bool:
    f = np.asarray(filters)
    return np.array_equal(f[2:], f[:-2]) and np.array_equal(f[:, 2:], f[:, :-2])


def malvar_kernels(filters: np.ndarray, names: Sequence[str]) -> Kernels:
    """Return Malvar's rule as kernels, from its response to a single sample of 1 at each position
    of the array.
    """
    filters = np.asarray(filters)
    size = 16
    middle = 8
    tile = np.tile(filters[:2, :2], (size // 2, size // 2))
    taps = {(row, column): [[] for _ in names] for row in (0, 1) for column in (0, 1)}
    for y, x in taps:
        impulse = np.zeros((size, size))
        impulse[middle + y, middle + x] = 1.0
        for channel, answer in enumerate(bayer("malvar", impulse, tile, names)):
            for row, column in np.argwhere(answer):
                offset = middle + y - int(row), middle + x - int(column)
                taps[row % 2, column % 2][channel].append((*offset, float(answer[row, column])))
    rows, columns, _ = places(filters)
    kernels = [
        folded(row, column, taps[row[0] % 2, column[0] % 2], filters.shape)
        for row in rows
        for column in columns
    ]
    return Kernels(kernels, filters.shape)


def leading_channel(filters: np.ndarray, channels: int) -> int | None:
    """Return the channel that is sampled more than every other; None if there is none."""
    filters = np.asarray(filters)
    samples = np.bincount(filters.ravel(), minlength=channels)
    lead = int(np.argmax(samples))
    # a picture with an odd number of rows or columns has up to half a row and half a column more
    # samples of some channels
    return None if np.sum(samples > samples[lead] - sum(filters.shape)) > 1 else lead


def _guided(
    mosaic: np.ndarray, planes: np.ndarray, filters: np.ndarray, variance: np.ndarray, lead: int
) -> np.ndarray:
    """Return planes interpolated with a guide: the channel that is sampled most, such as green of
    Bayer or white of RGBW.

    Residual interpolation (Kiku et al. 2013): each channel is locally a linear function of the
    guide, fitted to its own samples (He et al. 2010). The residuals at the samples are interpolated
    and added. The denominator of the slope contains the noise of the guide. In the dark the slope
    is therefore near 0, and the result is that of the bilinear rule. A guide that is not sampled
    more than other channels would spread its aliasing to all of them.
    """
    filters = np.asarray(filters)
    guide = _along_edges(mosaic, planes[lead], filters == lead, variance)
    guided = planes.copy()
    guided[lead] = guide
    for channel in range(len(planes)):
        if channel == lead:
            continue
        at = filters == channel
        slope, offset = _local_line(guide, mosaic, at, variance)
        trend = slope * guide + offset
        residual = demosaic(np.where(at, mosaic - trend, 0.0), filters, len(planes))[0][channel]
        guided[channel] = np.where(at, mosaic, trend + residual)
    return guided


def _along_edges(
    mosaic: np.ndarray, plane: np.ndarray, at: np.ndarray, variance: np.ndarray
) -> np.ndarray:
    """Return the guide (y, x). If its samples form a checkerboard, it is interpolated mainly along
    the direction in which it changes less.
    """
    from scipy.ndimage import uniform_filter

    padded = np.pad(mosaic, 1, mode="reflect")
    sampled = np.pad(at, 1, mode="reflect")
    left = (slice(1, -1), slice(None, -2))
    right = (slice(1, -1), slice(2, None))
    up = (slice(None, -2), slice(1, -1))
    down = (slice(2, None), slice(1, -1))
    among = ~at & sampled[left] & sampled[right] & sampled[up] & sampled[down]
    if not among.any():
        return plane
    means = []
    weights = []
    for first, second in ((left, right), (up, down)):
        means.append((padded[first] + padded[second]) / 2)
        change = uniform_filter(
            np.where(among, (padded[first] - padded[second]) ** 2, 0.0), 5, mode="mirror"
        )
        share = uniform_filter(among.astype(float), 5, mode="mirror")
        # without any change, the mean squared difference of two noisy samples is 2 variances
        weights.append(1 / np.maximum(change / np.maximum(share, 1e-9) + 2 * variance, 1e-30) ** 2)
    along = (weights[0] * means[0] + weights[1] * means[1]) / (weights[0] + weights[1])
    return np.where(among, along, plane)


def _local_line(
    guide: np.ndarray, values: np.ndarray, at: np.ndarray, variance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return slope and offset (y, x) of the line fitted to `values` over `guide` at the samples
    `at` in the window around each pixel.
    """
    from scipy.ndimage import uniform_filter

    def mean(a: np.ndarray) -> np.ndarray:
        return uniform_filter(a, 2 * RADIUS + 1, mode="mirror")

    weight = mean(at.astype(float))
    safe = np.maximum(weight, 1e-12)

    def over_samples(a: np.ndarray) -> np.ndarray:
        return mean(np.where(at, a, 0.0)) / safe

    g = over_samples(guide)
    v = over_samples(values)
    spread = np.maximum(over_samples(guide**2) - g * g, 0.0)
    together = over_samples(guide * values) - g * v
    slope = together / np.maximum(spread + mean(variance), 1e-12)
    return slope, v - slope * g
