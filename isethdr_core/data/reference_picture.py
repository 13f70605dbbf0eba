"""Reference picture (`truth`): the picture without noise, blur and flare, and labels on its pixels.

It follows from the mixed radiance alone, by exact area integration over the pixels of the picture
that is compared with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..errors import UnitError
from ..physics.photometry import xyz_weights
from ..physics.resampling.area import resample_mean
from ..uncertainty import ledger
from . import camera_geometry
from .quantities import LUMINANCE, MOTION, check_mixed, names, tile_pitch
from .temporal_modulation import time_mean

PICTURE_DIMS = ("y", "x", "xyz_channel")
UNDENOISED = "undenoised_"  # prefix of variables of a denoised picture: values before denoising
VARIANCE_KNOWN = "variance_known"  # optional attribute of a picture; absent means True
FIXED_PATTERN = "fixed_pattern_variance"  # optional variable of a picture
FLOAT32 = 2.0**-24  # relative rounding error: half a unit in the last place of a float32
TIE = 1e-6  # rounding error of coordinates, as a share of a tile


def make_picture(
    xyz: npt.ArrayLike,
    variance: npt.ArrayLike,
    valid: npt.ArrayLike,
    x_m: npt.ArrayLike,
    y_m: npt.ArrayLike,
    fixed_pattern_variance: npt.ArrayLike | None = None,
    **attrs: Any,
) -> xr.Dataset:
    """Return a picture Dataset.

    Parameters
    ----------
    xyz : (y, x, 3) array, Y in cd/m2; estimates, so negative values stay.
    variance : same shape, (cd/m2)^2, from shot to shot of one device.
    valid : (y, x) bool.
    x_m, y_m : pixel centres on the sensor plane, m.
    fixed_pattern_variance : same shape, (cd/m2)^2, from device to device of one model; None where
        it is not known.
    attrs : attributes of the picture; at least focal_length_mm and pitch_um, which tie pixels to
        field angles.

    Raises
    ------
    UnitError : focal_length_mm or pitch_um is missing.
    """
    for name in ("focal_length_mm", "pitch_um"):
        if name not in attrs:
            raise UnitError(
                f"a picture needs the attribute {name!r}; the isp copies it from the captures"
            )
    picture = xr.Dataset(
        {
            "xyz": (PICTURE_DIMS, xyz, {"units": LUMINANCE}),
            "variance": (PICTURE_DIMS, variance, {"units": "cd2 m-4"}),
            "valid": (("y", "x"), np.asarray(valid, bool)),
        },
        coords={
            "y": np.asarray(y_m, float),
            "x": np.asarray(x_m, float),
            "xyz_channel": names("XYZ"),
        },
        attrs={**attrs, "units": LUMINANCE},
    )
    if fixed_pattern_variance is not None:
        picture[FIXED_PATTERN] = (PICTURE_DIMS, fixed_pattern_variance, {"units": "cd2 m-4"})
    return picture


def total_variance(picture: xr.Dataset) -> xr.DataArray:
    """Return the variance (y, x, xyz_channel) of a pixel of an unknown device, (cd/m2)^2.

    It is the sum of the temporal variance and the fixed-pattern variance. A picture without
    `fixed_pattern_variance` counts as free of fixed pattern.
    """
    variance = picture["variance"]
    if FIXED_PATTERN not in picture:
        return variance
    return (variance + picture[FIXED_PATTERN]).assign_attrs(variance.attrs)


def variance_known(picture: xr.Dataset) -> bool:
    """Return whether the picture states its variance. If not, its variances are NaN, and no score
    may use them.
    """
    return bool(picture.attrs.get(VARIANCE_KNOWN, True))


def with_undenoised(picture: xr.Dataset, undenoised: xr.Dataset) -> xr.Dataset:
    """Return a denoised picture that also holds values and variances before denoising."""
    names = [name for name in ("xyz", "variance", FIXED_PATTERN) if name in undenoised]
    return picture.assign({UNDENOISED + name: undenoised[name] for name in names})


def before_denoising(picture: xr.Dataset) -> xr.Dataset:
    """Return the picture before denoising, or `picture` itself if it holds no such variables."""
    names = [name for name in picture.data_vars if str(name).startswith(UNDENOISED)]
    if not names:
        return picture
    stored = {str(name).removeprefix(UNDENOISED): picture[name] for name in names}
    undenoised = picture.drop_vars([FIXED_PATTERN, *names], errors="ignore").assign(stored)
    undenoised.attrs = {k: v for k, v in picture.attrs.items() if k != VARIANCE_KNOWN}
    return undenoised


def check_picture(picture: xr.Dataset, title: str = "picture") -> None:
    """Raise UnitError unless `picture` has xyz in cd/m2, variance and valid on one grid."""
    for name in ("xyz", "variance", "valid"):
        if name not in getattr(picture, "data_vars", {}):
            raise UnitError(
                f"{title} has no variable {name!r}; expected a picture Dataset as an isp or truth()"
                " returns it"
            )
    if (
        tuple(picture["xyz"].dims) != PICTURE_DIMS
        or tuple(picture["variance"].dims) != PICTURE_DIMS
    ):
        raise UnitError(
            f"{title} has xyz dims {tuple(picture['xyz'].dims)}; expected {PICTURE_DIMS}"
        )
    if FIXED_PATTERN in picture and tuple(picture[FIXED_PATTERN].dims) != PICTURE_DIMS:
        raise UnitError(
            f"{title} has {FIXED_PATTERN} dims {tuple(picture[FIXED_PATTERN].dims)}; expected"
            f" {PICTURE_DIMS}"
        )
    if picture["xyz"].attrs.get("units") != LUMINANCE:
        raise UnitError(
            f"{title} has xyz in {picture['xyz'].attrs.get('units')!r}; expected {LUMINANCE!r}"
        )


def check_developed(picture: xr.Dataset, title: str) -> None:
    """Raise UnitError unless the values of a picture can be scored.

    Parameters
    ----------
    picture : what an isp returned.
    title : the picture in messages, with the isp that made it.

    Raises
    ------
    UnitError : as `check_picture` raises it; `valid` is not bool (y, x); `xyz_channel` is not X, Y,
        Z; in a valid pixel a value is not finite, or a variance that is known is not finite or
        below 0.
    """
    check_picture(picture, title)
    valid = picture["valid"]
    if valid.dims != PICTURE_DIMS[:2] or valid.dtype != bool:
        raise UnitError(
            f"{title} has valid of type {valid.dtype} and dims {valid.dims}; expected bool and"
            f" {PICTURE_DIMS[:2]}; make the picture with isethdr_core.truth.make_picture"
        )
    channels = picture["xyz_channel"].values.tolist() if "xyz_channel" in picture.coords else []
    if channels != list("XYZ"):
        raise UnitError(
            f"{title} has xyz_channel {channels}; expected ['X', 'Y', 'Z']; give"
            " isethdr_core.truth.make_picture arrays in this order"
        )
    _check_values(
        picture,
        "xyz",
        -np.inf,
        f"{title} has xyz {{}}; expected finite values; set valid to False in a pixel without an"
        " estimate",
    )
    if not variance_known(picture):
        return
    advice = (
        "; where the variance is not known, set the attribute variance_known to False and all"
        " variances to NaN"
    )
    _check_values(
        picture,
        "variance",
        0.0,
        f"{title} has variance {{}}; expected finite values of 0 or more{advice}",
    )
    if FIXED_PATTERN in picture:
        _check_values(
            picture,
            FIXED_PATTERN,
            -np.inf,
            f"{title} has {FIXED_PATTERN} {{}}; expected finite values{advice}",
        )


def _check_values(picture: xr.Dataset, name: str, least: float, message: str) -> None:
    """Raise UnitError unless a variable is finite and at least `least` in all valid pixels.

    Parameters
    ----------
    picture : picture whose form has been checked.
    name : variable (y, x, xyz_channel).
    least : smallest value allowed.
    message : text of the error; {} is replaced by the first wrong value and their number.
    """
    values = picture[name].values
    with np.errstate(invalid="ignore"):
        # NaN passes through both; two passes without a mask take little time
        low = values.min(initial=0.0)
        high = values.max(initial=0.0)
        if low >= least and low > -np.inf and high < np.inf:
            return
        wrong = ~(np.isfinite(values) & (values >= least)) & picture["valid"].values[..., None]
    if wrong.any():
        count = int(wrong.any(axis=-1).sum())
        pixels = "1 valid pixel" if count == 1 else f"{count} valid pixels"
        raise UnitError(message.format(f"{values[wrong][0]:g} in {pixels}"))


def truth(mixed: xr.DataArray, picture: xr.Dataset) -> xr.Dataset:
    """Return the reference picture on the grid of `picture`.

    It is the mean XYZ of the radiance within the field of view of each pixel.

    Notes
    -----
    A pixel at x on the sensor images the field coordinate x / focal length, or the quadrilateral
    of the field that a distorting lens images there. Colour matching comes before the integration;
    both are linear, so their order does not matter. Variance is 0 and every pixel is valid. Light
    that varies in time counts with its mean over time.
    """
    mixed = time_mean(mixed)
    check_mixed(mixed)
    # sum over bands in float64: 31 float32 bands of a lamp and a dark road would otherwise lose the
    # road's last digits
    weights = xyz_weights(mixed.wavelength.values)
    tiles = np.zeros((3, *mixed.shape[1:]))
    for weight, band in zip(weights.T, mixed.values):
        if weight.any():
            tiles += weight[:, None, None] * band
    xyz = mean_over_pixels(tiles, mixed, picture)
    ledger.error(
        FLOAT32,
        "relative",
        "bound",
        "rounding of float32 radiance; bands are summed and areas integrated in float64",
    )
    xyz = np.moveaxis(xyz, 0, -1)
    return make_picture(
        xyz,
        np.zeros_like(xyz),
        np.ones(xyz.shape[:2], bool),
        picture.x.values,
        picture.y.values,
        **{
            k: picture.attrs[k]
            for k in ("focal_length_mm", "pitch_um", *camera_geometry.PLACES)
            if k in picture.attrs
        },
    )


def mean_over_pixels(
    tiles: np.ndarray, field: xr.DataArray | xr.Dataset, picture: xr.Dataset
) -> np.ndarray:
    """Return the mean (..., y, x) of constant tiles over the field of view of each pixel.

    Parameters
    ----------
    tiles : (..., y, x) on the grid of `field`.
    field : light or radiance, for coordinates and distortion.
    picture : a picture, for the grid of pixels.

    Raises
    ------
    UnitError : pixels whose field of view exceeds the field.
    """
    f_m = _focal_length_m(picture)
    pitch = _pitch_m(picture)
    try:
        if lens := _distortion(field, picture):
            pixels = camera_geometry.PixelGrid(
                picture.x.values / f_m, picture.y.values / f_m, pitch / f_m
            )
            return camera_geometry.mean_over_pixels(tiles, field, lens, pixels)
        return resample_mean(
            tiles,
            field.x.values,
            field.y.values,
            picture.x.values / f_m,
            picture.y.values / f_m,
            pitch / f_m,
            pitch / f_m,
        )
    except ValueError as err:
        raise UnitError(
            f"the picture's pixels do not fit the scene: {err}; crop the sensor or widen the"
            " camera's field"
        ) from err


def labels_on(scene: xr.Dataset, picture: xr.Dataset) -> xr.Dataset:
    """Return the scene's labels at the pixel centres of `picture`: the labels of the tile that
    contains each centre.

    Labels are names and distances, so they are looked up and never averaged. `motion` is that of
    the point at the tile's centre, in pixels of the picture. The attribute `objects` is the scene's
    table with `box` in pixels of the picture. A box is cut at the frame, and `in_frame` is the
    remaining share of its area. Objects outside the frame are dropped.

    Raises
    ------
    UnitError : a pixel centre lies beyond the scene's tiles, or the picture has another projection
        or lacks focal_length_mm or pitch_um.
    """
    f_m = _focal_length_m(picture)
    x = picture.x.values / f_m
    y = picture.y.values / f_m
    columns: Any
    rows: Any
    if lens := _distortion(scene, picture):
        columns, rows = (
            xr.DataArray(_nearest(scene, d, c), dims=("y", "x"))
            for d, c in zip("xy", lens.inverse(*np.meshgrid(x, y)))
        )
    else:
        columns = _nearest(scene, "x", x)
        rows = _nearest(scene, "y", y)
    at_pixels = [
        name
        for name in scene.data_vars
        if {"y", "x"} <= set(scene[name].dims) and "light_group" not in scene[name].dims
    ]
    # without its light, a scene without labels has no dims y and x
    labels = (
        scene[at_pixels]
        .isel(y=rows, x=columns, missing_dims="ignore")
        .assign_coords(x=picture.x.values, y=picture.y.values)
    )
    if MOTION in labels:
        field = (scene.x.values[columns], scene.y.values[rows])
        labels[MOTION] = _motion_px(labels[MOTION], *field, lens, f_m / _pitch_m(picture))
    labels.attrs = {"objects": objects_on(scene, picture), "lamps": scene.attrs.get("lamps", [])}
    return labels


def _motion_px(
    motion: xr.DataArray, x: np.ndarray, y: np.ndarray, lens: Any, pixels: float
) -> xr.DataArray:
    """Return motion in the field (y, x, uv) as motion on the sensor, pixels. It is NaN where the
    lens does not image the end of the motion.

    Parameters
    ----------
    x, y : field coordinates at which the motion starts, each (y, x); not read without a lens.
    lens : distortion map, or None.
    pixels : pixels per focal length.
    """
    if lens is None:
        return (motion * pixels).assign_attrs(motion.attrs, units="px")
    moved = x + motion.values[..., 0], y + motion.values[..., 1]
    before, after = (np.stack(camera_geometry.images_of(lens, *at), -1) for at in ((x, y), moved))
    on_sensor = motion.copy(data=((after - before) * pixels).astype(np.float32))
    return on_sensor.assign_attrs(units="px")


def objects_on(scene: xr.Dataset, picture: xr.Dataset) -> list[dict[str, Any]]:
    """Return the scene's object table with boxes [x, y, width, height] in pixels of `picture`, from
    its top left corner.

    `box` is that of the visible part and `box_full` that of the whole object, if the scene states
    it; both are cut at the frame. `truncation` is the share of the whole object's box that is cut
    off, in the field before distortion.
    """
    table = []
    lens = _distortion(scene, picture)
    for entry in scene.attrs.get("objects", []):
        left, top, width, height = entry["box"]
        (x0, x1), (y0, y1) = (
            _field(scene, dim, (start, start + size))
            for dim, start, size in (("x", left, width), ("y", top, height))
        )
        if lens:
            x0, y0, x1, y1 = camera_geometry.box_on_sensor(lens, x0, y0, x1, y1)
        (x0, x1), (y0, y1) = (
            _pixels(picture, dim, ends) for dim, ends in (("x", (x0, x1)), ("y", (y0, y1)))
        )
        cut_x = np.clip((x0, x1), 0, picture.sizes["x"])
        cut_y = np.clip((y0, y1), 0, picture.sizes["y"])
        area = (x1 - x0) * (y1 - y0)
        visible_area = np.ptp(cut_x) * np.ptp(cut_y)
        if visible_area > 0:
            box = [float(v) for v in (cut_x[0], cut_y[0], np.ptp(cut_x), np.ptp(cut_y))]
            whole = _whole_box(scene, picture, entry["box_full"]) if "box_full" in entry else {}
            table.append({**entry, "box": box, "in_frame": float(visible_area / area), **whole})
    return table


def _whole_box(
    scene: xr.Dataset, picture: xr.Dataset, box: Sequence[float]
) -> dict[str, float | list[float]]:
    """Return `box_full` in pixels, cut at the frame, and `truncation`.

    Parameters
    ----------
    box : [x, y, width, height] of the whole object in tiles of the scene.
    """
    lens = _distortion(scene, picture)
    f_m = _focal_length_m(picture)
    pitch_m = _pitch_m(picture)
    ends = []
    frame = []
    for dim, start, size in (("x", box[0], box[2]), ("y", box[1], box[3])):
        first = float(picture[dim].values[0]) - pitch_m / 2
        frame.append(np.array([first, first + picture.sizes[dim] * pitch_m]) / f_m)
        ends.append(_field(scene, dim, (start, start + size)))
    if lens:  # the directions that the frame's edges see
        edge = [np.linspace(low, high, camera_geometry.EDGE_POINTS) for low, high in frame]
        seen = lens.inverse(*np.meshgrid(*edge))
        frame = [np.array([part.min(), part.max()]) for part in seen]
    cut = [np.clip(end, *side) for end, side in zip(ends, frame, strict=True)]
    area = float(np.ptp(ends[0]) * np.ptp(ends[1]))
    share = float(np.ptp(cut[0]) * np.ptp(cut[1])) / area if area > 0 else 1.0
    (x0, x1), (y0, y1) = cut
    if lens:
        x0, y0, x1, y1 = camera_geometry.box_on_sensor(lens, x0, y0, x1, y1)
    x, y = (
        np.clip(_pixels(picture, dim, pair), 0, picture.sizes[dim])
        for dim, pair in (("x", (x0, x1)), ("y", (y0, y1)))
    )
    pixels = [float(v) for v in (x[0], y[0], np.ptp(x), np.ptp(y))]
    return {"box_full": pixels, "truncation": max(0.0, 1 - share)}


def _distortion(scene: xr.DataArray | xr.Dataset, picture: xr.Dataset) -> Any:
    """Return the map from the scene's field to the picture's sensor; None where the lens keeps the
    grid.

    Raises
    ------
    UnitError : the picture was made of a field of another projection.
    """
    if camera_geometry.projection_of(scene) != camera_geometry.projection_of(picture):
        raise UnitError(
            f"the picture's projection is {camera_geometry.projection_of(picture)!r}, the scene's "
            f"{camera_geometry.projection_of(scene)!r}; expected a picture of this scene"
        )
    lens = camera_geometry.map_of(picture)
    return None if isinstance(lens, camera_geometry.Identity) else lens


def _field(scene: xr.DataArray | xr.Dataset, dim: str, borders: npt.ArrayLike) -> np.ndarray:
    """Turn tile borders (0 = outer border of the first tile) into field coordinates."""
    return scene[dim].values[0] + (np.asarray(borders, float) - 0.5) * tile_pitch(scene, dim)


def _pixels(picture: xr.Dataset, dim: str, positions: npt.ArrayLike) -> np.ndarray:
    """Turn positions on the sensor, in focal lengths, into pixel borders of the picture."""
    return (np.asarray(positions) * _focal_length_m(picture) - picture[dim].values[0]) / _pitch_m(
        picture
    ) + 0.5


def _nearest(scene: xr.DataArray | xr.Dataset, dim: str, tangents: np.ndarray) -> np.ndarray:
    centres = scene[dim].values
    # position in tiles, from the outer border of the first tile
    index = (tangents - centres[0]) / tile_pitch(scene, dim) + 0.5
    if index.min() < -TIE or index.max() > len(centres) + TIE:
        raise UnitError(
            f"pixel centres reach the tangent {np.abs(tangents).max():.4g} along {dim}, the scene's"
            f" tiles end at {np.abs(centres).max():.4g}; crop the sensor or widen the camera's"
            " field"
        )
    # a centre on a border between two tiles belongs to the later one, despite rounding
    return np.clip(np.floor(index + TIE).astype(int), 0, len(centres) - 1)


def _focal_length_m(picture: xr.Dataset) -> float:
    if "focal_length_mm" not in picture.attrs:
        raise UnitError(
            "the picture has no attribute 'focal_length_mm', so its pixels have no field angle; the"
            " isp sets it"
        )
    return float(picture.attrs["focal_length_mm"]) * 1e-3


def _pitch_m(picture: xr.Dataset) -> float:
    if "pitch_um" not in picture.attrs:
        raise UnitError(
            "the picture has no attribute 'pitch_um'; the isp copies it from the captures"
        )
    return float(picture.attrs["pitch_um"]) * 1e-6
