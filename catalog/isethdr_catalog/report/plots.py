"""Plots of the report, as embedded vector graphics: line profile, signal-to-noise ratio, seconds
by stage.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from isethdr_core.extras import needed
from isethdr_core.physics.resampling.blocks import alike, block_means, block_of
from isethdr_core.truth import before_denoising, total_variance

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from isethdr_core.uncertainty.ledger import Ledger

# replaced by the text colour of the page, so that a plot is legible on a light and on a dark page
TEXT = "#010203"
TRUTH = TEXT
# colours of curves; each has a contrast of 3 or more to white and to near black
CYCLE = ("#d1495b", "#2a84c6", "#3b9a54", "#b8860b", "#8b6fc0")


# size of a plot, inches; a page 390 px wide shows it at nine tenths, so letters stay readable
WIDTH = 5.4
HEIGHT = 3.1


def _svg(draw: Callable[..., Any], width: float = WIDTH, height: float = HEIGHT) -> Markup:
    with needed("a plot of the report", extra="report"):
        import matplotlib

        matplotlib.use("Agg", force=False)
        from matplotlib import pyplot as plt

    with plt.rc_context(
        {
            "svg.fonttype": "none",
            "svg.hashsalt": "isethdr",
            "font.size": 9,
            "font.family": "sans-serif",
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "grid.alpha": 0.25,
            **dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor"), TEXT),
            **dict.fromkeys(("xtick.color", "ytick.color", "grid.color"), TEXT),
        }
    ):
        fig, ax = plt.subplots(figsize=(width, height), layout="constrained")
        draw(ax)
        buffer = io.StringIO()
        fig.savefig(
            buffer, format="svg", transparent=True, metadata={"Date": None, "Creator": None}
        )
        plt.close(fig)
    drawing = buffer.getvalue()
    drawing = drawing[drawing.index("<svg") :].replace(TEXT, "currentColor")
    return Markup(drawing)  # matplotlib escapes its texts


def legible(name: str) -> str:
    """Return a name escaped so that matplotlib shows it unchanged.

    A legend hides names that begin with an underscore, and two `$` would enclose a formula.
    """
    return (" " if name.startswith("_") else "") + name.replace("$", r"\$")


def line_profile(profiles: dict[str, tuple[np.ndarray, np.ndarray]], floor: float) -> Markup:
    """Return the plot of log luminance along a row.

    Parameters
    ----------
    profiles : {name: (field angle in degrees, luminance in cd/m2)}; `truth` is drawn last, in the
        colour of text.
    floor : least luminance drawn, cd/m2; lower estimates, also negative ones, are drawn at it.
    """

    def draw(ax: Axes) -> None:
        for i, (name, (x, y)) in enumerate((k, v) for k, v in profiles.items() if k != "truth"):
            ax.semilogy(
                x,
                np.maximum(y, floor),
                lw=0.8,
                color=CYCLE[i % len(CYCLE)],
                label=legible(name),
                alpha=0.85,
            )
        if "truth" in profiles:
            x, y = profiles["truth"]
            ax.semilogy(
                x,
                np.maximum(y, floor),
                lw=1.3,
                color=TRUTH,
                label="reference",
            )
        ax.set_xlabel("field angle, degrees (right positive)")
        ax.set_ylabel("luminance, cd/m²")
        _legend(ax)

    return _svg(draw)


def snr_against_luminance(curves: dict[str, tuple[np.ndarray, np.ndarray]]) -> Markup:
    """Return the plot of signal-to-noise ratio against luminance; `curves` is {camera: (luminance
    in cd/m2, ratio in dB)}.
    """

    def draw(ax: Axes) -> None:
        for i, (name, (luminance, snr)) in enumerate(curves.items()):
            ax.semilogx(
                luminance, snr, ".-", ms=3, lw=1.0, color=CYCLE[i % len(CYCLE)], label=legible(name)
            )
        ax.axhline(0, color="#888", lw=0.8)
        ax.set_xlabel("luminance, cd/m²")
        ax.set_ylabel("SNR, dB")
        _legend(ax)

    return _svg(draw)


def _legend(ax: Axes) -> None:
    """Write the legend above the axes, where it hides no line."""
    ax.legend(
        frameon=False,
        fontsize=8,
        ncols=4,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.2,
        columnspacing=1.2,
    )


def seconds(rows: Ledger) -> Markup:
    """Return the plot of seconds per stage: bars, longest first; beyond nine stages one bar holds
    the sum of the others.
    """

    def draw(ax: Axes) -> None:
        ranked = sorted(rows, key=lambda r: -r.seconds)
        longest = ranked[:9]
        others = ranked[9:]
        names = [legible(r.stage) for r in longest] + ([f"{len(others)} more"] if others else [])
        values = [r.seconds for r in longest] + ([sum(r.seconds for r in others)] if others else [])
        ax.barh(names[::-1], values[::-1], color=CYCLE[1])
        ax.set_xlabel("seconds")
        ax.grid(axis="y", visible=False)

    return _svg(draw, height=2.6)


def snr_curve(
    picture: xr.Dataset, truth: xr.Dataset, bins_per_decade: int = 6, least: int = 20
) -> tuple[np.ndarray, np.ndarray]:
    """Return luminance, cd/m2, and signal-to-noise ratio, dB, of the median pixel of each bin.

    The ratio is true luminance over the standard deviation that the picture states. Luminance and
    variance are means over cells of the colour filter array, as in the metric `snr_curve`, so that
    all filters count equally. Bins are of true luminance: with bins of the noisy estimate, dark
    bins would hold mostly noise.

    Parameters
    ----------
    picture : picture with its variance, (y, x, xyz_channel).
    truth : reference picture on the same grid.
    bins_per_decade : bins per decade of luminance.
    least : smallest number of pixels in a bin; other bins are left out.
    """
    stated_variance = total_variance(before_denoising(picture))
    valid = picture["valid"].values
    true = truth["xyz"].values[..., 1]
    block = block_of(picture.attrs.get("cfa"))
    y = block_means(true, valid, block)
    variance = block_means(stated_variance.values[..., 1], valid, block)
    usable = valid & (y > 0) & (variance > 0) & alike(true, y)
    y = y[usable]
    variance = variance[usable]
    if not y.size:
        return np.zeros(0), np.zeros(0)
    index = np.floor(np.log10(y) * bins_per_decade).astype(int)
    groups = [index == i for i in np.unique(index) if (index == i).sum() >= least]
    return (
        np.array([np.median(y[k]) for k in groups]),
        np.array(
            [20 * np.log10(np.median(y[k]) / np.sqrt(np.median(variance[k]))) for k in groups]
        ),
    )
