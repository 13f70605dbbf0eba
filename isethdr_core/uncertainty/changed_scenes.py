"""Changed scenes: picture and reference picture of the same scene with other renderer noise.

A renderer states half buffers: half of the difference between the light of two halves of its
samples. In a changed scene, each tile shows the light of one half or of the other, at random (the
wild bootstrap: Wu 1986). The scene is exposed and processed again with the same noise of the
sensor. The reference picture is changed in the same way. Light that was spread by the lens is not
changed: noise averages out in it, except in the flare of single bright tiles.

Sensor and image processing take most of the time, and a pixel depends only on tiles nearby. One
exposure of a large picture therefore shows several changes, each in blocks of its own: one random
choice in most, and the scene with its noise smoothed away in the others (`exposed_in_parts`). To
first order, the opposite choice changes each pixel by the same amount with the opposite sign. A
picture that takes some blocks from one choice and the others from the opposite is that of another
random choice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..data.quantities import tile_pitch
from ..data.reference_picture import before_denoising
from ..data.reference_picture import mean_over_pixels as mean_over_pixels
from ..data.temporal_modulation import time_mean
from ..physics.resampling.area import resample_mean
from . import ledger
from .render_noise import (
    direct_share,
    luminance_cd_m2,
    on_light,
    relative_halves,
    smoothing_change,
)

if TYPE_CHECKING:
    import xarray as xr

    from ..data.scores import Score

# smallest side of a block, pixels. Borders of blocks do not belong to the scene, and windows of
# metrics are about 10 pixels wide
BLOCK = 48
PARTS_ACROSS = 3  # a picture is cut into PARTS_ACROSS x PARTS_ACROSS parts
# not the seed of the run: the noise of a shot must not depend on whether scores are computed
LOT_SEED = 20260
# share by which the top of a sensor may lie above the brightest pixel that is not saturated
TOP_SLACK = 0.1
# largest factor on the light of a pixel: noise at most doubles it
LARGEST_FACTOR = 2.0
FEW_ROWS = 64  # every 64th row is compared first


class Pair(NamedTuple):
    """A picture and its reference picture."""

    picture: xr.Dataset
    truth: xr.Dataset


class Exposed(NamedTuple):
    """Two changed scenes from one exposure of a large picture. Each of them is exposed in some
    parts. In the other parts, its picture is that of the shot, times the change of the light at
    each pixel.
    """

    by_lot: Pair
    smoothed: Pair


@dataclass(frozen=True, eq=False)
class ScoredShot:
    """One shot of a camera with its scores, and a function that exposes other light.

    Attributes
    ----------
    picture, truth : picture and reference picture on one grid (y, x).
    labels : labels on that grid, or None.
    scores : scores of the picture, as the metrics return them.
    light : irradiance or photocurrent on the sensor plane, of which the shot was taken.
    mixed_radiance : mixed radiance from which the light was computed, W m-2 sr-1 nm-1.
    scene : scene radiance, with `half_difference` if a renderer states it.
    expose : function(light) -> the picture of this light with the shot's own noise.
    """

    picture: xr.Dataset
    truth: xr.Dataset
    labels: xr.Dataset | None
    scores: Sequence[Score]
    light: xr.DataArray
    mixed_radiance: xr.DataArray
    scene: xr.Dataset
    expose: Callable[[xr.DataArray], xr.Dataset]

    @property
    def pair(self) -> Pair:
        """The picture and its reference picture."""
        return Pair(self.picture, self.truth)

    @cached_property
    def mixed(self) -> xr.DataArray:
        """The mixed radiance, constant over time."""
        mean: xr.DataArray = time_mean(self.mixed_radiance)
        return mean

    @cached_property
    def relative_halves(self) -> np.ndarray | None:
        """The relative difference (y, x) of either half of the samples from their mean; None if the
        scene does not state it.
        """
        return relative_halves(self.scene, self.mixed)


@dataclass(frozen=True, eq=False)
class ChangedScenes:
    """Pictures that the camera of a shot takes of scenes with other renderer noise.

    A lot is a random choice of one half of the samples or the other in each tile.

    Attributes
    ----------
    shot : shot with known `relative_halves`.
    """

    shot: ScoredShot

    def by_lot(self, lot: int) -> Pair:
        """Return the pair with one half of the samples or the other in each tile, by lot. Each lot
        has its own random numbers.
        """
        return self._changed(self._lot(lot))

    def luminance_change(self, lot: int) -> np.ndarray:
        """Return the change (y, x) of the luminance of the reference picture by one lot, cd/m2. The
        opposite lot causes the opposite change.
        """
        return self._in_pixels(self._lot(lot))

    @cached_property
    def true_cd_m2(self) -> np.ndarray:
        """The luminance (y, x) of the reference picture."""
        return mean_over_pixels(self._level_cd_m2, self.shot.mixed, self.shot.picture)

    @property
    def tile_pixels(self) -> float:
        """The distance in pixels within which pixels see the same tile."""
        mixed = self.shot.mixed
        picture = self.shot.picture
        pitch_mm = float(picture.attrs["pitch_um"]) * 1e-3
        tile_mm = tile_pitch(mixed, "x") * float(picture.attrs["focal_length_mm"])
        return 1.0 + tile_mm / pitch_mm

    def _lot(self, lot: int) -> np.ndarray:
        halves = self._halves
        heads = np.random.default_rng([lot, LOT_SEED]).random(halves.shape) < 0.5
        return np.where(heads, halves, -halves)

    def _in_pixels(self, change: np.ndarray) -> np.ndarray:
        return mean_over_pixels(change * self._level_cd_m2, self.shot.mixed, self.shot.picture)

    def smoothed(self) -> Pair:
        """Return the pair with renderer noise smoothed away where it hides the scene."""
        return self._changed(self._smoothing)

    @property
    def _halves(self) -> np.ndarray:
        halves = self.shot.relative_halves
        assert halves is not None  # a scene without half buffers is not changed
        return halves

    @cached_property
    def _level_cd_m2(self) -> np.ndarray:
        return luminance_cd_m2(self.shot.mixed)

    @cached_property
    def _direct_share(self) -> np.ndarray:
        return direct_share(self.shot.light, self.shot.mixed)

    def exposed_in_parts(self, lot: int, smooth: np.ndarray) -> Exposed:
        """Return the pair of one lot and the smoothed pair, from one exposure.

        Parameters
        ----------
        lot : number of the lot.
        smooth : (y, x) bool, pixels in which the exposed scene is smoothed; the others show the
            lot.
        """
        light = self.shot.light
        picture = self.shot.picture
        changes = self._lot(lot), self._smoothing
        rows, columns = (
            np.abs(light[d].values[:, None] - picture[d].values).argmin(1) for d in ("y", "x")
        )
        at_light = smooth[np.ix_(rows, columns)]
        factors = [self._light_factor(change) for change in changes]
        exposed = self._exposed(np.where(at_light, factors[1], factors[0]))
        pairs = []
        for change, factor, where in zip(changes, factors, (~smooth, smooth), strict=True):
            changed = _scaled(self.shot.pair, self._over_pixels(factor))
            shown = where_exposed(changed, exposed, where)
            pairs.append(Pair(shown, self._reference(change)))
        return Exposed(*pairs)

    @cached_property
    def _smoothing(self) -> np.ndarray:
        change: np.ndarray = smoothing_change(self._halves, self._level_cd_m2)
        return change

    def _light_factor(self, change: np.ndarray) -> np.ndarray:
        """Return the light (plane, y, x) of a changed scene over that of the scene."""
        shot = self.shot
        on_sensor = on_light(change.astype(np.float32), shot.mixed, shot.light)
        factor: np.ndarray = (1 + self._direct_share * on_sensor).astype(shot.light.dtype)
        return factor

    def _over_pixels(self, factor: np.ndarray) -> np.ndarray:
        """Return the ratio (y, x) of the light of each pixel after the light is multiplied by a
        factor, to the light before.
        """
        light = time_mean(self.shot.light).values
        after, before = (
            resample_mean(planes.sum(axis=0), *self._pixels) for planes in (light * factor, light)
        )
        factors: np.ndarray = np.divide(after, before, out=np.ones_like(before), where=before > 0)
        return factors

    @property
    def _pixels(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float, float]:
        """The tiles of the light and the pixels of the picture, as `resample_mean` takes them."""
        light = self.shot.light
        picture = self.shot.picture
        side = float(picture.attrs["pitch_um"]) * 1e-6
        return light.x.values, light.y.values, picture.x.values, picture.y.values, side, side

    def _exposed(self, factor: np.ndarray) -> xr.Dataset:
        """Return the picture of the light times a factor."""
        light = self.shot.light
        changed = light.copy(data=light.values * factor)
        # the terms of a changed scene are those of the scene, which have been recorded
        picture: xr.Dataset = ledger.collected(lambda: self.shot.expose(changed)).result
        return picture

    def _reference(self, change: np.ndarray) -> xr.Dataset:
        """Return the reference picture after a relative `change` of the scene's luminance."""
        true = np.where(self.true_cd_m2 > 0, self.true_cd_m2, 1.0)
        of_pixels = (1 + self._in_pixels(change) / true)[..., None]
        truth = self.shot.truth
        return truth.assign(xyz=truth["xyz"].copy(data=truth["xyz"].values * of_pixels))

    def _changed(self, change: np.ndarray) -> Pair:
        """Return the picture and the reference picture of a changed scene.

        `change` (y, x) is the change of each tile's luminance over its luminance. Colours stay.
        """
        return Pair(self._exposed(self._light_factor(change)), self._reference(change))


