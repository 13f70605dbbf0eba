"""The work-precision diagram of one stage: error against CPU seconds, both logarithmic."""

from __future__ import annotations

import textwrap
from pathlib import Path

from .point import Work, front

COLOURS = {"default": "#c0392b", "peer": "#7f8c8d", "": "#2c6fad"}
SHAPES = {"default": "D", "peer": "X", "": "o"}
FAILS = 100.0  # an error of so much is drawn there, whatever it is
NAMES = {"default": "default", "peer": "rule of other simulators", "": "setting"}


def draw(work: Work, path) -> None:
    """Write the diagram of `work` to `path` (png); exact settings sit at the bottom, failed ones at the top."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    shown = [p for p in work.points if p.error >= 0]
    some = [p.error for p in shown if 0 < p.error < FAILS] or [1e-16]
    floor = min(some) / 10

    def height(point):
        return min(max(point.error, floor), FAILS)

    fig, ax = plt.subplots(figsize=(8.5, 5), layout="constrained")
    best = front(shown)
    ax.plot([p.cpu_s for p in best], [height(p) for p in best], "-", color="#b8c7d6", zorder=1, label="front")
    for mark, shape in SHAPES.items():
        of = [p for p in shown if p.mark == mark]
        if of:
            ax.plot([p.cpu_s for p in of], [height(p) for p in of], shape, color=COLOURS[mark], label=NAMES[mark], ms=6)
    for k, p in enumerate(sorted(shown, key=lambda p: p.cpu_s)):
        text = p.setting + (" (fails)" if p.error >= FAILS else " (exact)" if p.error == 0 else "")
        ax.annotate(text, (p.cpu_s, height(p)), xytext=(5, 5 if k % 2 else -11), textcoords="offset points", fontsize=7.5)
    if work.reference_error > floor / 10:
        ax.axhline(work.reference_error, ls=":", color="#555", lw=1, label="error of the reference")
    ax.set(xscale="log", yscale="log", xlabel="CPU seconds", ylabel="\n".join(textwrap.wrap(work.error_of, 48)), title=f"{work.stage}: error against run time")
    ax.margins(x=0.2, y=0.12)
    ax.grid(True, which="major", color="#eee")
    ax.legend(fontsize=8, loc="best")
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    fig.savefig(path, dpi=110)
    plt.close(fig)
