"""The page of a dataset: contact sheets by day and night, counts, histograms, time and bytes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from isethdr_catalog.report import pictures

from isethdr_core.cli.progress import track
from isethdr_core.cli.terminal import duration
from isethdr_core.display import display_view
from isethdr_core.storage.atomic_write import write_text

from ..html_template import html_template
from .generate import Generated
from .record import SceneRecord, folder_of
from .runtime_estimate import runtime_estimate
from .summary import (
    DECADES,
    DISTANCES_M,
    HEIGHTS,
    LUX,
    Look,
    bounds,
    class_counts,
    duplicates,
    look,
    outliers,
)

PAGE = "index.html"
TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class Thumbnail:
    """One scene on a contact sheet."""

    number: int
    caption: str
    own: str  # data URL of the picture under the scene's own lighting
    day: str  # data URL of the picture by day; "" if there is none


def write_page(dataset: Generated) -> Path:
    """Write the page of a dataset into its folder, and return its path."""
    looks = [look(record, shown) for record in track(dataset.made, "scenes")]
    path = folder_of(dataset.definition.name) / PAGE
    write_text(path, page(dataset, looks))
    return path


def shown(xyz: Any) -> np.ndarray:
    """Return the picture, uint8 (y, x, 3), that the report of a run shows for xyz (y, x, 3) in
    cd/m2.
    """
    white = pictures.shown_white_cd_m2(xyz)
    compressed = pictures.compression(xyz, white)
    return display_view.display(xyz, white, compressed, natural_colour=True)


def page(dataset: Generated, looks: Sequence[Look]) -> str:
    """Return the page as one HTML document that needs no network.

    Parameters
    ----------
    dataset : definition and records of the dataset.
    looks : looks of the scenes that are made.
    """
    return html_template(TEMPLATES, "dataset.html").render(
        definition=dataset.definition,
        recipe=dataset.definition.recipe,
        made=len(dataset.made),
        failed=[(r.number + 1, r.error.splitlines()[0]) for r in dataset.failed],
        families=Counter(record.family for record in dataset.made).most_common(),
        totals=_totals(dataset),
        thumbnails=[_thumbnail(look) for look in looks],
        distances=bounds(DISTANCES_M, "m"),
        heights=bounds(HEIGHTS, "px"),
        lux=bounds(LUX, "lx"),
        classes=class_counts(dataset.made, {look.record.number: look.weights for look in looks}),
        histograms=_histograms(looks),
        duplicates=duplicates(dataset.made),
        outliers=outliers(looks),
    )


def _totals(dataset: Generated) -> list[tuple[str, str]]:
    """Return lines (title, text) about time, size and noise of the scenes, and about the expected
    time of all scenes.
    """
    seconds = [record.seconds for record in dataset.made]
    machine_s = sum(record.machine_s for record in dataset.made)
    size = [record.stored_bytes / 1e6 for record in dataset.made]
    if not seconds:
        return []
    totals = [
        ("time of a scene", f"{np.median(seconds):.3g} s (median), {max(seconds):.3g} s (longest)"),
        ("size of a scene", f"{np.median(size):.3g} MB (median), {max(size):.3g} MB (largest)"),
        ("noise of a light group", _noise(dataset.made)),
        ("all scenes so far", f"{duration(machine_s)}, {_size_text(sum(size))}"),
    ]
    expected = runtime_estimate(dataset.made, dataset.definition.count)
    if expected is not None and len(dataset.made) < dataset.definition.count:
        low = expected.seconds.low
        high = expected.seconds.high
        whole = f"{duration(expected.seconds.value)} ({duration(low)} to {duration(high)})"
        totals.append((f"all {dataset.definition.count} scenes, expected", whole))
    return totals


def _size_text(size_mb: float) -> str:
    """Return a size as text, in MB below 1 GB, else in GB."""
    return f"{size_mb:.3g} MB" if size_mb < 1e3 else f"{size_mb / 1e3:.3g} GB"


def _noise(records: Sequence[SceneRecord]) -> str:
    groups = sorted({group for record in records for group in record.noise})
    medians = {
        group: np.median([record.noise[group] for record in records if group in record.noise])
        for group in groups
    }
    return ", ".join(f"{group} {100 * value:.2g} %" for group, value in medians.items())


def _thumbnail(look: Look) -> Thumbnail:
    record = look.record
    return Thumbnail(
        record.number,
        f"{record.number + 1} {record.family}, {_luminance(look.mean_cd_m2)} cd/m²",
        pictures.embedded_small(look.own),
        "" if look.day is None else pictures.embedded_small(look.day),
    )


def _luminance(cd_m2: float) -> str:
    """Return a luminance as text with two significant digits, or whole from 10 on."""
    return f"{cd_m2:.0f}" if cd_m2 >= 10 else f"{cd_m2:.2g}"


def _histograms(looks: Sequence[Look]) -> list[tuple[str, list[tuple[str, float]]]]:
    """Return for each light group [(lower end of a decade, percent of the lit tiles in it)]."""
    groups = list(dict.fromkeys(group for look in looks for group in look.histograms))
    counts = {
        group: np.sum([look.histograms.get(group, 0 * DECADES[1:]) for look in looks], axis=0)
        for group in groups
    }
    if not counts:
        return []
    used = np.flatnonzero(np.sum(list(counts.values()), axis=0))
    first, last = (used[0], used[-1] + 1) if used.size else (0, 1)
    rows = []
    for group, count in counts.items():
        share = 100 * count / max(count.sum(), 1)
        row = zip(DECADES[first:last], share[first:last], strict=True)
        rows.append((group, [(f"{low:g}", float(s)) for low, s in row]))
    return rows