def where_exposed(picture: xr.Dataset, exposed: xr.Dataset, where: np.ndarray) -> xr.Dataset:
    """Return `picture` with some pixels of another picture on its grid.

    Parameters
    ----------
    picture, exposed : pictures or reference pictures (y, x).
    where : (y, x) bool, pixels that are those of `exposed`.
    """
    variables = {}
    for name in _unlike(picture, exposed):
        values = picture[name].values.copy(order="K")
        mask = where.reshape(where.shape + (1,) * (values.ndim - 2))
        np.copyto(values, exposed[name].values, where=mask)
        variables[name] = picture[name].copy(data=values)
    return picture.assign(variables)


def _without_saturated(changed: xr.Dataset, unchanged: xr.Dataset) -> xr.Dataset:
    """Return a changed picture in which pixels above the top of the sensor are not valid.

    If some pixels of the unchanged picture are saturated, its brightest pixel that is not saturated
    gives the top.
    """
    valid = unchanged["valid"].values
    if valid.all() or not valid.any():
        return changed
    top = before_denoising(unchanged)["xyz"].values[valid, 1].max() * (1 + TOP_SLACK)
    measured = before_denoising(changed)["xyz"].values[..., 1] <= top
    return changed.assign(valid=changed["valid"].copy(data=valid & measured))


