"""Regions: the frame and the objects in it, with luminances, means and intervals that metrics
share."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.derived_once import intervals_wanted, once
from isethdr_core.errors import UnitError
from isethdr_core.physics.resampling.blocks import Block, alike, block_means, block_of
from isethdr_core.truth import before_denoising, check_picture, total_variance, variance_known

if TYPE_CHECKING:
    import xarray as xr

# number of blocks along each side of the frame; noise and scene count as independent between blocks
BLOCKS = 12
RESAMPLES = 400  # number of resamples of the blocks
FEWEST_BLOCKS = 8  # with fewer blocks, resampling gives no valid interval, and the interval is NaN
NAN = float("nan")


def check_pair(picture: xr.Dataset, truth: xr.Dataset) -> None:
    """Raise UnitError unless picture and truth are pictures on the same grid."""
    check_picture(picture, "picture")
    check_picture(truth, "truth")
    if picture["xyz"].shape != truth["xyz"].shape:
        raise UnitError(
            f"the picture has shape {picture['xyz'].shape}, its truth {truth['xyz'].shape}; "
            "make the truth with isethdr_core.truth.truth(mixed, picture)"
        )


def undenoised(picture: xr.Dataset) -> xr.Dataset:
    """Return the picture before denoising: `before_denoising`, once for all metrics."""
    return once("before denoising", (picture,), lambda: before_denoising(picture))


def luminances(picture: xr.Dataset, truth: xr.Dataset) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Y of picture and reference picture, cd/m2, and which pixels are valid, each (y, x).
    The arrays must not be changed.
    """
    check_pair(picture, truth)
    return _luminance(picture), _luminance(truth), picture["valid"].values


def _luminance(picture: xr.Dataset) -> np.ndarray:
    return once("luminance", (picture,), lambda: picture["xyz"].values[..., 1].astype(float))


def luminance_variance(picture: xr.Dataset) -> np.ndarray:
    """Return the variance (y, x) of luminance, temporal and fixed pattern together, (cd/m2)^2. The
    array must not be changed.
    """

    def variance() -> np.ndarray:
        # only this channel, because all three would take three times as long
        of_luminance = picture.isel(xyz_channel=[1])
        return total_variance(of_luminance).values[..., 0].astype(float)

    return once("luminance variance", (picture,), variance)


class BlockNoise(NamedTuple):
    """Noise against luminance, from means over blocks. The arrays must not be changed."""

    light: np.ndarray  # (y, x) mean true luminance of the block, cd/m2
    noise: np.ndarray  # (y, x) mean variance of luminance, (cd/m2)^2
    even: np.ndarray  # bool (y, x), valid pixels with about the luminance of their block


def block_of_picture(picture: xr.Dataset) -> Block:
    """Return the size of the blocks in which each filter of the picture's sensor counts equally."""
    return block_of(picture.attrs.get("cfa"))


def noise_of_blocks(picture: xr.Dataset, truth: xr.Dataset) -> BlockNoise:
    """Return luminance and noise of the blocks in which the pixels lie.

    After a demosaic, pixels of different filters have different variances. A median over such
    pixels may fall anywhere between them, and says little about their mean. A block is a cell of
    the colour filter array, so all blocks hold the same filters. Both means are over the valid
    pixels of a block, so a variance that is linear in luminance stays so.
    """
    _, true, valid = luminances(picture, truth)
    block = block_of_picture(picture)
    key = "true of blocks", block, valid.tobytes()
    light, even = once(key, (truth,), lambda: _even_light(true, valid, block))
    noise = once(
        "variance of blocks",
        (picture,),
        lambda: block_means(luminance_variance(picture), valid, block),
    )
    return BlockNoise(light, noise, even)


def _even_light(true: np.ndarray, valid: np.ndarray, block: Block) -> tuple[np.ndarray, np.ndarray]:
    light = block_means(true, valid, block)
    return light, valid & alike(true, light)


def variance_stated(picture: xr.Dataset, score: str, unit: str) -> bool:
    """Return whether the picture states its variance. If not, state in the ledger that `score` is
    left out.

    Parameters
    ----------
    picture : picture Dataset.
    score, unit : name and unit of the score, for the ledger.
    """
    if variance_known(picture):
        return True
    ledger.left_out(score, "the image processing is nonlinear and states no variance", NAN, unit)
    return False


class Region(NamedTuple):
    """The frame, or one labelled object in it."""

    name: str  # "" for the frame
    window: tuple[slice, slice]  # rows and columns of the frame that contain the region
    mask: np.ndarray  # bool, pixels of the region in the window
    shape: tuple[int, int]  # rows and columns of the frame

    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the values of the region's pixels, flat, from values (y, x) of the frame."""
        return values[self.window][self.mask]

    def pixels(self) -> np.ndarray:
        """Return the region's pixels as indices into the flattened frame, in the order of `of`."""
        rows, columns = np.nonzero(self.mask)
        top, left = (cut.start for cut in self.window)
        return (rows + top) * self.shape[1] + columns + left


def regions_of(shape: tuple[int, int], labels: xr.Dataset | None) -> list[Region]:
    """Return the whole frame, with the name "", then each labelled object with at least one pixel.

    Names come from the object table. The name of an object without an entry is its number.
    """
    return once(("regions", tuple(shape)), (labels,), lambda: _regions(tuple(shape), labels))


