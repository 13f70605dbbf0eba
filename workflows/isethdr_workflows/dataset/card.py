"""The card of a dataset in Markdown: its contents with their units, and how it was made."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from isethdr_core.cli.terminal import duration
from isethdr_core.storage.atomic_write import write_text

from .generate import Generated
from .packs import file_lines, pack_lines
from .record import folder_of
from .splits import splits
from .summary import class_counts

CARD = "README.md"
COMPUTED = (
    "Every shape, surface and lamp is computed from parameters. The dataset contains no photograph,"
    " mesh or network made by others."
)
PACKS = "the meshes of the asset packs"
FILES = "the roads and the traffic of the files"


def write_card(dataset: Generated) -> Path:
    """Write the card of a dataset into its folder, and return its path."""
    path = folder_of(dataset.definition.name) / CARD
    write_text(path, card(dataset))
    return path


def card(dataset: Generated) -> str:
    """Return the card of a dataset as Markdown."""
    definition = dataset.definition
    made = dataset.made
    scenes = definition.scenes()
    parts = splits(scenes, definition.recipe.splits)
    families = Counter(record.family for record in made)
    of_families = ", ".join(f"{count} {name}" for name, count in families.items())
    seconds = sum(record.machine_s for record in made)
    size = sum(record.stored_bytes for record in made)
    noise = _noise(dataset)
    packs = pack_lines(dataset)
    files = file_lines(dataset)
    lines = [
        f"# {definition.name}",
        "",
        definition.recipe.about,
        "",
        f"{len(made)} of {definition.count} scenes are made{f' ({of_families})' * bool(made)}.",
        "",
        "## What a scene holds",
        "",
        "- `radiance` (light_group, wavelength, y, x): spectral radiance, W m-2 sr-1 nm-1, before"
        " any lens. Light groups add: any weighted sum of them is a valid scene.",
        "- `depth` (along the optical axis) and `distance` (along the ray), m; `instance`;"
        " `category`; `normal`.",
        "- In the attributes: objects with class, visible and full box, truncation, visible"
        " fraction, distance, and vertical illuminance towards the camera by light group at weight"
        " 1, lx; lamps with their luminance; the noise of each light group.",
        "- Radiance is rounded: by at most a twentieth of the standard error of a tile's luminance,"
        " with 6 to 12 mantissa bits.",
        "- `x` and `y` are tangents of the field angle, x to the right and y down.",
        "",
        "## How it was made",
        "",
        f"{_made_of(bool(packs), bool(files))} Spectra of lamps are computed from tables of the"
        " CIE. Light is simulated by path tracing, so it has the noise that is stated below.",
        "",
        f"    {definition.command}",
        "",
        f"- begun: {definition.created}",
        f"- versions: {', '.join(f'{k} {v}' for k, v in sorted(definition.versions.items()))}",
        f"- time: {duration(seconds)} for the scenes that are made; size: {size / 1e9:.3g} GB",
        f"- noise, relative, median of the scenes: {noise or 'not known'}",
        "",
        "## Parts",
        "",
        "All scenes of a road are in one part.",
        "",
        "| part | scenes |",
        "|---|---|",
        *(f"| {part} | {len(numbers)} |" for part, numbers in parts.items()),
        "",
        "## Objects",
        "",
        "| class | objects | scenes |",
        "|---|---|---|",
        *(f"| {row.category} | {row.objects} | {row.scenes} |" for row in class_counts(made)),
        "",
        "## Licence",
        "",
        "The program that makes the scenes is under the MIT licence."
        + (
            ""
            if packs or files
            else " Radiance and labels hold no picture, mesh or text of others."
        ),
        "",
        *_named("The scenes show meshes of these asset packs", packs),
        *_named("The scenes have roads or traffic of these files", files),
    ]
    return "\n".join(lines)


def _made_of(packs: bool, files: bool) -> str:
    """Return a text about the origin of the scenes.

    Parameters
    ----------
    packs, files : whether scenes use asset packs, and files of roads or traffic.
    """
    if not (packs or files):
        return COMPUTED
    others = " and ".join([PACKS] * packs + [FILES] * files)
    return f"Shapes, surfaces and lamps are computed from parameters, except {others} named below."


def _named(title: str, lines: list[str]) -> list[str]:
    """Return a list with its title; nothing if the list is empty."""
    return [f"{title}, each under its own licence:", "", *lines, ""] if lines else []


def _noise(dataset: Generated) -> str:
    groups = sorted({group for record in dataset.made for group in record.noise})
    medians = {
        group: float(np.median([r.noise[group] for r in dataset.made if group in r.noise]))
        for group in groups
    }
    return ", ".join(f"{group} {value:.2g}" for group, value in medians.items())