def _scaled(pair: Pair, factor: np.ndarray) -> xr.Dataset:
    """Return the picture of a pair after the light of each pixel is multiplied by a factor (y, x).

    Values and variances are multiplied. Next to a rare bright tile, smoothing makes a dark pixel up
    to 1e5 times as bright. Multiplied by this factor, its noise and the light that demosaicing has
    spread there would exceed every lamp. Above `LARGEST_FACTOR`, the light that the reference
    picture gains is therefore added to the values; variances grow by its share.
    """
    picture, truth = pair
    true = truth["xyz"].values
    gain = factor - 1
    far = factor > LARGEST_FACTOR
    some_far = far.any()
    level = np.maximum(np.abs(picture["xyz"].values[..., 1]), true[..., 1])
    share = np.divide(true[..., 1], level, out=np.zeros_like(gain), where=level > 0)
    of_variance = np.where(far, 1 + gain * share, factor)
    variables = {}
    for name, variable in picture.data_vars.items():
        if variable.dims[:2] == ("y", "x") and variable.dtype.kind == "f":
            before = variable.values
            if _one_value(before) and np.isnan(before.flat[0]):
                continue  # a variance that is not known stays NaN
            by = of_variance if "variance" in str(name) else factor
            values = before * by.reshape(by.shape + (1,) * (variable.ndim - 2))
            if some_far and str(name).endswith("xyz"):
                values[far] = before[far] + gain[far, None] * true[far]
            variables[name] = variable.copy(data=values.astype(before.dtype, copy=False))
    return _without_saturated(picture.assign(variables), picture)


def mirrored(unchanged: Pair, changed: Pair) -> Pair:
    """Return the pair of the opposite change, to first order.

    Values change by the opposite, variances by the inverse factor, so that they stay positive. The
    valid pixels are those of the unchanged picture that stay below the top of the sensor.

    Parameters
    ----------
    unchanged, changed : pairs before and after the change, on one grid.
    """
    picture = _mirrored(unchanged.picture, changed.picture)
    picture = _without_saturated(picture, unchanged.picture)
    return Pair(picture, _mirrored(unchanged.truth, changed.truth))


def _mirrored(unchanged: xr.Dataset, changed: xr.Dataset) -> xr.Dataset:
    variables = {}
    for name in _unlike(unchanged, changed):
        before = unchanged[name].values
        after = changed[name].values
        if before.dtype.kind != "f":
            continue
        if "variance" in name:
            values = np.divide(before * before, after, out=before.copy(), where=after > 0)
        else:
            values = 2 * before - after
        variables[name] = unchanged[name].copy(data=values)
    return unchanged.assign(variables)


