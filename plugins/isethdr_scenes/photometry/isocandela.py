"""A plot of equal intensities of a lamp, with the places of its rules."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np

from isethdr_core.extras import needed
from isethdr_core.scene import IntensityTable

from .rules import Finding

LEVELS_CD = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5)
LOWEST = 0.002  # least intensity of a line / largest intensity of the lamp


def plot(
    path: Path, title: str, table: IntensityTable, intensity_cd: float, findings: list[Finding]
) -> None:
    """Write a picture of the beam as the driver sees it on a wall, with left on the left.

    Parameters
    ----------
    path : file of the picture.
    title : heading of the picture.
    table : pattern relative to `intensity_cd`.
    intensity_cd : candela where the table is 1.
    findings : rules; the colour of a rule's places shows whether it is met.
    """
    with needed("a plot of equal intensities", extra="report"):
        figures = import_module("matplotlib.figure")
    places = np.array([p for f in findings for p in f.rule.places] or [(0.0, 0.0)])
    wide, high = np.maximum(1.2 * np.abs(places).max(0), (10.0, 5.0))
    left = np.linspace(-wide, wide, 401)
    up = np.linspace(-high, high, 301)[:, None]
    candela = intensity_cd * table.at(left, up)
    figure = figures.Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots()
    levels = [v for v in LEVELS_CD if LOWEST * candela.max() <= v < candela.max()]
    lines = axes.contour(left, up[:, 0], candela, levels=levels, cmap="viridis", linewidths=1)
    axes.clabel(lines, fmt="%g cd", fontsize=7)
    for finding in findings:
        x, y = np.array(finding.rule.places).T
        colour = "tab:blue" if finding.is_met else "tab:red"
        if finding.rule.kind == "box":
            x = x[[0, 1, 1, 0, 0]]
            y = y[[0, 0, 1, 1, 0]]
        if finding.rule.kind in ("box", "polygon"):
            axes.plot(np.r_[x, x[0]], np.r_[y, y[0]], color=colour, lw=0.8, ls="--")
        elif finding.rule.kind in ("point", "sum"):
            axes.plot(x, y, "+", color=colour, ms=6)
    axes.set(xlim=(wide, -wide), ylim=(-high, high), title=title)
    axes.set(xlabel="degrees to the left", ylabel="degrees up")
    axes.axhline(0, color="0.8", lw=0.5, zorder=0)
    axes.axvline(0, color="0.8", lw=0.5, zorder=0)
    figure.savefig(path, dpi=120)
