"""End of a training: final weights, calibrated variance, model file, card."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from isethdr_core.runs.provenance import versions

from ..card import write_card
from ..clock import Length
from ..torch_library import hardware, torch
from .export import export, stated_of
from .held_out import NEW_SHEETS, calibrate, rows_of_new_sheets, worst_ratio
from .loss import BLOCK, MEAN_WEIGHT, RELATIVE, VARIANCE_WEIGHT
from .networks.choice import multiple_px, reach_px
from .networks.linear_start import LEVELS
from .networks.picture_network import parameters
from .sheets import LUX, SHEET
from .training import (
    AVERAGED_FROM,
    DECAY,
    MODEL,
    Trained,
    final_network,
    half_precision,
    recipe_hash,
)

LEAST_RATIO = 0.8  # smallest and largest ratio of stated to true variance that is accepted
LARGEST_RATIO = 1.25
LARGEST_MEAN_ERROR = 10.0  # error of a mean luminance, percent, that is not yet a warning
LONG_MINUTES = 10.0  # length of a training after which means are usually right
LONG_STEPS = 1000
LOSSES = {
    "electrons": "squared error of X, Y, Z in electrons over (local mean of the raw + noise^2 + 1 +"
    f" {RELATIVE:g} local mean^2), the logarithm of its mean over blocks of {BLOCK} px;"
    f" {MEAN_WEIGHT:g} times the logarithm of 1 + the squared relative error of each picture's"
    " mean",
    "view": "absolute error of display values: pictures look better, but the mean luminance in the"
    " dark is biased; electrons of such a network are not absolute",
}


STARTS = {
    "linear": "the linear estimate of least squared error, one for each of"
    f" {len(LEVELS)} levels of signal over noise, solved before the training and kept; the network"
    " corrects its square root",
    "learned": "a linear filter of square roots, learned with the rest",
}


class Finished(NamedTuple):
    """The results of a finished training."""

    model: Path
    card: list[Path]
    rows: list[dict[str, Any]]  # held-out results by illuminance
    difference: float  # difference of the file from PyTorch, over the largest value


def finished(run: Trained, recipe: str, tell: Callable[[str], None]) -> Finished:
    """Calibrate the network, and write the model file and its card.

    Parameters
    ----------
    run : finished training.
    recipe : text of the recipe, JSON.
    tell : called with each line of text about the file.
    """
    network, weights = final_network(run)
    first, *others = run.pictures.values()
    calibrate(network, first.with_others(others))
    tables = {
        name: rows_of_new_sheets(network, sheets, run.brightest_lux, run.device)
        for name, sheets in run.held_out_sheets.items()
    }
    rows = list(tables.values())[-1]  # those of roads, if there are any
    worst = worst_ratio(rows)
    settings = run.settings
    multiple = multiple_px(run.camera)
    reach = reach_px(run.camera, settings.network, settings.size, settings.start)
    stated = {
        **stated_of(run.camera, multiple, reach),
        "calibration": [
            {"lux": row["lux"], "stated_over_true": round(row["stated_over_true"], 4)}
            for row in rows
        ],
        "range_e": [round(rows[0]["mean_e"], 4), round(rows[-1]["mean_e"], 1)],
        "loss": settings.loss,
        "recipe": recipe_hash(recipe),
    }
    path = run.folder / MODEL
    difference = export(network, run.camera, path, stated)
    tell(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB, differs by {difference:.1e}")
    if not LEAST_RATIO <= worst <= LARGEST_RATIO:
        tell(f"stated over true variance is {worst:.2f} at worst: isp=network calls it unknown")
    wrong = wrong_mean(tables)
    if wrong:
        more = longer(settings.length())
        tell(f"{wrong}; train longer, for example with {more} name={run.folder.name}_2")
    sections = sections_of(run, json.loads(recipe), weights, tables)
    sections["file"] = {
        "bytes": path.stat().st_size,
        "parameters": parameters(network),
        "largest_difference_from_pytorch": f"{difference:.1e} of the largest value",
        "recipe_sha256": recipe_hash(recipe),
    }
    title = f"{run.folder.name}: raw of {run.camera.name} to linear XYZ"
    return Finished(path, write_card(run.folder, title, sections), rows, difference)


def longer(length: Length) -> str:
    """Return the setting of a longer training, as typed. It is long enough for a good mean."""
    if length.minutes:
        return f"minutes={max(2 * length.minutes, LONG_MINUTES):g}"
    return f"steps={max(4 * length.steps, LONG_STEPS)}"


def wrong_mean(tables: Mapping[str, Sequence[Mapping[str, float]]]) -> str:
    """Return a sentence about the mean luminance that is farthest from the truth; "" if all means
    are near it. A mean is wrong if its error is larger than the limit beyond the half width of its
    interval, or if the half width is larger than the limit: then pictures differ in their errors.

    Parameters
    ----------
    tables : {source of pictures: rows of held-out scores, by illuminance}.
    """
    worst = LARGEST_MEAN_ERROR
    wrong = ""
    for name, rows in tables.items():
        for row in rows:
            error = row["mean_error_percent"]
            half = row["half_width_percent"]
            size = max(abs(error) - half, half)
            if size > worst:
                worst = size
                wrong = (
                    f"the mean luminance of {name} at {row['lux']:g} lux is wrong by"
                    f" {error:.3g} +- {half:.3g} %; expected at most {LARGEST_MEAN_ERROR:g} %"
                )
    return wrong


def sections_of(
    run: Trained,
    recipe: dict[str, Any],
    weights: str,
    tables: dict[str, list[dict[str, Any]]],
) -> dict[str, Any]:
    """Return the sections of the card, except that about the file.

    Parameters
    ----------
    run : finished training.
    recipe : recipe of the training.
    weights : description of the weights that were kept.
    tables : {source of pictures: rows of held-out scores, by illuminance}.
    """
    settings = run.settings
    progress = run.progress
    camera = run.camera
    half = half_precision(settings.precision, run.device)
    missing = [
        "seeds other than the one above: no interval over trainings",
        "light that varies within the exposure, rolling shutter, relative illumination of a lens",
    ]
    return {
        "purpose": "Linear XYZ in absolute units with a variance, from the electrons of one shot;"
        f" run it with isp=network model={MODEL}",
        "camera": {
            "sensor": camera.name,
            "filter_array": "/".join(camera.cell),
            "captures": f"{settings.captures}: {', '.join(camera.captures)}",
            "overrides": list(recipe["overrides"]),
            "illuminance_lux": [LUX[0], run.brightest_lux],
            "exposure": "as the sensor's own rule solves it for each sheet of 16 patches",
            "noise": "all that the sensor component makes, another device in each sheet",
        },
        "data": run.data.stated,
        "augmentation": "flips; patches of a sheet differ in light by a factor (sigma of its"
        " logarithm 0.7)",
        "network": {
            "kind": f"{settings.network}, {settings.size}",
            "start": STARTS[settings.start],
            "training": "from nothing; no weights of others",
        },
        "loss": {
            "kind": settings.loss,
            "formula": LOSSES[settings.loss],
            "variance": "likelihood of Student's t with 3 degrees of freedom, the picture's error"
            f" held fixed, weight {VARIANCE_WEIGHT}",
        },
        "optimiser": {
            "kind": "AdamW",
            "largest_rate": settings.rate,
            "weight_decay": DECAY,
            "schedule": f"linear rise over {progress.clock.warm_up():.0f} steps, times half a"
            " cosine that falls to 2 %",
            "weights": weights,
            "mean_of_weights": f"over the last {1 - AVERAGED_FROM:.0%} of the training",
            "precision": "bfloat16 inside, float32 start" if half else "float32",
        },
        "effort": {
            "length": str(settings.length()),
            "steps": progress.clock.step,
            "hours": round(progress.clock.seconds() / 3600, 4),
            "batch": f"{settings.batch} patches of {settings.patch_px} px, each at another"
            " illuminance",
            "hardware": hardware(run.device),
            "ended": progress.stopped or "at its length",
            "seed": settings.seed,
        },
        **{f"held_out_{name.replace(' ', '_')}": rows for name, rows in tables.items()},
        "variance": f"calibrated on the held-out patches that stop the training, {SHEET} of each"
        f" illuminance; the table is of {NEW_SHEETS * SHEET} others of the same pictures;"
        f" wanted: stated / true within {LEAST_RATIO:g} to {LARGEST_RATIO:g}",
        "not_done": missing + run.data.missing,
        "versions": {**{k: str(v) for k, v in versions().items()}, "torch": str(torch.__version__)},
        "settings": {k: v for k, v in asdict(settings).items()},
    }
