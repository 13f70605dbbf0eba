"""Accuracy: error against run time and memory of every stage that can be made cheaper or better.

| file         | what is varied                                                    |
|--------------|-------------------------------------------------------------------|
| `point`      | one setting measured, and which settings no other beats           |
| `diagram`    | the picture of one stage: error against seconds                   |
| `changed`    | a setting that users need not know, for the time of a measurement |
| `transport`  | paths per tile of the renderer, per light group                   |
| `bands`      | bands that light is carried in                                    |
| `stored`     | mantissa bits kept in a store                                     |
| `denoise`    | the denoising preview in place of more paths                      |
| `psf`        | sub-bands of a point spread, and how far it reaches               |
| `field`      | places of the field at which a point spread is made               |
| `ghosts`     | pairs of surfaces and rays that ghosts are drawn from             |
| `ghosts_by_chance` | its reference: photons of chance                            |
| `basis`      | functionals of the spectrum in place of bands                     |
| `aberrated`  | the same through a pupil with a wavefront                         |
| `convolve`   | ways to convolve twelve decades of light                          |
| `dynamics`   | integrators of a pixel that overflows                             |
| `demosaic`   | ways to fill in missing colours                                   |
| `merge`      | rules that merge captures                                         |
| `metrics`    | how many pairs and draws a score is taken from                    |
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from isethdr_workflows.accuracy.diagram import draw
from isethdr_workflows.accuracy.point import as_rows

from isethdr_core.cli.progress import track
from isethdr_core.errors import ConfigError, did_you_mean

STAGES = (
    "transport",
    "bands",
    "denoise",
    "stored",
    "psf",
    "field",
    "ghosts",
    "basis",
    "aberrated",
    "convolve",
    "dynamics",
    "demosaic",
    "merge",
    "metrics",
)


def accuracy(stage: str = "", pictures: str = "", reference: int = 0) -> list[dict]:
    """Measure error against seconds and memory for every stage with an accuracy knob: one
    work-precision diagram each.

    Parameters
    ----------
    stage : one stage alone; empty takes all.
    reference : points per tile of the reference of the stage `psf`, the one that can outgrow
        memory; 0 takes its own.
    pictures : folder for the diagrams; empty draws none.

    Returns
    -------
    rows with stage, setting, error and what it is one of, CPU seconds, peak memory above the start
    (MB), mark (`default`, `peer`), front (no other setting is both better and cheaper), the
    reference and the reference's own error.

    Raises
    ------
    ConfigError : an unknown stage, or a reference that does not fit in memory.
    """
    if stage and stage not in STAGES:
        raise ConfigError(
            f"study accuracy has no stage {stage!r}{did_you_mean(stage, STAGES)}; a stage without"
            " knobs has no diagram"
        )
    if reference and stage != "psf":
        raise ConfigError(
            "study accuracy has a reference of a size to choose for the stage psf alone; type"
            " stage=psf"
        )
    rows = []
    for name in track([stage] if stage else list(STAGES), "stages"):
        works = import_module(f".{name}", __package__).measured(*([reference] if reference else []))
        rows += [row for work in works for row in as_rows(work)]
        if pictures:
            draw(works, Path(pictures) / f"accuracy_{name}.png")
    return rows
