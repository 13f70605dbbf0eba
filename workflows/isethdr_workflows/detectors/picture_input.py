"""From a picture of a run to the array that a network reads, and from boxes in the array back to
the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from isethdr_catalog.report.pictures import compression, shown_white_cd_m2
from PIL import Image

from isethdr_core.display import display_view
from isethdr_core.physics.colour.colour_spaces import linear_srgb

from .description import InputForm

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class View:
    """The white and the tone curve with which a detector sees the pictures of all cameras of a
    run.
    """

    white_cd_m2: float
    compression: float

    @classmethod
    def of(cls, reference: xr.Dataset) -> View:
        """Return the view of a run, as used by `isethdr export --to png`, except that flare in the
        pictures does not raise the white. So the view is the same for all lenses and flares.

        Parameters
        ----------
        reference : the reference picture with the most pixels.
        """
        white = shown_white_cd_m2(reference)
        return cls(white, compression(reference, white))


def displayed(picture: xr.Dataset, view: View, tone: str) -> np.ndarray:
    """Return a picture as R, G, B (y, x, 3), float32, 0 (black) to 1 (white).

    Parameters
    ----------
    picture : Dataset with `xyz` in cd/m2 and `valid`.
    view : white and tone curve.
    tone : `png`, `srgb` or `linear`, as in `InputForm`.
    """
    if tone == "linear":
        rgb = linear_srgb(picture["xyz"].values / view.white_cd_m2)
        rgb[~picture["valid"].values] = 1.0
        return np.clip(rgb, 0.0, 1.0).astype(np.float32)
    curve = view.compression if tone == "png" else 0.0
    code = display_view.display(picture, view.white_cd_m2, curve, natural_colour=True)
    return (code / 255).astype(np.float32)


@dataclass(frozen=True)
class Fit:
    """Position and scale of a picture within a network's input.

    Parameters
    ----------
    size_px : width and height of the input.
    scale : (x, y) pixels of the input per pixel of the picture.
    offset_px : (x, y) position of the picture's top left corner in the input.
    """

    size_px: tuple[int, int]
    scale: tuple[float, float]
    offset_px: tuple[int, int]

    def back(self, boxes: np.ndarray) -> np.ndarray:
        """Return boxes (n, 4) in pixels of the picture, from corners in pixels of the input."""
        offset = np.tile(self.offset_px, 2)
        return (boxes - offset) / np.tile(self.scale, 2)


def fit_of(width: int, height: int, form: InputForm) -> Fit:
    """Return the position and scale of a picture within the input of a network.

    Parameters
    ----------
    width, height : size of the picture, pixels.
    form : form of the picture that the network reads.
    """
    if form.size_px is None:
        up = form.multiple_px
        return Fit((-(-width // up) * up, -(-height // up) * up), (1.0, 1.0), (0, 0))
    if form.fit == "stretch":
        return Fit(form.size_px, (form.size_px[0] / width, form.size_px[1] / height), (0, 0))
    scale = min(form.size_px[0] / width, form.size_px[1] / height)
    shown = _scaled(width, height, (scale, scale))
    room = (form.size_px[0] - shown[0], form.size_px[1] - shown[1])
    offset = (room[0] // 2, room[1] // 2) if form.place == "centre" else (0, 0)
    # the true scale of each axis, because the scaled picture has whole pixels
    return Fit(form.size_px, (shown[0] / width, shown[1] / height), offset)


def _scaled(width: int, height: int, scale: tuple[float, float]) -> tuple[int, int]:
    return max(1, round(width * scale[0])), max(1, round(height * scale[1]))


def network_input(rgb: np.ndarray, fit: Fit, form: InputForm) -> np.ndarray:
    """Return the array (1, 3, y, x) or (1, y, x, 3), float32, of a displayed picture.

    If the picture shrinks, Pillow's bilinear filter averages over the width of the new pixels, so
    that no pixel is skipped.

    Parameters
    ----------
    rgb : (y, x, 3) displayed picture, 0 to 1.
    fit : position and scale of the picture in the input.
    form : order of axes and channels, scaling.
    """
    height, width = rgb.shape[:2]
    shown = _scaled(width, height, fit.scale)
    if shown != (width, height):
        planes = [
            Image.fromarray(plane).resize(shown, Image.Resampling.BILINEAR)
            for plane in np.moveaxis(np.asarray(rgb, np.float32), -1, 0)
        ]
        rgb = np.stack([np.asarray(plane) for plane in planes], -1)
    canvas = np.full((fit.size_px[1], fit.size_px[0], 3), form.fill, np.float32)
    left, top = fit.offset_px
    canvas[top : top + shown[1], left : left + shown[0]] = rgb
    if form.channels == "bgr":
        canvas = canvas[..., ::-1]
    scaled = (canvas * form.full_scale - np.array(form.mean)) / np.array(form.std)
    ordered = np.moveaxis(scaled, -1, 0) if form.layout == "nchw" else scaled
    return np.ascontiguousarray(ordered[None], np.float32)