def frame_and_objects(
    shape: tuple[int, int], labels: xr.Dataset | None
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield (name, mask of the shape of the frame) for each region of `regions_of`."""
    for region in regions_of(shape, labels):
        mask = np.zeros(shape, bool)
        mask[region.window] = region.mask
        yield region.name, mask


def _regions(shape: tuple[int, int], labels: xr.Dataset | None) -> list[Region]:
    from scipy.ndimage import find_objects

    everywhere = slice(0, shape[0]), slice(0, shape[1])
    frame = Region("", everywhere, np.ones(shape, bool), shape)
    if labels is None or "instance" not in labels:
        return [frame]
    instance = labels["instance"].values
    if instance.shape != shape:
        raise UnitError(
            f"labels have shape {instance.shape}, the picture {shape}; "
            "use isethdr_core.truth.labels_on(scene, picture)"
        )
    names = {
        int(o["instance"]): str(o.get("name") or o.get("category") or o["instance"])
        for o in labels.attrs.get("objects", [])
    }
    labelled = np.flatnonzero(instance > 0)  # few pixels; sorting all would take most of the time
    numbers, rank = np.unique(instance.ravel()[labelled], return_inverse=True)
    order = np.zeros(instance.size, np.int32)
    order[labelled] = rank + 1
    windows = find_objects(order.reshape(shape))
    used_names: set[str] = set()
    regions = [frame]
    for number, window in zip(numbers.tolist(), windows, strict=True):
        name = names.get(number, str(number))
        if name in used_names:
            name = f"{name} {number}"
        used_names.add(name)
        regions.append(Region(name, window, instance[window] == number, shape))
    return regions


def median_interval(values: np.ndarray, independent: int) -> tuple[float, float, float]:
    """Return (median, low, high) of `values`, where low and high are the ends of the 95 % interval.

    The interval follows from the order statistics of n = `independent` independent values. The
    number of values below the median is binomial, so the ranks n / 2 +- 1.96 sqrt(n) / 2 enclose
    the median whatever the distribution (Conover 1999, section 3.2). If these ranks do not exist,
    the ends are the smallest and the largest value.

    Parameters
    ----------
    values : flat array.
    independent : number of independent values.
    """
    middle, *ends = (float(v) for v in np.quantile(values, median_shares(independent)))
    return middle, *(ends or (NAN, NAN))


def median_shares(independent: int) -> list[float]:
    """Return the shares of values below a median and, if intervals are wanted, below the ends of
    its interval. `independent` is as in `median_interval`.
    """
    if not intervals_wanted():
        return [0.5]
    spread = 0.98 / np.sqrt(max(independent, 1))
    return [0.5, max(0.5 - spread, 0.0), min(0.5 + spread, 1.0)]


def mean_interval(values: np.ndarray, mask: np.ndarray) -> tuple[float, float, float]:
    """Return (mean, low, high) of `values` (y, x) over `mask`, where low and high are the ends of
    the 95 % interval by resampling blocks of the frame.
    """
    rows, columns = (np.flatnonzero(mask.any(axis)) for axis in (1, 0))
    if not rows.size:
        return NAN, NAN, NAN
    window = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    return mean_of(values, Region("", window, mask[window], mask.shape))


def mean_of(
    values: np.ndarray, region: Region, use: np.ndarray | None = None
) -> tuple[float, float, float]:
    """Return (mean, low, high) of `values` (y, x) over a region, where low and high are the ends of
    the 95 % interval by resampling blocks of the frame.

    Parameters
    ----------
    values : (y, x) values of the frame.
    region : frame or object.
    use : bool (y, x), pixels of the frame that count; None: all.
    """
    mask = region.mask if use is None else region.mask & use[region.window]
    in_region = np.where(mask, values[region.window], 0.0)
    pixels = int(mask.sum())
    if not pixels:
        return NAN, NAN, NAN
    mean = float(in_region.sum(dtype=float) / pixels)
    if not intervals_wanted():
        return mean, NAN, NAN
    begin = [
        np.flatnonzero(np.diff(np.arange(n)[cut] * BLOCKS // n, prepend=-1))
        for n, cut in zip(region.shape, region.window, strict=True)
    ]
    count, total = (
        np.add.reduceat(np.add.reduceat(v, begin[1], axis=1, dtype=float), begin[0], axis=0).ravel()
        for v in (mask, in_region)
    )
    some = count > 0
    if some.sum() < FEWEST_BLOCKS:
        return mean, NAN, NAN
    count = count[some]
    total = total[some]
    picks = _picks(len(count))
    low, high = np.percentile(picks @ total / (picks @ count), [2.5, 97.5])
    return mean, float(low), float(high)


def means_of_parts(
    values: np.ndarray, part: np.ndarray, use: np.ndarray | None = None
) -> np.ndarray:
    """Return the mean (part,) of `values` over each part of the frame; NaN if none of its pixels
    counts.

    Parameters
    ----------
    values : (y, x) values of the frame.
    part : (y, x), number of the part of each pixel, from 0.
    use : bool (y, x), pixels that count; None: all.
    """
    weights = values if use is None else np.where(use, values, 0.0)
    total = np.bincount(part.ravel(), weights.ravel())
    count = np.bincount(part.ravel(), None if use is None else use.ravel())
    return np.divide(total, count, out=np.full(total.shape, NAN), where=count > 0)


@lru_cache(maxsize=32)
def _picks(blocks: int) -> np.ndarray:
    """Return the numbers of draws (resample, block) of each block in each resample.

    The seed is fixed, so that the same picture has the same score.
    """
    return (
        np.random.default_rng(0)
        .multinomial(blocks, np.full(blocks, 1 / blocks), RESAMPLES)
        .astype(float)
    )
