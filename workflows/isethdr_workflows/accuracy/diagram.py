"""Work-precision diagrams of a stage: error against CPU seconds, on logarithmic axes, with one
panel per diagram.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.extras import needed

from .point import Work, front

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from .point import Point

COLOURS = {
    "default": "#c0392b",
    "now": "#c0392b",
    "peer": "#7f8c8d",
    "view": "#2e8b57",
    "": "#2c6fad",
}
SHAPES = {"default": "D", "now": "D", "peer": "X", "view": "^", "": "o"}
NAMES = {
    "default": "default",
    "now": "as configured",
    "peer": "rule of other simulators",
    "view": "denoised",
    "": "setting",
}
ORDER = {"": 2, "peer": 3, "view": 3, "default": 4, "now": 4}  # higher numbers are drawn on top
# width of the picture, 910 pixels: letters of 8 points are 11 pixels high when it is shown 700
# pixels wide
WIDTH_IN = 7.0
DPI = 130
TOGETHER = 18  # largest distance of dots that share one text, pixels
OWN_TEXT_PX = 6  # smallest distance of a dot from its own text, pixels
OTHER_TEXT_PX = 16  # smallest distance of a dot from the texts of other dots, pixels
PANEL_IN = 2.9  # height of a panel; a single panel is 1.3 times as high
# places of a text at its dot, tried in this order: (right, up) in points, and the alignment
PLACES = (
    (5, 4, "left", "bottom"),
    (5, -4, "left", "top"),
    (0, 7, "center", "bottom"),
    (0, -7, "center", "top"),
    (-5, 4, "right", "bottom"),
    (-5, -4, "right", "top"),
    (5, 14, "left", "bottom"),
    (5, -14, "left", "top"),
    (-5, 14, "right", "bottom"),
    (-5, -14, "right", "top"),
    (8, 24, "left", "bottom"),
    (8, -24, "left", "top"),
)


def check_library() -> None:
    """Raise ConfigError if diagrams cannot be drawn, before the work of a study."""
    with needed("a diagram", extra="report"):
        import_module("matplotlib")


def draw(works: list[Work], path: Path) -> None:
    """Write the diagrams of one stage to `path` (png), with two panels per row. Settings without
    error are drawn at the bottom, failed ones at the top. Settings with an unknown error (nan) are
    left out.
    """
    with needed("a diagram", extra="report"):
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot as plt

    columns = min(2, len(works))
    rows = -(-len(works) // columns)
    height = PANEL_IN * rows * (1.3 if columns == 1 else 1.0)
    with plt.rc_context(
        {"font.size": 8, "axes.titlesize": 9, "xtick.labelsize": 8, "ytick.labelsize": 8}
    ):
        fig, axes = plt.subplots(
            rows, columns, figsize=(WIDTH_IN, height), dpi=DPI, layout="constrained", squeeze=False
        )
        for ax in axes.flat[len(works) :]:
            ax.axis("off")
        placed = [(ax, *panel(ax, work, wide=columns == 1)) for ax, work in zip(axes.flat, works)]
        handles = {
            label: handle
            for ax in axes.flat
            for handle, label in zip(*ax.get_legend_handles_labels())
        }
        fig.legend(
            handles.values(),
            handles.keys(),
            loc="outside lower center",
            ncols=max(len(handles), 1),
            fontsize=8,
            frameon=False,
            columnspacing=1.4,
            handletextpad=0.4,
        )
        fig.canvas.draw()  # gives the axes their final positions, which the texts need
        fig.set_layout_engine("none")
        for ax, texts, dots in placed:
            if dots:
                label(fig, ax, texts, dots)
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        save(fig, path)
        plt.close(fig)


def save(fig: Figure, path: Path) -> None:
    """Write a figure with 200 colours, which halves the bytes without a visible difference."""
    from PIL import Image

    whole = BytesIO()
    fig.savefig(whole, format="png")
    Image.open(whole).convert("RGB").quantize(200).save(path, optimize=True)


def panel(ax: Axes, work: Work, wide: bool) -> tuple[list[tuple[Any, ...]], list[tuple[Any, ...]]]:
    """Draw one diagram; return the texts that are still to be placed, [(text, x, y)], and the dots,
    [(x, y)].

    Parameters
    ----------
    ax : axes of Matplotlib.
    work : settings of one stage, with their errors and CPU seconds.
    wide : whether the panel takes the whole width of the figure.
    """
    visible = sorted((p for p in work.points if p.error >= 0), key=lambda p: p.cpu_s)
    if not visible:
        ax.set(title=work.stage, xticks=[], yticks=[])
        ax.text(0.5, 0.5, "no error is known", ha="center", transform=ax.transAxes)
        return [], []
    some = [p.error for p in visible if 0 < p.error < work.fails_at] or [1e-16]
    floor = min(some) / 10
    fails = work.fails_at if math.isfinite(work.fails_at) else 10 * max(some)

    def height(point: Point) -> float:
        return min(max(point.error, floor), fails)

    best = front(visible)
    ax.plot(
        [p.cpu_s for p in best],
        [height(p) for p in best],
        "-",
        color="#b8c7d6",
        zorder=1,
        label="Pareto front",
    )
    for mark, shape in SHAPES.items():
        of = [p for p in visible if p.mark == mark]
        if of:
            ax.plot(
                [p.cpu_s for p in of],
                [height(p) for p in of],
                shape,
                color=COLOURS[mark],
                label=NAMES[mark],
                ms=5,
                zorder=ORDER[mark],
            )
    # a reference error far below all points is stated in the title only
    near = work.reference_error >= floor
    if near:
        ax.axhline(work.reference_error, ls=":", color="#555", lw=1, label="error of reference")
    if work.allowed >= 0:
        ax.axhline(work.allowed, ls="--", color="#2e8b57", lw=1, label="allowed")
    lines = textwrap.wrap(work.error_of, 60 if wide else 34)
    ax.set(xscale="log", yscale="log", xlabel="CPU seconds", ylabel="\n".join(lines))
    right = f"(error of reference {work.reference_error:.1g})" if work.reference_error > 0 else ""
    ax.set_title(
        f"{work.stage}{' ' if wide or len(work.stage + right) < 44 else chr(10)}{right}".strip()
    )
    limits(
        ax,
        [p.cpu_s for p in visible],
        [height(p) for p in visible]
        + ([work.reference_error] if near else [])
        + ([work.allowed] if work.allowed >= 0 else []),
    )
    ax.grid(True, which="major", color="#eee")
    texts = [
        (p.label or p.setting)
        + (" (fails)" if p.error >= fails else f" ({work.no_error})" if p.error == 0 else "")
        for p in visible
    ]
    dots = [(p.cpu_s, height(p)) for p in visible]
    return list(zip(texts, *zip(*dots))), dots


def limits(ax: Axes, x: Sequence[float], y: Sequence[float]) -> None:
    """Set the limits of the axes: all points with room for their texts, and at least a decade along
    x. Numbers are drawn at more ticks where there is room.

    Parameters
    ----------
    ax : axes of Matplotlib, both logarithmic.
    x, y : values of all points along both axes, above 0.
    """
    with needed("a diagram", extra="report"):
        from matplotlib.ticker import FuncFormatter, LogLocator

    for values, axis, turn, room, least in (
        (x, ax.xaxis, ax.set_xlim, 0.5, 0.5),
        (y, ax.yaxis, ax.set_ylim, 0.15, 1.0),
    ):
        low = np.log10(min(values))
        high = np.log10(max(values))
        middle = (low + high) / 2
        half = max(high - low, least) / 2
        low = middle - half * (1 + 2 * room)
        high = middle + half * (1 + 2 * room)
        turn(10**low, 10**high)
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high - low < 2 else (1,)))
        axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        axis.set_minor_formatter(FuncFormatter(lambda v, _: ""))


def label(
    fig: Figure,
    ax: Axes,
    texts: Sequence[tuple[str, float, float]],
    dots: Sequence[tuple[float, float]],
) -> None:
    """Write a text next to each dot, if possible where it covers neither a dot nor another text.
    Dots close together share one text.

    Parameters
    ----------
    fig : figure of Matplotlib.
    ax : axes of the dots.
    texts : [(text, x, y)] of the dots.
    dots : [(x, y)] in data coordinates.
    """
    render = fig.canvas.get_renderer()
    pixels = ax.transData.transform(dots)
    written: list[ArrayLike] = []
    frame = ax.get_window_extent(render).extents
    for members in together(pixels):
        text = "\n".join(dict.fromkeys(texts[m][0] for m in members))
        x, y = dots[members[-1]]
        # a text close to another dot would seem to be that dot's
        occupied = [
            (px - clear, py - clear, px + clear, py + clear)
            for k, (px, py) in enumerate(pixels)
            for clear in (OWN_TEXT_PX if k in members else OTHER_TEXT_PX,)
        ]
        occupied += written
        tried = []
        for dx, dy, side, edge in PLACES:
            note = ax.annotate(
                text,
                (x, y),
                xytext=(dx, dy),
                textcoords="offset points",
                fontsize=7.5,
                ha=side,
                va=edge,
            )
            box = note.get_window_extent(render).extents
            tried.append(
                (
                    sum(overlap(box, other) for other in occupied) + 10 * outside(box, frame),
                    len(tried),
                    note,
                    box,
                )
            )
            if tried[-1][0] == 0:
                break
        best = min(tried, key=lambda t: t[:2])
        for other in tried:
            if other is not best:
                other[2].remove()
        written.append(best[3])


def together(pixels: np.ndarray) -> list[list[int]]:
    """Return groups of dots, from left to right, each at most `TOGETHER` pixels from the one before
    it in its group.
    """
    groups: list[list[int]] = []
    for k in np.argsort(pixels[:, 0], kind="stable"):
        near = next((g for g in groups if np.hypot(*(pixels[k] - pixels[g[-1]])) <= TOGETHER), None)
        if near is None:
            groups.append([int(k)])
        else:
            near.append(int(k))
    return groups


def overlap(first: ArrayLike, second: ArrayLike) -> float:
    """Return the area that two boxes (left, bottom, right, top) share, pixels."""
    return max(0.0, min(first[2], second[2]) - max(first[0], second[0])) * max(
        0.0, min(first[3], second[3]) - max(first[1], second[1])
    )


def outside(box: ArrayLike, frame: ArrayLike) -> float:
    """Return the area of a box beyond a frame, pixels."""
    return (box[2] - box[0]) * (box[3] - box[1]) - overlap(box, frame)
