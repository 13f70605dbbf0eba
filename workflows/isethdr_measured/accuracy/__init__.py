"""Accuracy: error against run time and memory of every stage with an accuracy setting.

| file         | what is varied                                                    |
|--------------|-------------------------------------------------------------------|
| `changed`    | changes an internal setting during a measurement                  |
| `transport`  | paths per tile of the renderer, per light group                   |
| `bands`      | width of the spectral bands                                       |
| `stored`     | mantissa bits kept in a store                                     |
| `denoise`    | the denoising preview in place of more paths                      |
| `psf`        | sub-bands of a point spread, and the size of its exact core       |
| `field`      | field points at which a point spread is computed                  |
| `ghosts`     | pairs of surfaces that are traced, and rays across a beam         |
| `ghosts_by_chance` | the reference of `ghosts`: random photons                   |
| `basis`      | functionals of the spectrum in place of bands                     |
| `aberrated`  | the same through a pupil with a wavefront                         |
| `convolve`   | methods of convolution, with lamps 1e8 times the background       |
| `dynamics`   | integrators of a pixel that overflows                             |
| `demosaic`   | demosaic methods                                                  |
| `merge`      | rules that merge captures                                         |
| `metrics`    | number of noise realisations that a score is averaged over        |

A measured setting is a `point` of `isethdr_workflows.accuracy`, and its `diagram` draws a stage.
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
    """Measure error against seconds and memory for every stage with an accuracy setting, as one
    work-precision diagram each.

    Parameters
    ----------
    stage : name of one stage; empty takes all.
    reference : points per tile and axis of the reference of the stage `psf`, the only reference
        that can outgrow memory; 0 takes the default.
    pictures : folder for the diagrams; empty draws none.

    Returns
    -------
    rows with stage, setting, error and the quantity that it is an error of, CPU seconds, peak
    memory above the start (MB), mark (`default`, `peer`, `view`), front (no other setting is both
    better and cheaper), the reference and the reference's own error.

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
