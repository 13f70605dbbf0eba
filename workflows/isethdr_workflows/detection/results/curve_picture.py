"""Picture of the curves of a study against the level of light, with one panel for each camera."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from isethdr_core.extras import needed

from .levels import LOST, LOST_APART
from .study_results import CurvePoint, Results

COLUMNS = 4
PANEL_IN = (2.4, 1.75)  # width and height of a panel, inches
DPI = 110
TEXT_PT = 8
FOUND = "#2c6fad"
APART = "#c0392b"


def draw_curves(results: Results, path: Path) -> None:
    """Write curves of the share of objects found and of the pairs told apart, each with its 95 %
    interval, to `path` (png).

    Parameters
    ----------
    results : results of a question with levels of light.
    path : file of the picture.
    """
    with needed("a picture of curves", extra="report"):
        figures = import_module("matplotlib.figure")  # draws without a screen
    columns = min(COLUMNS, len(results.cameras))
    rows = -(-len(results.cameras) // columns)
    figure = figures.Figure(
        figsize=(PANEL_IN[0] * columns, PANEL_IN[1] * rows + 0.5), dpi=DPI, layout="constrained"
    )
    every = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes in every.flat[len(results.cameras) :]:
        axes.axis("off")
    for axes, camera in zip(every.flat, results.cameras):
        panel(axes, results, camera)
    handles = every[0, 0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper center", ncols=2, frameon=False)
    on_object = results.asked.unit == "object_lux"
    figure.supxlabel(f"lux on the {'object' if on_object else 'sensor'}", fontsize=TEXT_PT)
    figure.savefig(path)


def panel(axes: Any, results: Results, camera: str) -> None:
    """Draw both curves of one camera.

    Parameters
    ----------
    axes : axes of Matplotlib.
    results : results of the study.
    camera : name of the camera.
    """
    _curve(axes, results.counted_curve, camera, ("pairs told apart", APART))
    _curve(axes, results.curve, camera, ("found", FOUND))
    axes.axhline(LOST_APART, ls=":", color=APART, lw=0.8)
    axes.axhline(LOST, ls=":", color=FOUND, lw=0.8)
    axes.set(xscale="log", ylim=(0, 1))
    axes.set_title(camera, fontsize=TEXT_PT)
    axes.tick_params(labelsize=TEXT_PT)
    axes.grid(True, color="#eee")


def _curve(axes: Any, points: tuple[CurvePoint, ...], camera: str, style: tuple[str, str]) -> None:
    own = [one for one in points if one.camera == camera]
    name, colour = style
    levels = [one.level for one in own]
    axes.plot(levels, [one.found for one in own], color=colour, lw=1.5, label=name)
    low = [one.low for one in own]
    high = [one.high for one in own]
    axes.fill_between(levels, low, high, color=colour, alpha=0.18, lw=0)
