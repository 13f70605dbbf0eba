"""A plot of equal intensities of a lamp, with the places of its rules."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.extras import needed
from isethdr_core.scene import IntensityTable

from .rules import Finding

LEVELS_CD = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5)
LOWEST = 0.002  # least intensity of a line / largest intensity of the lamp
# fewest lines of LEVELS_CD; a flatter beam gets evenly spaced levels
FEWEST_LINES = 3
EVEN_LINES = 8
EDGE = 0.1  # intensity at the edge of a picture without rules / largest intensity
NARROWEST_DEG = np.array([10.0, 5.0])  # smallest half width and half height of a picture
FORMATS = (".png", ".jpg", ".pdf", ".svg")


def checked_path(out: str) -> Path:
    """Return the path of a picture that is to be written.

    Raises
    ------
    ConfigError : the name ends in no known format of pictures.
    """
    path = Path(out)
    if path.suffix.lower() not in FORMATS:
        raise ConfigError(
            f"--plot is {out!r}; expected a name that ends in {', '.join(FORMATS[:-1])} or"
            f" {FORMATS[-1]}; type for example --plot beam.png"
        )
    return path


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
    findings : rules; the colour of a rule's places shows whether it is met. Without rules the
        picture shows the whole beam.

    Raises
    ------
    CatalogError : the picture cannot be written.
    """
    with needed("a plot of equal intensities", extra="report"):
        figures = import_module("matplotlib.figure")
    wide, high = _half_size_deg(table, findings)
    left = np.linspace(-wide, wide, 401)
    up = np.linspace(-high, high, 301)[:, None]
    candela = intensity_cd * table.at(left, up)
    figure = figures.Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots()
    levels = _levels_cd(candela)
    if len(levels):
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
    if findings:
        axes.plot([], [], color="tab:blue", label="rule is met")
        axes.plot([], [], color="tab:red", label="rule is broken")
        axes.legend(loc="upper right", fontsize=7)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=120)
    except OSError as error:
        raise CatalogError(
            f"{path} cannot be written ({error.strerror}); type for example --plot beam.png"
        ) from None


def _half_size_deg(table: IntensityTable, findings: list[Finding]) -> np.ndarray:
    """Return half the width and half the height of the picture, degrees.

    The picture holds the places of all rules. Without rules it holds all directions with more than
    `EDGE` of the largest intensity.
    """
    places = [p for finding in findings for p in finding.rule.places]
    if not places:
        row, column = np.nonzero(table.value >= EDGE * np.max(table.value))
        places = list(zip(np.asarray(table.left_deg)[column], np.asarray(table.up_deg)[row]))
    return np.clip(1.2 * np.abs(places).max(0), NARROWEST_DEG, 90.0)


def _levels_cd(candela: np.ndarray) -> list[float]:
    """Return the levels of the lines: round ones, or evenly spaced ones for a flat beam."""
    low = max(float(candela.min()), LOWEST * float(candela.max()))
    high = float(candela.max())
    levels = [v for v in LEVELS_CD if low < v < high]
    if len(levels) >= FEWEST_LINES:
        return levels
    even = import_module("matplotlib.ticker").MaxNLocator(EVEN_LINES).tick_values(low, high)
    return [float(v) for v in even if low < v < high]
