"""Picture of the recall of detectors against the share that the observer finds."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numpy as np

from isethdr_core.extras import needed

from ...dataset.study.files import colour_of
from ...dataset.study.intervals import Mean, mean_over_roads
from .recall import SoughtObject
from .shares import few_roads

BINS = 4  # bins of a camera, with equally many objects
PANEL_IN = (3.6, 3.6)  # width and height of a panel, inches
DPI = 110
TEXT_PT = 8


class Bin(NamedTuple):
    """Objects that the observer finds about equally well.

    Parameters
    ----------
    objects : number of objects.
    observer, detector : shares of these objects that each finds.
    """

    objects: int
    observer: Mean
    detector: Mean


def bins_of(members: Sequence[SoughtObject], count: int = BINS) -> list[Bin]:
    """Return the objects of one detector and camera in bins of increasing d', with equally many
    objects up to one.

    Parameters
    ----------
    members : objects that detector and observer have in common.
    count : number of bins; fewer if there are fewer objects.
    """
    in_order = sorted(members, key=lambda one: one.own.d)
    parts = np.array_split(np.arange(len(in_order)), min(count, len(in_order)) or 1)
    bins = []
    for part in parts:
        own = [in_order[k] for k in part]
        if not own:
            continue
        roads = [one.own.road for one in own]
        observer = mean_over_roads([one.own.found for one in own], roads, (0.0, 1.0))
        detector = mean_over_roads([one.found for one in own], roads, (0.0, 1.0))
        bins.append(Bin(len(own), few_roads(observer), few_roads(detector)))
    return bins


def draw_recalls(members: Sequence[SoughtObject], path: Path) -> None:
    """Write a picture of the recall of each detector, with its 95 % interval, against the share
    that the observer finds, to `path` (png). Each detector has a panel and each camera a colour.

    Parameters
    ----------
    members : objects that detectors and observer have in common; at least one.
    path : file of the picture.
    """
    with needed("a picture of recall", extra="report"):
        figures = import_module("matplotlib.figure")  # draws without a screen
    detectors = list(dict.fromkeys(one.detector for one in members))
    cameras = list(dict.fromkeys(one.camera for one in members))
    figure = figures.Figure(
        figsize=(PANEL_IN[0] * len(detectors), PANEL_IN[1]), dpi=DPI, layout="constrained"
    )
    panels = figure.subplots(1, len(detectors), sharey=True, squeeze=False)[0]
    for axes, detector in zip(panels, detectors, strict=True):
        axes.plot((0, 1), (0, 1), ls=":", color="#888", lw=0.8, label="alike")
        for k, camera in enumerate(cameras):
            own = [m for m in members if (m.detector, m.camera) == (detector, camera)]
            bins = bins_of(own)
            found = [one.observer.value for one in bins]
            recall = [one.detector.value for one in bins]
            below = [one.detector.value - one.detector.low for one in bins]
            above = [one.detector.high - one.detector.value for one in bins]
            axes.errorbar(
                found,
                recall,
                np.maximum([below, above], 0.0),  # rounding may leave -1e-17
                color=colour_of(k),
                marker="o",
                ms=4,
                capsize=2,
                label=camera,
            )
        axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03))
        axes.set_title(f"detector {detector}", fontsize=TEXT_PT)
        axes.set_xlabel("share found by the observer", fontsize=TEXT_PT)
        axes.tick_params(labelsize=TEXT_PT)
        axes.grid(True, color="#eee")
    panels[0].set_ylabel("recall of the detector", fontsize=TEXT_PT)
    panels[0].legend(fontsize=TEXT_PT, frameon=False, loc="upper left")
    figure.savefig(path)
