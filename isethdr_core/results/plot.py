"""Plots of a run: pictures the right way up, over the image plane in mm, or luminance in cd/m2."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display import display_view
from ..errors import ConfigError, did_you_mean
from ..extras import needed

if TYPE_CHECKING:
    import xarray as xr

    from ..runs.run import Result

PICTURE = "picture"
LUMINANCE = "luminance"
LEAST_SHARE = 1e-6  # lower end of the scale, as a share of the largest luminance


def plotted(result: Result, of: str = PICTURE) -> Any:
    """Return a Matplotlib figure with one panel for each camera.

    Parameters
    ----------
    of : `picture`, the display view, or `luminance`, cd/m2 on a logarithmic scale.

    Raises
    ------
    ConfigError : `of` is neither.
    """
    if of not in (PICTURE, LUMINANCE):
        raise ConfigError(f"of is {of!r}{did_you_mean(of, (PICTURE, LUMINANCE))}")
    with needed("a plot", extra="report"):
        from matplotlib.figure import Figure

    class Drawing(Figure):
        """A figure that a notebook shows without a backend of its own."""

        def _repr_png_(self) -> bytes:
            buffer = io.BytesIO()
            self.savefig(buffer, format="png")
            return buffer.getvalue()

    cameras = result.cameras
    figure = Drawing(figsize=(6.0 * len(cameras), 4.2), layout="constrained")
    panels = figure.subplots(1, len(cameras), squeeze=False)[0]
    for panel, camera in zip(panels, cameras, strict=True):
        picture = result.open(f"picture/{camera}")
        truth = result.open(f"truth/{camera}")
        if of == PICTURE:
            view = display_view.display(picture, display_view.white_cd_m2(truth))
            panel.imshow(view, extent=extent_mm(picture))
        else:
            y = display_view.luminance(picture)
            top = float(display_view.luminance(truth).max()) or 1.0
            shown = panel.imshow(
                np.maximum(y, top * LEAST_SHARE), extent=extent_mm(picture), norm="log"
            )
            figure.colorbar(shown, ax=panel, label="luminance, cd/m²")
        panel.set(title=camera, xlabel="x on the image plane, mm", ylabel="y (down), mm")
    return figure


def extent_mm(picture: xr.Dataset) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top edge of a picture on the image plane, mm; y points down,
    so that the bottom is the larger one.
    """
    left, right = _edges_mm(picture.x.values)
    top, bottom = _edges_mm(picture.y.values)
    return left, right, bottom, top


def _edges_mm(centres_m: np.ndarray[Any, Any]) -> tuple[float, float]:
    half = (centres_m[-1] - centres_m[0]) / max(len(centres_m) - 1, 1) / 2
    return float(1e3 * (centres_m[0] - half)), float(1e3 * (centres_m[-1] + half))