def parts_of(picture: xr.Dataset) -> list[dict[str, np.ndarray]]:
    """Return indices {y, x} of the disjoint parts of a picture; none if the picture is small.

    A part holds blocks from all over the picture, so that it resembles the whole. Each block is
    large enough to resemble a picture.
    """
    cuts = {}
    for dim in ("y", "x"):
        size = picture.sizes[dim]
        blocks = size // (PARTS_ACROSS * BLOCK)
        if blocks < 2:
            return []
        strips = np.array_split(np.arange(size), PARTS_ACROSS * blocks)
        cuts[dim] = [np.concatenate(strips[k::PARTS_ACROSS]) for k in range(PARTS_ACROSS)]
    # the first PARTS_ACROSS parts together contain pixels of every row and column
    return [
        {"y": cuts["y"][k], "x": cuts["x"][(k + shift) % PARTS_ACROSS]}
        for shift in range(PARTS_ACROSS)
        for k in range(PARTS_ACROSS)
    ]


def numbers_of(parts: Sequence[dict[str, np.ndarray]]) -> np.ndarray:
    """Return the number (y, x) of the part that each pixel lies in.

    Parameters
    ----------
    parts : indices {y, x} of all parts of a picture, as `parts_of` returns them.
    """
    shape = [1 + max(int(part[d].max()) for part in parts) for d in ("y", "x")]
    numbers = np.zeros(shape, np.intp)
    for number, part in enumerate(parts):
        numbers[np.ix_(part["y"], part["x"])] = number
    return numbers


def part_of(picture: xr.Dataset, part: dict[str, np.ndarray]) -> xr.Dataset:
    """Return the pixels of one part: the same as `picture.isel(part)`, in a fraction of the time.

    Parameters
    ----------
    picture : picture or reference picture (y, x).
    part : indices {y, x}, as `parts_of` returns them.
    """
    rows = part["y"]
    columns = part["x"]
    of_pixels = {n: v for n, v in picture.data_vars.items() if v.dims[:2] == ("y", "x")}
    pieces = {}
    for name, variable in of_pixels.items():
        # rows and columns as the last axes, in their order in memory
        planes = np.moveaxis(variable.values, (0, 1), (-2, -1))
        piece = np.moveaxis(planes[..., rows, :][..., columns], (-2, -1), (0, 1))
        pieces[name] = (variable.dims, piece, variable.attrs)
    return picture.drop_vars(list(of_pixels)).isel(part, missing_dims="ignore").assign(pieces)


def joined_in_blocks(first: Pair, second: Pair, count: int) -> Iterator[Pair]:
    """Yield pairs composed at random of blocks of two pairs. Each block is that of the first pair
    in half of the results.

    Parameters
    ----------
    first, second : pairs on one grid.
    count : number of pairs, even.
    """
    rows, columns = (
        np.array_split(np.arange(first.picture.sizes[d]), first.picture.sizes[d] // BLOCK)
        for d in ("y", "x")
    )
    blocks = [np.s_[r[0] : r[-1] + 1, c[0] : c[-1] + 1] for r in rows for c in columns]
    order = np.random.default_rng([count, LOT_SEED]).random((len(blocks), count)).argsort(axis=1)
    unlike = [_unlike(*both) for both in zip(first, second)]
    for k in range(count):
        of_second = [block for block, place in zip(blocks, order[:, k]) if place < count // 2]
        yield Pair(
            *(
                _joined(one, other, names, of_second)
                for one, other, names in zip(first, second, unlike)
            )
        )


def _unlike(first: xr.Dataset, second: xr.Dataset) -> list[str]:
    """Return the variables of pixels in which two datasets differ."""
    names = [str(name) for name in first.data_vars if first[name].dims[:2] == ("y", "x")]
    return [name for name in names if not _same(first[name].values, second[name].values)]


def _same(first: np.ndarray, second: np.ndarray) -> bool:
    if first is second:
        return True
    nan_is_equal = first.dtype.kind == "f"
    if _one_value(first) and _one_value(second):
        return np.array_equal(first.flat[:1], second.flat[:1], equal_nan=nan_is_equal)
    few = np.s_[::FEW_ROWS]  # these rows show most differences
    return np.array_equal(first[few], second[few], equal_nan=nan_is_equal) and np.array_equal(
        first, second, equal_nan=nan_is_equal
    )


def _one_value(values: np.ndarray) -> bool:
    """Return whether all values of an array are one number in memory, such as an unknown variance,
    a broadcast NaN.
    """
    return values.size > 1 and not any(values.strides)


def _joined(
    first: xr.Dataset,
    second: xr.Dataset,
    names: Sequence[str],
    blocks: Sequence[tuple[slice, slice]],
) -> xr.Dataset:
    """Return a copy of `first` whose pixels inside `blocks` are those of `second`, in the variables
    `names`.
    """
    variables = {}
    for name in names:
        # the order in memory is kept, which is several times as fast
        values = first[name].values.copy(order="K")
        other = second[name].values
        for block in blocks:
            values[block] = other[block]
        variables[name] = first[name].copy(data=values)
    return first.assign(variables)
